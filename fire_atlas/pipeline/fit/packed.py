"""What choices of frames take on pages: places of some sizes, and many choices take equal ones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import chain
from typing import NamedTuple, TypeAlias

from fire_atlas.atlas.gpu import with_textures
from fire_atlas.atlas.page_rules import PackingUnits, PageRules, Size, levels_apart
from fire_atlas.atlas.pages import firsts_of_equal
from fire_atlas.atlas.sheet import AtlasSheet, Heat
from fire_atlas.atlas.trim import trim_rects
from fire_atlas.core.errors import OutputError
from fire_atlas.formats.textures.memory import UNCOMPRESSED, largest_memory
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.fit.scaled import sprites_of
from fire_atlas.pipeline.pages.content import PageContent
from fire_atlas.pipeline.pages.layout import placed, trim_margin
from fire_atlas.recipe.gpu import blocks_of, formats_for, page_channels
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas

_Place: TypeAlias = tuple[int, int, int]
"""What equal frames share on a page: the number of the first of them, width and height, px."""


class Cells(NamedTuple):
    """The places of frames on pages: all that their packing depends on.

    Attributes:
        sizes: Their widths and heights, in the units in which they are packed. On one page they
            take the same room in any order, so they are sorted.
        shown: Of each of several animations, the numbers of its places.
    """

    sizes: tuple[Size, ...]
    shown: tuple[tuple[int, ...], ...]

    @property
    def area(self) -> int:
        """What the places cover, units squared."""
        return sum(width * height for width, height in self.sizes)

    def least_page(self, rules: PageRules) -> float:
        """Return the area of the smallest page, units squared, with room for what the places cover
        with their padding; infinity if the rules allow none."""
        padding = rules.padding
        padded = [(width + padding, height + padding) for width, height in self.sizes]
        covered = sum(width * height for width, height in padded)
        return rules.least_area(covered, max(map(min, padded)))


def cells_of(
    animations: Sequence[FinishedAnimation],
    choices: Sequence[tuple[int, ...]],
    atlas: Atlas,
    units: PackingUnits,
) -> Iterator[Cells]:
    """Yield the cells of each of ``choices`` among the frames of animations of one length.

    With compressed textures units are so many px that frames which are nearly equally large take
    equal cells, and most choices the same ones as another.
    """
    is_grid, is_sorted = atlas.layout == "grid", atlas.max_pages == 1
    trim = "animation" if is_grid and atlas.trim == "frame" else atlas.trim
    sprites = [sprites_of(animation) for animation in animations]
    margins = [trim_margin(atlas, animation.has_hard_edges) for animation in animations]
    rects = [
        trim_rects(of_one, trim, margin=margin)
        for of_one, margin in zip(sprites, margins, strict=True)
    ]
    count = len(sprites[0])
    firsts: Sequence[int] = range(count * len(sprites))
    if atlas.dedupe and not is_grid:
        firsts = firsts_of_equal(list(chain(*sprites)), list(chain(*rects)))

    def places_of(number: int, kept: tuple[int, ...]) -> list[_Place]:
        parts = [rects[number][i] for i in kept]
        if trim == "animation":  # no larger than what is kept
            some = [sprites[number][i] for i in kept]
            parts = trim_rects(some, trim, margin=margins[number])
        return [
            (firsts[number * count + i], part.width, part.height)
            for i, part in zip(kept, parts, strict=True)
        ]

    size_of = cache(lambda place: units.size(*place[1:]))
    for kept in choices:
        shown = [places_of(number, kept) for number in range(len(sprites))]
        places = list(dict.fromkeys(chain.from_iterable(shown)))
        if is_sorted:
            places.sort(key=size_of)
        sizes = tuple(map(size_of, places))
        numbers = {place: number for number, place in enumerate(places)}
        of_several = shown if len(shown) > 1 else []
        of_each = [[numbers[place] for place in of_one] for of_one in of_several]
        yield Cells(sizes, tuple(tuple(sorted(of) if is_sorted else of) for of in of_each))


class PackedChoices:
    """The pages on which choices are packed, once for all choices with equal cells.

    All searches share them: formats whose blocks are equally large are packed alike.
    """

    def __init__(self) -> None:
        """Begin with none packed."""
        self._cells: dict[tuple[int, PackingUnits], dict[tuple[int, ...], Cells]] = {}
        self._sheets: dict[tuple[PackingUnits, Cells], AtlasSheet | None] = {}

    def cells(
        self,
        animations: Sequence[FinishedAnimation],
        choices: Sequence[tuple[int, ...]],
        atlas: Atlas,
    ) -> list[Cells]:
        """Return the cells of each of ``choices`` among frames of one height."""
        units = PackingUnits.of(atlas)
        known = self._cells.setdefault((animations[0].frames[0].height, units), {})
        unknown = [kept for kept in choices if kept not in known]
        known.update(zip(unknown, cells_of(animations, unknown, atlas, units), strict=True))
        return [known[kept] for kept in choices]

    def sheet(
        self, cells: Cells, recipe: Recipe, animations: Mapping[str, FinishedAnimation]
    ) -> AtlasSheet | None:
        """Return the sheet, without its frames, on which animations with these cells are packed;
        None if it has too many pages, or a frame is too large for one."""
        key = PackingUnits.of(recipe.atlas), cells
        if key not in self._sheets:
            sheet = packed(recipe, animations)
            self._sheets[key] = sheet and replace(sheet, regions=(), animations=())
        return self._sheets[key]


def packed(recipe: Recipe, animations: Mapping[str, FinishedAnimation]) -> AtlasSheet | None:
    """Return the sheet on which animations are packed; None if it has more pages than the recipe
    allows, or a frame is too large for one."""
    atlas = recipe.atlas
    try:
        sheet = placed(recipe, PageContent(animations, {}))[0]
    except OutputError:  # a frame is too large for a page
        return None
    if atlas.max_pages != "none" and len(sheet.pages) > atlas.max_pages:
        return None
    return sheet if atlas.pixels != "heat" else replace(sheet, heat=Heat(atlas.pixels, "", ()))


def memory_of(sheet: AtlasSheet, atlas: Atlas) -> int:
    """Return the bytes that a sheet takes in the format of ``atlas`` that takes most."""
    return largest_memory(with_textures(sheet, atlas))


def least_bytes(atlas: Atlas) -> Fraction:
    """Return the bytes that a px of pages takes at least, with its mip levels, in the format that
    takes most."""
    if not atlas.gpu:
        return Fraction(UNCOMPRESSED["r8" if atlas.pixels == "heat" else "rgba8"])
    from fire_atlas.formats.textures.blocks import FORMATS

    blocks = [FORMATS[blocks_of(f)] for f in formats_for(atlas.gpu, page_channels(atlas.pixels))]
    levels = sum(Fraction(1, 4**level) for level in range(levels_apart(atlas)))
    return levels * max(Fraction(format_.block_bytes, format_.side**2) for format_ in blocks)
