"""An atlas as writers of files see it: pages, regions, animations, maps."""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

from fire_atlas.core.pixels import Bytes
from fire_atlas.recipe.output import Engine


class Rect(NamedTuple):
    """A rectangle, px: top-left corner and size."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Sprite:
    """A finished frame, without what is empty around it.

    Attributes:
        image: (h, w, 4) uint8, encoded as the pages are.
        x, y: Where its top-left corner lies in the frame, px.
        frame_width, frame_height: The whole frame, px.
        lit: The part of the frame that counts as visible; None if nothing does.
    """

    image: Bytes
    x: int
    y: int
    frame_width: int
    frame_height: int
    lit: Rect | None


@dataclass(frozen=True, slots=True)
class AnimationFrames:
    """An animation that goes onto the pages.

    Attributes:
        name: Its name; its frames are called ``name/0000`` and so on.
        sprites: Its frames, in playing order.
        duration: Of each frame, ms.
        loop: Whether it plays again and again.
        foot: (x, y) of the effect's foot in the frame, px, y down; None: the middle of its bottom.
    """

    name: str
    sprites: tuple[Sprite, ...]
    duration: float
    loop: bool
    foot: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Page:
    """A page.

    Attributes:
        file: File name.
        width, height: Size, px.
        safe_mip: Deepest mip level at which no frame is mixed with a neighbour; None if even the
            page itself has to be sampled without filtering.
    """

    file: str
    width: int
    height: int
    safe_mip: int | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """A frame of an animation and where its pixels are. All in px, y down.

    Attributes:
        name: Name in the atlas, e.g. ``campfire/0000``.
        page: Index of the page.
        x, y: Top-left corner on the page. Frames with the same pixels may share it.
        width, height: The trimmed frame, upright.
        rotated: On the page it lies turned by 90° clockwise: ``height`` wide and ``width`` high.
        trim_x, trim_y: Where the trimmed frame's top-left corner is in the untrimmed one.
        frame_width, frame_height: The untrimmed frame.
        anchor: (x, y) of the pivot in 0..1 of the untrimmed frame, y down.
        duration: Milliseconds.
    """

    name: str
    page: int
    x: int
    y: int
    width: int
    height: int
    rotated: bool
    trim_x: int
    trim_y: int
    frame_width: int
    frame_height: int
    anchor: tuple[float, float]
    duration: float

    @property
    def page_size(self) -> tuple[int, int]:
        """Width and height as it lies on the page, px."""
        return (self.height, self.width) if self.rotated else (self.width, self.height)

    @property
    def trimmed(self) -> bool:
        """Whether borders were cut off."""
        return (self.width, self.height) != (self.frame_width, self.frame_height)


@dataclass(frozen=True, slots=True)
class Animation:
    """What plays: its name, those of its frames in order, and whether it starts over."""

    name: str
    frames: tuple[str, ...]
    loop: bool


@dataclass(frozen=True, slots=True)
class CellGrid:
    """How a page of uniform cells divides: the same for all pages of a sheet. px.

    Attributes:
        columns, rows: Cells of a page.
        cell_width, cell_height: Distance from cell to cell, gutter included.
    """

    columns: int
    rows: int
    cell_width: int
    cell_height: int


@dataclass(frozen=True, slots=True)
class MotionScale:
    """How strong the motion vectors of a sheet are.

    Attributes:
        engine: Whose encoding they are in: ``channels.encoding`` knows its formula and units.
        scale: Motion of a decoded 1, in the unit of that encoding.
        pixels: The same along x and y, px of this sheet a frame.
        cell_uv: The same in the UV of one cell; None where there are no cells.
        longest: The longest motion along x and y, px of this sheet.
        gutter: Px beyond its frame that every cell has, along x and y; None where there are none.
    """

    engine: Engine
    scale: float
    pixels: tuple[float, float]
    cell_uv: tuple[float, float] | None
    longest: tuple[float, float]
    gutter: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class SheetMap:
    """Images beside the pages, in their layout.

    Attributes:
        kind: ``motion``, ``flame`` or ``flakes``.
        files: File name beside each page.
        motion: Scale of motion vectors; None for the others, which are encoded as the pages.
    """

    kind: str
    files: tuple[str, ...]
    motion: MotionScale | None = None


@dataclass(frozen=True, slots=True)
class AtlasSheet:
    """A packed atlas as exporters see it.

    Attributes:
        name: File stem of the outputs; ``campfire@0.5x`` for one of half the size.
        title: The name without a scale.
        scale: Size of this variant, 1 or a part of it.
        fps: Frames per second of the (first) animation.
        alpha: ``straight``, ``premultiplied`` or ``additive``.
        blend_space: ``srgb`` or ``linear``.
        image_format: Ending of the page files: ``png`` or ``webp``.
        pages, regions: The pages and, in playing order, the frames.
        animations: What plays; each frame belongs to one of them.
        grid: How pages divide into cells, where they do.
        maps: What lies beside the pages.
    """

    name: str
    title: str
    scale: float
    fps: float
    alpha: str
    blend_space: str
    image_format: str
    pages: tuple[Page, ...]
    regions: tuple[Region, ...]
    animations: tuple[Animation, ...]
    grid: CellGrid | None = None
    maps: tuple[SheetMap, ...] = ()

    @property
    def files(self) -> list[str]:
        """All images, the pages first."""
        maps = [file for each in self.maps for file in each.files]
        return [page.file for page in self.pages] + maps

    @property
    def motion(self) -> MotionScale | None:
        """Scale of the motion vectors, where there are any."""
        return next((each.motion for each in self.maps if each.motion), None)

    def map(self, kind: str) -> SheetMap:
        """Return the maps of that kind, of which there are some."""
        return next(each for each in self.maps if each.kind == kind)

    def file(self, page: int, ending: str) -> str:
        """Return the name of what belongs to a page: ``fire.json``, ``fire-1.json``, ..."""
        return f"{self.name}-{page}{ending}" if page else f"{self.name}{ending}"

    def regions_of(self, page: int) -> list[Region]:
        """Return the frames on a page, in playing order."""
        return [region for region in self.regions if region.page == page]

    def with_safe_mips(self, levels: list[int | None]) -> Self:
        """Return the sheet with the deepest safe mip level of each page filled in."""
        pages = zip(self.pages, levels, strict=True)
        return replace(self, pages=tuple(replace(page, safe_mip=level) for page, level in pages))
