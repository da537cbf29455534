"""Say that one page is not enough, or refuse more than ``atlas.max_pages``; and what would do."""

import math
from collections.abc import Callable, Iterator, Mapping

from fire_atlas.atlas.page_rules import Size
from fire_atlas.atlas.remedies import (
    PageFrames,
    nearly_largest,
    split_animations,
    sufficient_size,
)
from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import OutputError
from fire_atlas.effect.flakes.emission import ROOMY
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.recipe.frame_size import LONGER_SIDE, FrameSize, SizedFrame
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.output import Atlas
from fire_atlas.recipe.source import FramesSource, ProfileSource, Source
from fire_atlas.sources.framing import LARGE, SMALLEST
from fire_atlas.sources.images import detect_format
from fire_atlas.sources.json_atlas import is_atlas
from fire_atlas.sources.listing import frame_range, locate

_MAX_NAMES = 12
"""Maximum number of animations that a note names."""

_LEAST_HEIGHT, _LEAST_FRAMES = 16, 2
"""Smaller and fewer frames are not advised."""


def check_page_count(
    sheet: AtlasSheet,
    loaded: LoadedRecipe,
    animations: Mapping[str, FinishedAnimation],
    context: BuildContext,
) -> None:
    """Note how one page would be enough for a ``sheet`` of several, if the recipe states no limit.

    Raises:
        OutputError: It has more pages than ``atlas.max_pages``.
    """
    atlas, count = loaded.recipe.atlas, len(sheet.pages)
    wanted = 1 if atlas.max_pages == "none" else atlas.max_pages
    if len(sheet.animations) > 1:
        _note_split(sheet, atlas, context)
    if count <= wanted:
        return
    enough = "one is enough" if wanted == 1 else f"{wanted} are enough"
    remedies = list(_remedies(PageFrames.of(sheet), loaded, animations, wanted))
    advice = f"{enough} with {_one_of(remedies)}" if remedies else "fewer or smaller frames help"
    if atlas.max_pages != "none":
        raise OutputError(f"the build needs {count} pages; {advice}", key=("atlas", "max_pages"))
    context.progress.note(f"needs {count} pages; {advice}")


def note_empty_cells(sheet: AtlasSheet, cells: Size, context: BuildContext) -> None:
    """Note how many of the stated cells, (columns, rows), no frame fills: a player of all of them
    shows nothing there."""
    count = math.prod(cells) * len(sheet.pages)
    if empty := count - len(PageFrames.of(sheet).sizes):
        context.progress.note(f"atlas.grid: {empty} of {count} cells stay empty")


def _remedies(
    frames: PageFrames,
    loaded: LoadedRecipe,
    animations: Mapping[str, FinishedAnimation],
    pages: int,
) -> Iterator[str]:
    """Yield what to write into the recipe so that so many ``pages`` are enough."""
    recipe, atlas = loaded.recipe, loaded.recipe.atlas
    as_high = ""
    sizes = {tuple(animation.statistics.get("frame_size", ())) for animation in animations.values()}
    if len(sizes) == 1 and (size := sizes.pop()) and not loaded.members:
        width, height = size
        most = max(len(animation) for animation in frames.animations)
        as_many, as_high = _kept(loaded, most, height)
        is_footage = isinstance(recipe.source, FramesSource)

        def made_at(other: int) -> PageFrames:
            # Of another size or length, generated fire is another fire; and where flakes are few,
            # a single one decides how large its frame is.
            is_alike = is_footage and (other >= ROOMY or recipe.flakes == "none")
            return frames if is_alike else frames.untrimmed((width, height))

        def scaled_to(smaller: int) -> PageFrames:
            return made_at(smaller).scaled(smaller / height)

        def fits_at(smaller: int) -> bool:
            return scaled_to(smaller).fit(atlas, pages)

        if name := _smaller_size(recipe.source, height, fits_at):
            yield f"source.size: {name}"
        elif smaller := nearly_largest(scaled_to, atlas, pages, _LEAST_HEIGHT, height - 1):
            yield _as_high(recipe.source, size, smaller) + as_many
        if recipe.timeline.tail is False and not recipe.changes_in_game:
            shortened = made_at(height).shortened
            if fewer := nearly_largest(shortened, atlas, pages, _LEAST_FRAMES, most - 1):
                # A pingpong has an even number of frames.
                yield f"timeline.frames: {fewer - fewer % 2}{as_high}"
    if max_size := sufficient_size(frames, atlas, pages):
        yield f"atlas.max_size: {max_size}{as_high}"


def _smaller_size(
    source: Source | None, height: int, fits_at: Callable[[int], bool]
) -> FrameSize | None:
    """Return the largest size by name at which frames, now ``height`` px high, fit; None if none
    does, or the source states no ``size``."""
    if not isinstance(source, SizedFrame | ProfileSource) or source.size is None:
        return None
    now = LONGER_SIDE[source.size]
    fitting = [
        name
        for name, side in LONGER_SIDE.items()
        if side < now and fits_at(math.ceil(height * side / now))
    ]
    return fitting[-1] if fitting else None


def _as_high(source: Source | None, frame: Size, height: int) -> str:
    """Return what to set for a ``frame`` of (width, height), px, to be ``height`` px high."""
    wide = without = ""
    if isinstance(source, SizedFrame):
        wide = f" and source.width: {max(_LEAST_HEIGHT, frame[0] * height // frame[1])}"
    if isinstance(source, SizedFrame | ProfileSource) and source.size is not None:
        shaped = isinstance(source, SizedFrame) and source.aspect is not None
        without = f" (without source.size{' and source.aspect' if shaped else ''})"
    return f"source.height: {height}{wide}{without}"


def _kept(loaded: LoadedRecipe, count: int, height: int) -> tuple[str, str]:
    """Return what else to set so that footage stays as long, and as high, as it is.

    At another height its best loop may be a longer one; and a large video is as high as fits a
    page.
    """
    source, timeline = loaded.recipe.source, loaded.recipe.timeline
    if not isinstance(source, FramesSource):
        return "", ""
    path = loaded.source_files[("source", "path")]
    located = locate(path)
    if not located.single and count == len(frame_range(source, len(located.files), path)):
        return "", ""
    is_open = timeline.loop != "none" and timeline.frames is None and not timeline.tail
    as_many = f" and timeline.frames: {count}" if is_open else ""
    if source.height != "auto" or not SMALLEST <= height <= LARGE or not located.single:
        return as_many, ""
    file = located.files[0]
    is_video = not is_atlas(file) and detect_format(file) == "video"
    return as_many, f" and source.height: {height}" if is_video else ""


def _one_of(remedies: list[str]) -> str:
    *others, last = remedies
    return f"{', '.join(others)} or {last}" if others else last


def _note_split(sheet: AtlasSheet, atlas: Atlas, context: BuildContext) -> None:
    """Name the animations of several that no page can hold, and the page size that could."""
    split = split_animations(sheet)
    if not split:
        return
    names = ", ".join(sheet.animations[i].name for i in split[:_MAX_NAMES])
    more = f" and {len(split) - _MAX_NAMES} more" if len(split) > _MAX_NAMES else ""
    frames = PageFrames.of(sheet)
    sizes = [sufficient_size(frames.alone(i), atlas) for i in split]
    known = [size for size in sizes if size is not None]
    advice = (
        f"with atlas.max_size: {max(known)} one could"
        if len(known) == len(sizes)
        else "none that a recipe may ask for could; smaller or fewer frames help"
    )
    context.progress.note(f"no page can hold all frames of {names}{more}: {advice}")
