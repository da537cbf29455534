"""The finished layout of an atlas, which all writers of files read: pages, regions, animations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, Protocol, Self

from numpy.typing import NDArray

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.polygon import Point, Triangle, doubled_area
from fire_atlas.core.named_sprite import Border, NamedSprite
from fire_atlas.core.pixels import Bytes
from fire_atlas.recipe.gpu import Channels, page_channels
from fire_atlas.recipe.output import Engine


class Rect(NamedTuple):
    """A rectangle, px: top-left corner and size."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Sprite:
    """A finished frame, without the empty space around it.

    Attributes:
        image: (h, w, 4) uint8, encoded as the pages are.
        x, y: Position of the image's top-left corner in the frame, px.
        frame_width, frame_height: Size of the whole frame, px.
        visible: Rectangle of the frame that counts as visible; None if nothing does.
        deep: The same image in 16 bits a channel; None if the pages have 8, or nothing is visible.
    """

    image: Bytes
    x: int
    y: int
    frame_width: int
    frame_height: int
    visible: Rect | None
    deep: CompressedImage | None = None

    def in_bits(self, bits: int) -> "PlacedImage":
        """Return the image in 8 or 16 bits a channel."""
        return self.deep if bits == 16 and self.deep is not None else self


class PlacedImage(Protocol):
    """A frame to be drawn on a page, of any type of pixels: what drawing needs to know of it."""

    @property
    def image(self) -> NDArray[Any]:
        """Its pixels, (h, w, 4)."""

    @property
    def x(self) -> int:
        """Position of the image's left edge in the frame, px."""

    @property
    def y(self) -> int:
        """Position of the image's top edge in the frame, px."""


@dataclass(frozen=True, slots=True)
class AnimationFrames:
    """An animation to be placed on the pages.

    Attributes:
        name: Its name; its frames are called ``name/0000`` and so on, if they have no names.
        sprites: Its frames, in playing order.
        duration: Duration of each frame, ms; 0 of a single sprite, which is not played.
        loop: Whether it loops.
        foot: (x, y) of the effect's foot in the frame, px, y down; None: the middle of its bottom.
        frames_per_place: Number of consecutive frames, whose sprites are the same, that share one
            place.
        named: Of the user's sprites, what each frame has of its own; empty for other frames.
        margin: Empty px kept around its trimmed frames.
        holds: How many of these durations each frame is shown for; empty: one.
        variant: Number of the variant of its fire that it is of; None if that has one only.
    """

    name: str
    sprites: tuple[Sprite, ...]
    duration: float
    loop: bool
    foot: tuple[float, float] | None
    frames_per_place: int = 1
    named: tuple[NamedSprite, ...] = ()
    margin: int = 0
    holds: tuple[int, ...] = ()
    variant: int | None = None

    def duration_of(self, i: int) -> float:
        """Return the duration of frame ``i``, ms."""
        return self.duration * self.holds[i] if self.holds else self.duration


@dataclass(frozen=True, slots=True)
class Page:
    """A page of the atlas.

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
class Mesh:
    """A polygon around all that is visible of a frame, to be drawn instead of its rectangle.

    Attributes:
        vertices: Clockwise; px of the trimmed frame, not rotated, y down.
        triangles: The triangles that it consists of, as indices of vertices.
    """

    vertices: tuple[Point, ...]
    triangles: tuple[Triangle, ...]

    @property
    def area(self) -> float:
        """The area that it covers, px²."""
        return doubled_area(self.vertices) / 2


@dataclass(frozen=True, slots=True)
class Region:
    """A frame of an animation and the place of its pixels on a page. All in px, y down.

    Attributes:
        name: Name in the atlas, e.g. ``campfire/0000``.
        page: Index of the page.
        x, y: Top-left corner on the page. Frames with the same pixels may share it.
        width, height: Size of the trimmed frame, not rotated.
        rotated: Whether it is turned by 90° clockwise on the page: ``height`` wide, ``width`` high.
        trim_x, trim_y: Position of the trimmed frame's top-left corner in the untrimmed frame.
        frame_width, frame_height: Size of the untrimmed frame.
        anchor: (x, y) of the pivot in 0..1 of the untrimmed frame, y down.
        duration: Duration, ms; 0 of a single sprite, which is not played.
        mesh: What of it is drawn; None: its rectangle.
        channel: The channel of the page that has its heat, ``r``, ``g``, ``b`` or ``a``; None if it
            is in all of them.
        border: Its border as a nine-patch, which is then not trimmed; None if it is none.
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
    mesh: Mesh | None = None
    channel: str | None = None
    border: Border | None = None

    @property
    def page_size(self) -> tuple[int, int]:
        """Width and height on the page, px: exchanged if rotated."""
        return (self.height, self.width) if self.rotated else (self.width, self.height)

    @property
    def trimmed(self) -> bool:
        """Whether borders were cut off."""
        return (self.width, self.height) != (self.frame_width, self.frame_height)

    @property
    def drawn_area(self) -> float:
        """The area of the trimmed frame that is drawn, px²."""
        return self.width * self.height if self.mesh is None else self.mesh.area

    @property
    def fills_rectangle(self) -> bool:
        """Whether all of the trimmed frame is drawn."""
        return self.drawn_area == self.width * self.height

    def on_page(self, point: Point) -> Point:
        """Return where on the page a point of the trimmed frame is, px."""
        x, y = (self.height - point[1], point[0]) if self.rotated else point
        return self.x + x, self.y + y


