"""The whole line in one function: recipe in, finished files out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fire_atlas.core.clock import Clock
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.manifest import (
    Input,
    describe,
    maker,
    manifest_name,
    refuse_others,
    stale_outputs,
)
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.animate import animate_views
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.contribution import Contribution, build_statistics, named
from fire_atlas.pipeline.interruption import Interruptible
from fire_atlas.pipeline.open import files_of, open_input
from fire_atlas.pipeline.pack_only import pack_only
from fire_atlas.pipeline.pages import images, pack
from fire_atlas.pipeline.write import product_of, write_file, write_files, write_images
from fire_atlas.pipeline.writers import exported_files, light_files, track_files
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.output import missing_extra
from fire_atlas.sources.sprites import Sprites


@dataclass(frozen=True, slots=True)
class BuildReport:
    """What a build did.

    Attributes:
        files: The outputs, in the order they were written.
        timings: Seconds by stage.
        statistics: Figures about the result, as in the manifest.
    """

    files: tuple[Path, ...]
    timings: dict[str, float]
    statistics: dict[str, Any]


def build(loaded: LoadedRecipe, out: Path, jobs: int, progress: Progress) -> BuildReport:
    """Build one recipe into the folder ``out``: everything is written, or nothing is.

    Raises:
        FireAtlasError: Anything a person can mend; the previous outputs are whole.
        KeyboardInterrupt: A signal came. The previous outputs are whole, or the new ones are.
    """
    recipe, clock = loaded.recipe, Clock()
    if missing := missing_extra(recipe.atlas):
        raise OutputError(missing)
    with Interruptible(progress) as progress, Workers(jobs) as workers, Staging(out) as staging:
        context = BuildContext(workers, progress, clock)
        made_by = workers.start(maker)
        templates = loaded.templates
        template_inputs = _hashed([*templates.values()], loaded, staging, workers)
        contributions, inputs = list[Contribution](), list[Input]()
        for part in loaded.parts:
            with clock.measure("study"):
                opened = open_input(part, context)
                inputs += _hashed(files_of(opened), part, staging, workers)
            if isinstance(opened, Sprites):
                contributions.append(pack_only(part.recipe, opened, context))
            else:
                contributions.append(animate_views(part.recipe, opened, context))
        animations = named(contributions)
        with clock.measure("pack"):
            sheets = pack(recipe.name, animations, recipe.atlas, recipe.maps, progress)
        with clock.measure("write"):
            drawn = images(sheets, animations.values(), recipe.atlas, recipe.maps)
            outputs = write_images(list(drawn), recipe.atlas, staging, context)
            product = product_of(sheets, animations, recipe.tracks, staging)
            outputs += write_files(exported_files(recipe.exports, product, templates), staging)
            outputs += write_files(track_files(recipe.tracks, product), staging)
            outputs += write_files(light_files(product), staging)
            statistics = build_statistics(contributions, sheets[0])
            manifest = describe(
                loaded.tree, _resolved(loaded), inputs + template_inputs, outputs, statistics,
                made_by.result(),
            )  # fmt: skip
            name = manifest_name(recipe.name)
            outputs.append(write_file(OutputFile(name, "manifest", manifest), staging))
            names = [output.name for output in outputs]
            refuse_others(out, recipe.name, outputs)
            staging.commit(stale_outputs(out, recipe.name, names))
    return BuildReport(tuple(out / name for name in names), clock.seconds, statistics)


def _hashed(
    files: Sequence[Path], part: LoadedRecipe, staging: Staging, workers: Workers
) -> list[Input]:
    """Hash files that the build reads, and refuse to write over them or the recipe's own files.

    Before they are read in full: what changes meanwhile is not up to date afterwards.
    """
    staging.keep([*files, *part.tree.files])
    return list(workers.map(Input.of, files))


def _resolved(loaded: LoadedRecipe) -> str:
    """Return the recipe with all its defaults, and its members with theirs."""
    recipes = (loaded.recipe, *(member.recipe for member in loaded.members))
    return "\n".join(recipe.model_dump_json() for recipe in recipes)
