"""Build the sheets of an atlas: trim, deduplicate and pack the frames of its animations.

An atlas has one sheet for each scale of its pages, and each page a safe mip level: the deepest at
which no frame is mixed with its neighbours.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.pack import QUICK, THOROUGH, Packing, pack
from fire_atlas.atlas.page_rules import PackingUnits
from fire_atlas.atlas.sheet import (
    Animation,
    AnimationFrames,
    AtlasSheet,
    CellGrid,
    Page,
    Rect,
    Region,
    Sprite,
)
from fire_atlas.atlas.trim import Trim, part_of, trim_rects, up_to, visible_rect
from fire_atlas.core.errors import OutputError
from fire_atlas.core.named_sprite import Border, NamedSprite, refuse_equal_names
from fire_atlas.recipe.output import Atlas, Pivot

_Content: TypeAlias = tuple[int, int, int, int, int, int, bytes]
"""Size of a trimmed frame; position and size of its visible part; a hash of that part's pixels."""

_MANY, _TRIES_OF_MANY = 256, 96
"""With more single sprites than the first, so many pages are tried: a third of the time of
``QUICK``, and for the 994 icons of a desktop 0.1 % more to store."""

_COMPARED_TOGETHER = 256
"""Number of frames compared with all others at a time, to limit memory."""


def build_sheets(
    name: str,
    animations: Sequence[AnimationFrames],
    settings: Atlas,
    *,
    singles: Sequence[AnimationFrames] = (),
    textures: Sequence[AnimationFrames] = (),
    shares: bool = True,
) -> tuple[AtlasSheet, ...]:
    """Return the sheet of all ``animations`` in each scale, the largest first, with equal layouts.

    Args:
        name: File stem of the outputs.
        animations: The animations.
        settings: The recipe's section.
        singles: Single sprites, each a frame that no animation plays.
        textures: The cells of the textures of flakes, which are no animations.
        shares: Whether frames with the same pixels may share one place.

    Raises:
        OutputError: A frame is larger than a page, or two have one name.
    """
    units = PackingUnits.of(settings)
    packed = [*animations, *singles, *textures]
    parts = _parts([*animations, *singles], textures, _trim_of(settings), units.step)
    sprites = [sprite for animation in packed for sprite in animation.sprites]
    keeps_all = settings.layout == "grid" or not (settings.dedupe and shares)
    originals = _firsts_in_place(packed) if keeps_all else firsts_of_equal(sprites, parts)
    listed = _listed(name, animations)
    others = [_with_frame_names(still, f"{name}/{still.name}") for still in (*singles, *textures)]
    names = [frame for named in (*listed, *others) for frame in named.frames]
    refuse_equal_names(names)
    _refuse_too_large(names, parts, units)
    if settings.grid is not None:
        _refuse_too_many_cells(parts, settings, units)
    counts = [len(animation.sprites) for animation in packed]
    quick = QUICK if len(singles) <= _MANY else _TRIES_OF_MANY
    tries = THOROUGH if settings.compression == "small" else quick
    packing, cells = _packed(parts, originals, counts, settings, units, tries)
    regions = _regions(names, packed, parts, packing, settings, units.step)
    played = sum(len(animation.frames) for animation in listed)
    placed = played + len(singles)
    whole = AtlasSheet(
        name=name,
        title=name,
        scale=1.0,
        fps=1000 / animations[0].duration if animations else 0.0,
        alpha=settings.alpha,
        thins=settings.thins,
        blend_space=settings.blend_space,
        image_format=settings.format,
        bits=settings.bits,
        pages=tuple(Page("", *size) for size in packing.pages),
        regions=tuple(regions[:played]),
        animations=listed,
        grid=cells,
        singles=tuple(regions[played:placed]),
        cells=tuple(replace(cell, anchor=(0.5, 0.5)) for cell in regions[placed:]),
    )
    return tuple(_variant(whole, scale, settings) for scale in settings.scales)


def _parts(
    animations: Sequence[AnimationFrames],
    textures: Sequence[AnimationFrames],
    trim: Trim,
    unit: int,
) -> list[Rect]:
    """Return the part of its frame that each sprite shows; cells of textures stay whole."""
    parts = [part for frames in animations for part in _parts_of(frames, trim, unit)]
    return parts + [
        part for texture in textures for part in trim_rects(texture.sprites, "none", unit)
    ]