def common_canvas(frames: Sequence[Region]) -> tuple[tuple[int, int], list[tuple[int, int]]]:
    """Return the size of a canvas for all ``frames``, aligned at their pivots, and the top-left
    corner of each untrimmed frame on it; px."""
    pivots = [
        (round(f.anchor[0] * f.frame_width), round(f.anchor[1] * f.frame_height)) for f in frames
    ]
    left, top = max(x for x, _ in pivots), max(y for _, y in pivots)
    right = max(f.frame_width - x for f, (x, _) in zip(frames, pivots, strict=True))
    bottom = max(f.frame_height - y for f, (_, y) in zip(frames, pivots, strict=True))
    return (left + right, top + bottom), [(left - x, top - y) for x, y in pivots]


@dataclass(frozen=True, slots=True)
class Animation:
    """An animation: its name, the names of its frames in playing order, and whether it loops.

    Attributes:
        variant: Number of the variant of its fire that it is of; None if that has one only.
    """

    name: str
    frames: tuple[str, ...]
    loop: bool
    variant: int | None = None

    @property
    def stem(self) -> str:
        """What begins the names of all animations of its variant; empty if there is one only."""
        return "" if self.variant is None else stem_of_variant(self.name, self.variant)


def variant_title(variant: int, name: str = "") -> str:
    """Return the name of an animation of a variant, called ``name`` within that; without one, of
    the only animation of it."""
    return f"v{variant}/{name}" if name else f"v{variant}"


def stem_of_variant(name: str, variant: int) -> str:
    """Return an animation's name up to the word for its variant: ``torch/v1`` of
    ``torch/v1/view_0``."""
    words = name.split("/")
    return "/".join(words[: words.index(variant_title(variant)) + 1])


Phase = Literal["ignite", "burn", "extinguish"]
"""Whether a fire is being lit, burns, or is being put out."""


@dataclass(frozen=True, slots=True)
class State:
    """An animation as a state of a fire that a game changes.

    Attributes:
        animation: Its name.
        wind: Level of wind of a loop, if it is one of several; None otherwise.
        following: Name of the animation that what plays once leads to; None for a loop, and for
            what ends with a fire that is out.
        phase: The phase that it shows, of a fire that is lit and put out; None otherwise.
        variant: Number of the variant of the fire; None if that has one only.
    """

    animation: str
    wind: float | None = None
    following: str | None = None
    phase: Phase | None = None
    variant: int | None = None

    @property
    def is_loop(self) -> bool:
        """Whether it goes on for ever."""
        return self.wind is not None or self.phase == "burn"


@dataclass(frozen=True, slots=True)
class StateTransition:
    """A step from a frame of one animation to a frame of another that nobody sees.

    Attributes:
        before: Name of the animation that is left.
        frame: Its last frame that is shown.
        after: Name of the animation that follows.
        entry: Its first frame that is shown.
    """

    before: str
    frame: int
    after: str
    entry: int


