"""Build a recipe: the whole pipeline from recipe to output files in one function."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fire_atlas.core.context import BuildContext, BuildOptions
from fire_atlas.core.progress import Progress, StageTimer
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.digest import tool_digest
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.outputs.ownership import commit
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.animation.contribute import contribute
from fire_atlas.pipeline.examine import examine
from fire_atlas.pipeline.files.exports import (
    at_their_places,
    exported_files,
    note_what_engines_need,
    track_files,
)
from fire_atlas.pipeline.files.images import write_images
from fire_atlas.pipeline.files.movies import movie_files
from fire_atlas.pipeline.files.written import (
    product_of,
    refuse_taken_names,
    write_files,
    write_manifest,
)
from fire_atlas.pipeline.input.check import CheckedRecipe
from fire_atlas.pipeline.input.open import (
    check_inputs,
    hash_inputs,
    input_files,
    open_input,
    open_ramps,
    open_texture,
    source_key,
)
from fire_atlas.pipeline.pages.content import build_statistics, page_content
from fire_atlas.pipeline.pages.layout import images, pack
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.located import located


@dataclass(frozen=True, slots=True)
class BuildReport:
    """The result of a build.

    Attributes:
        files: The outputs, in the order they were written.
        timings: Seconds spent in each stage.
        statistics: Figures about the result, as in the manifest.
        merged: Whether an engine's files that were there before have shaped any of these.
    """

    files: tuple[Path, ...]
    timings: dict[str, float]
    statistics: dict[str, Any]
    merged: bool


def build(
    loaded: CheckedRecipe, out: Path, options: BuildOptions, progress: Progress
) -> BuildReport | None:
    """Build one recipe into the folder ``out``: all outputs are written, or none.

    Returns:
        A report; None if a concurrent build, which this one waited for, made the same outputs.

    Raises:
        FireAtlasError: A problem that the user can fix; the previous outputs are unchanged.
    """
    recipe, timer = loaded.recipe, StageTimer()
    with (
        located(loaded.tree),
        Workers(options.jobs) as workers,
        Staging(out, recipe.name, progress.note, options.overwrite) as staging,
    ):
        if not options.force and why_stale(loaded.tree, out) is None:
            return None
        context = BuildContext(workers, progress, timer, options.max_pixels)
        tool = workers.start(tool_digest)
        with timer.measure("study"):
            examine(loaded, workers, options.max_pixels)
            inputs = hash_inputs(loaded, staging, workers)
        refuse_taken_names(recipe, staging)
        contributions, files = [], list[Path]()
        for part in loaded.parts:
            cells, ramps = open_texture(part, context), open_ramps(part, context)
            with located(part.tree, source_key(part)):
                with timer.measure("study"):
                    opened = open_input(part, context)
                contributions.append(contribute(part, opened, cells, ramps, context))
            files += input_files(opened, part)
        packed: LoadedRecipe = loaded
        if recipe.budget is not None:
            from fire_atlas.pipeline.fit.fit import fit

            with located(loaded.tree):
                fitted, atlas = fit(contributions[0], recipe, recipe.budget, context)
            contributions = [fitted]
            packed = replace(loaded, recipe=recipe.model_copy(update={"atlas": atlas}))
        content = page_content(contributions, packed, context)
        with timer.measure("pack"):
            sheets = pack(packed, content, context)
        with timer.measure("write"):
            sheets = at_their_places(sheets, recipe.exports, out, progress)
            drawn = images(sheets, content, recipe.atlas, recipe.maps, context)
            outputs, figures = write_images(list(drawn), recipe.atlas, staging, context)
            product = product_of(sheets, content.animations, loaded, staging)
            movies = movie_files(recipe.movies, sheets[0], content, context)
            exported = exported_files(recipe.exports, product, loaded.templates)
            outputs += write_files(exported, staging)
            note_what_engines_need(recipe.exports, product, progress)
            outputs += write_files(track_files(recipe.tracks, product), staging)
            outputs += write_files(movies, staging)
            statistics = build_statistics(contributions, content, sheets[0], figures)
            check_inputs(inputs, files, loaded, context)
            outputs += [write_manifest(loaded, tool.result(), inputs, outputs, statistics, staging)]
            written = commit(recipe.name, outputs, staging)
    return BuildReport(written, timer.seconds, statistics, staging.has_merged)