def _parts_of(animation: AnimationFrames, trim: Trim, unit: int) -> list[Rect]:
    """Return the parts of the frames of an animation; nine-patches stay whole, as their borders are
    stretched from the edges of the frame."""
    parts = trim_rects(animation.sprites, trim, unit, animation.margin)
    if all(sprite.border is None for sprite in animation.named):
        return parts
    whole = trim_rects(animation.sprites, "none", unit)
    return [
        part if sprite.border is None else uncut
        for part, uncut, sprite in zip(parts, whole, animation.named, strict=True)
    ]


def _listed(name: str, animations: Sequence[AnimationFrames]) -> tuple[Animation, ...]:
    """Name all frames: ``campfire/0000`` if there is one animation, else ``name/walk/0000``."""
    if [animation.name for animation in animations] == [name]:
        return (_with_frame_names(animations[0], name),)
    return tuple(
        _with_frame_names(animation, f"{name}/{animation.name}") for animation in animations
    )


def _with_frame_names(animation: AnimationFrames, prefix: str) -> Animation:
    if animation.named:
        own = tuple(sprite.name for sprite in animation.named)
        return Animation(animation.name, own, animation.loop, animation.variant)
    digits = max(4, len(str(len(animation.sprites) - 1)))
    names = (f"{prefix}/{i:0{digits}}" for i in range(len(animation.sprites)))
    return Animation(animation.name, tuple(names), animation.loop, animation.variant)


def _trim_of(settings: Atlas) -> Trim:
    """Return how frames are trimmed; in a grid, all frames of an animation are trimmed alike.

    A flipbook plays cell after cell without offsets: trimmed frame by frame, it would jitter.
    """
    if settings.layout == "grid" and settings.trim == "frame":
        return "animation"
    return settings.trim


def _packed(
    parts: Sequence[Rect],
    originals: Sequence[int],
    counts: Sequence[int],
    settings: Atlas,
    units: PackingUnits,
    tries: int,
) -> tuple[Packing, CellGrid | None]:
    """Return where each part goes, px; ``originals[i]`` is the part whose pixels part i shows.

    ``counts`` are the numbers of parts of each animation, ``tries`` that of pages to try.
    """
    number = {original: i for i, original in enumerate(sorted(set(originals)))}
    sizes = [units.size(parts[i].width, parts[i].height) for i in number]
    shown = iter(number[original] for original in originals)
    animations = [list(islice(shown, count)) for count in counts]
    cells, px, edge = None, units.px, units.edge
    if settings.layout == "grid":
        from fire_atlas.atlas.grid import pack_grid

        different = [tuple(dict.fromkeys(frames)) for frames in animations]
        packing, cells = pack_grid(sizes, different, units.rules)
        places = tuple(packing.places[i] for frames in animations for i in frames)
        packing = Packing(packing.pages, places)
        cells = CellGrid(cells.columns, cells.rows, cells.cell_width * px, cells.cell_height * px)
    else:
        packing = pack(sizes, animations, units.rules, tries)
    pages = tuple((width * px, height * px) for width, height in packing.pages)
    in_px = (
        place._replace(x=place.x * px + edge, y=place.y * px + edge) for place in packing.places
    )
    return Packing(pages, tuple(in_px)), cells


def _firsts_in_place(packed: Sequence[AnimationFrames]) -> list[int]:
    """Return for each sprite the index of the first of those that are packed into one place: the
    four frames that lie in the channels of one cell (``heat4``), equal or not."""
    firsts, start = list[int](), 0
    for animation in packed:
        firsts += [
            start + i - i % animation.frames_per_place for i in range(len(animation.sprites))
        ]
        start += len(animation.sprites)
    return firsts


def firsts_of_equal(sprites: Sequence[Sprite], parts: Sequence[Rect]) -> list[int]:
    """Return for each sprite the index of the first one with the same pixels in its part: equal
    frames are stored once."""
    sizes = Counter((rect.width, rect.height) for rect in parts)
    first: dict[_Content, int] = {}
    return [
        # Most frames of a fire have a size that no other has: their pixels need not be compared.
        first.setdefault(_content(sprite, rect), i) if sizes[rect.width, rect.height] > 1 else i
        for i, (sprite, rect) in enumerate(zip(sprites, parts, strict=True))
    ]


def _content(sprite: Sprite, rect: Rect) -> _Content:
    image, x, y = part_of(sprite, rect)
    lit = visible_rect(image, 0) if image.size else None
    if lit is None:
        return rect.width, rect.height, 0, 0, 0, 0, b""
    image = image[lit.y : lit.y + lit.height, lit.x : lit.x + lit.width]
    digest = hashlib.blake2b(image.tobytes(), digest_size=16).digest()
    return rect.width, rect.height, x + lit.x, y + lit.y, lit.width, lit.height, digest