@dataclass(frozen=True, slots=True)
class StateGraph:
    """Which animations may follow one another, and from which frame to which.

    Attributes:
        states: The loops by increasing wind, then the transitions between them; or the loop of a
            fire that is lit and put out, then how it is lit, and how it is put out. Of several
            variants, one after the other.
        transitions: All steps between them. None leads from one variant to another.
    """

    states: tuple[State, ...]
    transitions: tuple[StateTransition, ...]

    @property
    def winds(self) -> tuple[float, ...]:
        """The winds of its loops, increasing; none of a fire in one wind."""
        winds = (state.wind for state in self.states if state.wind is not None)
        return tuple(dict.fromkeys(winds))

    @property
    def first_loop(self) -> str:
        """Name of the loop that the light of all animations is measured against."""
        return next(state.animation for state in self.states if state.is_loop)

    def of_phase(self, phase: Phase) -> tuple[str, ...]:
        """Return the names of the animations that show a phase, first the main one."""
        return tuple(state.animation for state in self.states if state.phase == phase)

    def of_each_variant(self) -> tuple[Self, ...]:
        """Return the graph of each variant: of a fire that has one only, all of it."""
        numbers = dict.fromkeys(state.variant for state in self.states)
        return tuple(self._of_variant(number) for number in numbers)

    def _of_variant(self, variant: int | None) -> Self:
        states = tuple(state for state in self.states if state.variant == variant)
        own = {state.animation for state in states}
        steps = tuple(step for step in self.transitions if step.before in own)
        return replace(self, states=states, transitions=steps)

    def as_variant(self, number: int) -> Self:
        """Return the graph as that of a variant, with the names of its animations."""

        def title(name: str) -> str:
            return variant_title(number, name)

        states = tuple(
            replace(
                state,
                animation=title(state.animation),
                following=state.following and title(state.following),
                variant=number,
            )
            for state in self.states
        )
        steps = tuple(
            replace(step, before=title(step.before), after=title(step.after))
            for step in self.transitions
        )
        return replace(self, states=states, transitions=steps)

    @classmethod
    def joined(cls, graphs: Sequence[Self]) -> Self:
        """Return the graph of several variants."""
        return cls(
            tuple(state for graph in graphs for state in graph.states),
            tuple(step for graph in graphs for step in graph.transitions),
        )


@dataclass(frozen=True, slots=True)
class CellGrid:
    """The grid of equal cells into which every page of a sheet is divided.

    Attributes:
        columns, rows: Number of cells across and down a page.
        cell_width, cell_height: Size of a cell, px, gutter included.
    """

    columns: int
    rows: int
    cell_width: int
    cell_height: int


@dataclass(frozen=True, slots=True)
class VectorScale:
    """The scale of a sheet's vectors, of motion or of haze: what a decoded value of 1 means.

    Attributes:
        engine: Engine whose encoding they are in; ``channels.encoding`` has its formula and units.
        scale: The scale in the unit of that encoding.
        pixels: The scale along x and y, px of this sheet; of motion, per frame.
        cell_uv: The scale in the UV of one cell; None if there are no cells.
        longest: Longest vectors along x and y, px of this sheet; of motion, per frame.
        gutter: Minimum gap between a frame and its cell's edges in x and y, px; None if no cells.
    """

    engine: Engine
    scale: float
    pixels: tuple[float, float]
    cell_uv: tuple[float, float] | None
    longest: tuple[float, float]
    gutter: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class SheetMap:
    """Images beside the pages, one per page and with its layout.

    Attributes:
        kind: Its name, such as ``motion``.
        files: File name of each page's map.
        is_data: Whether its values are no sRGB colours: importers must not change them.
        is_under: Whether it is drawn under the pages.
        channels: Number of channels of 8 bits that clients read; 0 if they read floats.
        vectors: Scale of the vectors of motion and haze; None for other maps.
        white: The quantity at the largest byte of a map of one channel: of depth, px of this sheet.
    """

    kind: str
    files: tuple[str, ...]
    is_data: bool
    is_under: bool = False
    channels: Channels = 4
    vectors: VectorScale | None = None
    white: float | None = None


CHANNELS = "rgba"
"""The channels of a page, in their order in a pixel."""


RAMP_WIDTH = 256
"""Entries of a ramp, one for each value of a byte of heat."""


@dataclass(frozen=True, slots=True)
class Heat:
    """How pages of heat get their colours.

    Attributes:
        pixels: ``heat``: a value a pixel; ``heat4``: four frames in the channels of a pixel.
        ramp: File name of the colours by heat: 256 wide, a row for each ramp.
        rows: Names of these ramps.
    """

    pixels: str
    ramp: str
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class GpuTexture:
    """An image of a sheet once more, as a compressed texture with mip levels.

    Attributes:
        file: File name.
        image: File name of the image.
        blocks: How blocks of pixels are encoded: ``bc7``, ``astc-6x6``, ...
        levels: Number of mip levels, the image itself included.
    """

    file: str
    image: str
    blocks: str
    levels: int


