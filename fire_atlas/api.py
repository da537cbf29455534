"""Build, check and look at effects from Python: what the commands of the same names do.

Paths in recipes are relative to the recipe; ``overrides`` are as after ``--set``. All functions
raise a ``FireAtlasError``, whose message names recipe, line and key.

>>> import fire_atlas
>>> fire_atlas.check("campfire.yaml", overrides=["source.height=80"])
()
>>> outcome = fire_atlas.build("campfire.yaml", overrides=["source.height=80"])
>>> "campfire.png" in [file.name for file in outcome.files]
True
>>> fire_atlas.build("campfire.yaml", overrides=["source.height=80"]).fresh
True
>>> found = fire_atlas.inspect_atlas("build/campfire.json")
>>> found.animations[0].loop
True
>>> fire_atlas.write_preview("build/campfire.json", "campfire.html").name
'campfire.html'
>>> fire_atlas.load_recipe("campfire.yaml", overrides=["flakes.rate=99"]).recipe.flakes.rate
99.0
>>> fire_atlas.check("campfire.yaml", overrides=["flakes.rtae=99"])
Traceback (most recent call last):
fire_atlas.core.errors.RecipeError: --set flakes.rtae: unknown key; did you mean flakes.rate?
"""

from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.context import BuildOptions
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import read_file
from fire_atlas.core.progress import Progress, SilentProgress
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.outputs.folder import default_folder
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.outputs.manifest import MAX_MANIFEST_BYTES, decode_manifest, manifest_name
from fire_atlas.outputs.outcome import Outcome, fresh_outcome
from fire_atlas.outputs.recovery import tidy
from fire_atlas.outputs.staging import refuse_existing, write_whole
from fire_atlas.pipeline.build import build as build_loaded
from fire_atlas.pipeline.examine import examine_alone
from fire_atlas.pipeline.input.check import CheckedRecipe, load_checked
from fire_atlas.preview.inspection import Inspection, inspection_of
from fire_atlas.preview.kinds import PreviewKind, as_played, color_of, is_preview, preview_of
from fire_atlas.preview.sentences import BuildSentences
from fire_atlas.preview.singles import with_singles_played
from fire_atlas.recipe.tree import read_tree


def load_recipe(recipe: Path | str, *, overrides: Sequence[str] = ()) -> CheckedRecipe:
    """Load and validate a recipe with all that it extends and its members.

    Returns:
        Its settings with all defaults (``.recipe``), and its files.

    Raises:
        RecipeError: It is invalid, or exceeds a limit of what it writes.
        OutputError: It needs an optional package that is not installed.
    """
    return load_checked(read_tree(Path(recipe), overrides))


def check(recipe: Path | str, *, overrides: Sequence[str] = ()) -> tuple[str, ...]:
    """Check a recipe and its inputs: what passes, a build does not refuse before its first frame.

    Returns:
        What is to be noted about the inputs.

    Raises:
        FireAtlasError: A build would be refused.
    """
    return examine_alone(load_recipe(recipe, overrides=overrides))


def build(
    recipe: Path | str,
    out: Path | str | None = None,
    *,
    overrides: Sequence[str] = (),
    jobs: int | None = None,
    force: bool = False,
    overwrite: bool = False,
    max_pixels: int = MAX_PIXELS,
    progress: Progress | None = None,
) -> Outcome:
    """Build a recipe, if its outputs are not up to date: all outputs are written, or none.

    Args:
        recipe: The recipe file.
        out: The output folder; default: ``build`` beside the recipe.
        overrides: Keys to change, like ``flakes.rate=80``.
        jobs: Number of threads; default: one for each core. No result depends on it.
        force: Build even if the outputs are up to date.
        overwrite: Replace even files that no build wrote.
        max_pixels: Limit on the pixels of an input picture.
        progress: Told of stages, steps and notes.

    Returns:
        The outputs, and whether they were up to date.

    Raises:
        FireAtlasError: Something is wrong that the message says how to mend; the outputs of an
            earlier build are unchanged.
    """
    tree, progress = read_tree(Path(recipe), overrides), progress or SilentProgress()
    folder = default_folder(tree.path) if out is None else Path(out)
    tidy(folder, tree.name, progress.note)
    if not force and why_stale(tree, folder) is None:
        return fresh_outcome(tree, folder)
    options = BuildOptions.of(jobs, max_pixels, overwrite, force)
    report = build_loaded(load_checked(tree), folder, options, progress)
    if report is None:
        return fresh_outcome(tree, folder)
    return Outcome(list(report.files), report.timings, report.statistics)


def inspect_atlas(atlas: Path | str) -> Inspection:
    """Measure a built atlas, given the JSON of its first page.

    Returns:
        Its pages, memory, frames, loops, overdraw, maps and flakes; ``as_json()`` has them as plain
        values.

    Raises:
        FireAtlasError: It is no atlas, or one of its files is missing or damaged.
    """
    found = with_singles_played(read_atlas(Path(atlas)))
    return inspection_of(found, sentences_on(found))


def sentences_on(atlas: AtlasFile) -> BuildSentences:
    """Return what the manifest beside an atlas says of its build; nothing if it is missing.

    Raises:
        SourceError: It is damaged.
    """
    manifest = atlas.path.with_name(manifest_name(atlas.sheet.title))
    if not manifest.exists():
        return BuildSentences()
    try:
        data = read_file(manifest, MAX_MANIFEST_BYTES)
        return BuildSentences.of(decode_manifest(data).statistics)
    except (OSError, ValueError) as error:
        raise SourceError(
            f"{manifest}: is not a manifest that fire-atlas wrote ({type(error).__name__}: {error})"
            f"; build the recipe again"
        ) from error


def write_preview(
    atlas: Path | str,
    to: Path | str,
    *,
    kind: PreviewKind = "page",
    background: str = "#101014",
    overwrite: bool = False,
) -> Path:
    """Write a preview of a built atlas: an HTML page that plays it, or a picture.

    Args:
        atlas: The JSON of its first page.
        to: The file to write; an earlier preview there is replaced.
        kind: ``page``, ``gif``, ``webp``, ``apng``, or ``sheet``: a contact sheet.
        background: Colour behind the fire, as in CSS; animated pictures may be ``transparent``.
        overwrite: Replace even a file that is no preview.

    Returns:
        The file written.

    Raises:
        FireAtlasError: It is no atlas, the colour is none, or the file is taken.
    """
    target, color = Path(to), color_of(background, kind, "background")
    if not overwrite and not is_preview(target, kind):
        refuse_existing([target])
    played = as_played(read_atlas(Path(atlas)), kind)
    budget = sentences_on(played).budget if kind == "page" else None
    write_whole(target, preview_of(played, kind, color, budget=budget), lambda note: None)
    return target