def _refuse_too_large(names: Sequence[str], parts: Sequence[Rect], units: PackingUnits) -> None:
    edge, largest = units.edge + units.rules.border * units.px, units.rules.largest * units.px
    for name, part in zip(names, parts, strict=True):
        needed = up_to(units.px, max(part.width, part.height) + 2 * edge)
        if needed > largest:
            around = f" plus {edge} px of border on each side" if edge else ""
            raise OutputError(
                f"frame {name} is {part.width} × {part.height} px{around}, but a page may only be "
                f"{largest} px wide and high: raise `atlas.max_size` to {needed} or "
                f"more, or make the frames smaller with `source.height` or `source.size`",
                key=("atlas", "max_size"),
            )


def _refuse_too_many_cells(parts: Sequence[Rect], settings: Atlas, units: PackingUnits) -> None:
    """Refuse a stated grid whose cells, as large as the frames, take more than a page."""
    from fire_atlas.atlas.grid import stated_page
    from fire_atlas.atlas.remedies import PageFrames, largest

    sizes = [units.size(part.width, part.height) for part in parts]
    columns, rows = units.rules.cells or (1, 1)
    width, height = (side * units.px for side in stated_page(sizes, units.rules))
    most, needed = units.rules.largest * units.px, max(width, height)
    if needed <= most:
        return
    whole = PageFrames(tuple((part.width, part.height) for part in parts), (range(len(parts)),))
    percent = largest(lambda n: whole.scaled(n / 100).fit(settings, len(parts)), 1, 99)
    smaller = f"make the frames {percent} % as high with `source.height` or `source.size`"
    remedies = [
        *([f"raise `atlas.max_size` to {needed}"] if needed <= settings.largest_size else []),
        "ask for fewer cells",
        *([smaller] if percent else []),
    ]
    raise OutputError(
        f"atlas.grid: {columns} × {rows} cells of {width // columns} × {height // rows} px take a "
        f"page of {width} × {height} px, but it may only be {most} px wide and high: "
        f"{' or '.join([', '.join(remedies[:-1]), remedies[-1]])}"
    )


def _regions(
    names: Sequence[str],
    animations: Sequence[AnimationFrames],
    parts: Sequence[Rect],
    packing: Packing,
    settings: Atlas,
    unit: int,
) -> list[Region]:
    frames = [
        (animation, i, animation.named[i] if animation.named else None)
        for animation in animations
        for i in range(len(animation.sprites))
    ]
    regions = []
    placed = zip(names, frames, parts, packing.places, strict=True)
    for name, (animation, i, named), part, place in placed:
        sprite = animation.sprites[i]
        width, height = up_to(unit, sprite.frame_width), up_to(unit, sprite.frame_height)
        foot = animation.foot and _snapped(animation.foot, unit)
        pivot = settings.pivot if named is None else _pivot_of(named, settings.pivot)
        x, y = _pivot(pivot, sprite.frame_width, sprite.frame_height, foot)
        regions.append(
            Region(
                name=name,
                page=place.page,
                x=place.x,
                y=place.y,
                width=part.width,
                height=part.height,
                rotated=place.rotated,
                trim_x=part.x,
                trim_y=part.y,
                frame_width=width,
                frame_height=height,
                anchor=(x / width, y / height),
                duration=animation.duration_of(i),
                border=None if named is None else _border_in(width, height, sprite, named),
            )
        )
    return regions


def _pivot_of(sprite: NamedSprite, pivot: Pivot) -> Pivot:
    """Return the pivot of a sprite on pages with this one: a sprite has no foot but its middle."""
    return sprite.pivot or ("center" if pivot == "base" else pivot)


def _border_in(width: int, height: int, sprite: Sprite, named: NamedSprite) -> Border | None:
    """Return the border of a sprite in a frame of that size, px, which may be larger than it."""
    if named.border is None:
        return None
    left, top, right, bottom = named.border
    return Border(
        left, top, right + width - sprite.frame_width, bottom + height - sprite.frame_height
    )


