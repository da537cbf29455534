"""What the atlas half decided, in the words exporters read."""

from dataclasses import dataclass

from fire_atlas.core.pixels import Bytes


@dataclass(frozen=True, slots=True)
class Sprite:
    """A finished frame, trimmed.

    Attributes:
        image: (h, w, 4) uint8, encoded as the pages are.
        x, y: Where its top-left corner lies in the frame, px.
    """

    image: Bytes
    x: int
    y: int


@dataclass(frozen=True, slots=True)
class Page:
    """A page: its file name and size in px."""

    file: str
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Region:
    """A frame of the animation and where its pixels are. All in px, y down.

    Attributes:
        name: Name in the atlas, e.g. ``campfire/0000``.
        page: Index of the page.
        x, y, width, height: The trimmed pixels on the page.
        trim_x, trim_y: Their top-left corner in the untrimmed frame.
        duration: Milliseconds.
    """

    name: str
    page: int
    x: int
    y: int
    width: int
    height: int
    trim_x: int
    trim_y: int
    duration: float


@dataclass(frozen=True, slots=True)
class AtlasSheet:
    """A packed atlas as exporters see it.

    Attributes:
        name: File stem of the outputs.
        frame_width, frame_height: Size of an untrimmed frame, px.
        anchor: (x, y) of the effect's foot in 0..1 of the untrimmed frame, y down.
        fps: Frames per second.
        alpha: ``straight``, ``premultiplied`` or ``additive``.
        blend_space: ``srgb`` or ``linear``.
        pages, regions: The pages and, in playing order, the frames.
        animations: Name of each animation and the region names it plays.
    """

    name: str
    frame_width: int
    frame_height: int
    anchor: tuple[float, float]
    fps: float
    alpha: str
    blend_space: str
    pages: tuple[Page, ...]
    regions: tuple[Region, ...]
    animations: dict[str, tuple[str, ...]]