@dataclass(frozen=True, slots=True)
class AtlasSheet:
    """A packed atlas in one scale.

    Attributes:
        name: File stem of the outputs; ``campfire@0.5x`` at half size.
        title: The name without the scale.
        scale: Scale of this variant, at most 1.
        fps: Frames per second of the (first) animation; 0 without one.
        alpha: ``straight``, ``premultiplied`` or ``additive``.
        thins: Whether thin light covers less than it shines; see ``Atlas.cover``.
        blend_space: ``srgb`` or ``linear``.
        image_format: Ending of the page files: ``png`` or ``webp``.
        bits: Bits a channel of the pages and layers, 8 or 16.
        pages, regions: The pages and, in playing order, the frames of animations.
        animations: The animations; each frame belongs to one of them.
        grid: The cells of the pages; None if frames are packed.
        maps: Images beside the pages: vectors and layers.
        states: In which order the animations may follow one another; None if each plays alone.
        singles: Single sprites, which no animation plays.
        cells: The cells of the textures of flakes, whole: no borders are cut off.
        gpu: The images as compressed textures, if they are written as such.
        heat: How its pages get their colours, which are encoded as ``alpha`` says; None if they
            have colours.
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
    states: StateGraph | None = None
    singles: tuple[Region, ...] = ()
    cells: tuple[Region, ...] = ()
    bits: int = 8
    gpu: tuple[GpuTexture, ...] = ()
    heat: Heat | None = None
    thins: bool = False

    @property
    def placed(self) -> tuple[Region, ...]:
        """All that has a place on a page: frames of animations, single sprites, cells."""
        return (*self.regions, *self.singles, *self.cells)

    @property
    def files(self) -> list[str]:
        """File names of all images, the pages first."""
        maps = [file for sheet_map in self.maps for file in sheet_map.files]
        return [page.file for page in self.pages] + maps

    @property
    def motion(self) -> VectorScale | None:
        """Scale of the motion vectors; None if there are none."""
        return next(
            (sheet_map.vectors for sheet_map in self.maps if sheet_map.kind == "motion"), None
        )

    @property
    def has_meshes(self) -> bool:
        """Whether frames have meshes: then all have."""
        return any(region.mesh is not None for region in self.placed)

    def has_map(self, kind: str) -> bool:
        """Whether there are maps of that kind."""
        return any(sheet_map.kind == kind for sheet_map in self.maps)

    def map(self, kind: str) -> SheetMap:
        """Return the maps of that kind, which must exist."""
        return next(sheet_map for sheet_map in self.maps if sheet_map.kind == kind)

    def file(self, page: int, ending: str) -> str:
        """Return the name of a page's file with that ending: ``fire.json``, ``fire-1.json``, ..."""
        return f"{self.name}-{page}{ending}" if page else f"{self.name}{ending}"

    def images(self, page: int) -> list[str]:
        """Return the names of a page's file and of its maps."""
        return [self.pages[page].file, *(sheet_map.files[page] for sheet_map in self.maps)]

    def map_of(self, image: str) -> SheetMap | None:
        """Return the maps that an image is one of; None for a page."""
        return next((sheet_map for sheet_map in self.maps if image in sheet_map.files), None)

    def channels_of(self, image: str) -> Channels:
        """Return how many channels of 8 bits clients read of an image."""
        found = self.map_of(image)
        if found is not None:
            return found.channels
        return page_channels("color" if self.heat is None else self.heat.pixels)

    def textures_of(self, image: str) -> tuple[GpuTexture, ...]:
        """Return the compressed textures of an image."""
        return tuple(texture for texture in self.gpu if texture.image == image)

    def regions_of(self, page: int) -> list[Region]:
        """Return the frames on a page, in playing order, then single sprites and cells."""
        return [region for region in self.placed if region.page == page]

    def at(self, places: Mapping[str, str]) -> Self:
        """Return the sheet with other names for some of its images, by the names they have."""

        def place(file: str) -> str:
            return places.get(file, file)

        return replace(
            self,
            pages=tuple(replace(page, file=place(page.file)) for page in self.pages),
            maps=tuple(
                replace(sheet_map, files=tuple(map(place, sheet_map.files)))
                for sheet_map in self.maps
            ),
            gpu=tuple(replace(texture, image=place(texture.image)) for texture in self.gpu),
            heat=self.heat and replace(self.heat, ramp=place(self.heat.ramp)),
        )

    def with_safe_mips(self, levels: list[int | None]) -> Self:
        """Return the sheet with the deepest safe mip level of each page filled in."""
        pages = zip(self.pages, levels, strict=True)
        return replace(self, pages=tuple(replace(page, safe_mip=level) for page, level in pages))