def _pivot(
    pivot: Pivot, width: int, height: int, foot: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the pivot in px of the frame."""
    match pivot:
        case "base":
            return foot or (width / 2, float(height))
        case "bottom":
            return width / 2, float(height)
        case "center":
            return width / 2, height / 2
        case "top":
            return width / 2, 0.0
    return pivot[0] * width, pivot[1] * height


def _snapped(foot: tuple[float, float], unit: int) -> tuple[float, float]:
    """Return the nearest point on multiples of ``unit`` px: a foot between pixels would blur a
    sprite that stands on whole pixels."""
    x, y = (math.floor(length / unit + 0.5) * unit for length in foot)
    return x, y


def _variant(whole: AtlasSheet, scale: float, settings: Atlas) -> AtlasSheet:
    """Return the sheet in another scale; all px of ``whole`` are multiples of 1 / ``scale``."""

    def part(length: int) -> int:
        return round(length * scale)

    sheet = replace(
        whole,
        name=whole.title if scale == 1 else f"{whole.title}@{scale:g}x",
        scale=scale,
        regions=tuple(_scaled_region(region, scale) for region in whole.regions),
        singles=tuple(_scaled_region(single, scale) for single in whole.singles),
        cells=tuple(_scaled_region(cell, scale) for cell in whole.cells),
        grid=whole.grid and CellGrid(
            whole.grid.columns, whole.grid.rows,
            part(whole.grid.cell_width), part(whole.grid.cell_height),
        ),
    )  # fmt: skip
    pages = [
        Page(sheet.file(i, f".{settings.format}"), part(page.width), part(page.height))
        for i, page in enumerate(whole.pages)
    ]
    sheet = replace(sheet, pages=tuple(pages))
    return sheet.with_safe_mips(_safe_mips(sheet, math.ceil(settings.extrude * scale)))


def _scaled_region(region: Region, scale: float) -> Region:
    def part(length: int) -> int:
        return round(length * scale)

    return replace(
        region,
        x=part(region.x),
        y=part(region.y),
        width=part(region.width),
        height=part(region.height),
        trim_x=part(region.trim_x),
        trim_y=part(region.trim_y),
        frame_width=part(region.frame_width),
        frame_height=part(region.frame_height),
        border=region.border and region.border.scaled(scale),
    )


class _Spans(NamedTuple):
    """First pixel of each frame along one axis, and the pixel after its last one: (n,)."""

    start: NDArray[np.int64]
    end: NDArray[np.int64]


def _safe_mips(sheet: AtlasSheet, extrude: int) -> list[int | None]:
    """Return for each page the deepest mip level at which no frame is mixed with another.

    Frames are extruded by ``extrude`` px. Mip levels are averages of blocks, sampled with bilinear
    filtering. None: even the page itself must be sampled without filtering.
    """
    return [_deepest(sheet, page, extrude) for page in range(len(sheet.pages))]


def _deepest(sheet: AtlasSheet, page: int, extrude: int) -> int | None:
    places = sorted({(r.x, r.y, *r.page_size) for r in sheet.regions_of(page)})
    x, y, width, height = np.array(places, np.int64).T
    across, down = _Spans(x, x + width), _Spans(y, y + height)
    last = max(sheet.pages[page].width, sheet.pages[page].height).bit_length() - 1
    for level in range(last + 1):
        if _mixes(across, down, extrude, 1 << level):
            return level - 1 if level else None
    return last


def _mixes(across: _Spans, down: _Spans, extrude: int, block: int) -> bool:
    """Whether any frame is mixed with another in a mip level whose texels are ``block`` px wide."""
    read = [_read_by_filter(spans, block) for spans in (across, down)]
    drawn = [_Spans(s.start - extrude, s.end + extrude) for s in (across, down)]
    count = len(across.start)
    for first in range(0, count, _COMPARED_TOGETHER):
        some = slice(first, first + _COMPARED_TOGETHER)
        overlap = np.ones((len(across.start[some]), count), np.bool_)
        for axis_read, axis_drawn in zip(read, drawn, strict=True):
            overlap &= axis_read.start[some, None] < axis_drawn.end
            overlap &= axis_read.end[some, None] > axis_drawn.start
        if np.count_nonzero(overlap) > len(overlap):  # each frame overlaps itself
            return True
    return False


def _read_by_filter(spans: _Spans, block: int) -> _Spans:
    """Return the px that are averaged into the texels read when a whole frame is filtered."""
    half = block / 2
    start = np.floor((spans.start - half) / block).astype(np.int64) * block
    end = (np.floor((spans.end - half) / block).astype(np.int64) + 2) * block
    return _Spans(start, end)
