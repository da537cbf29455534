"""How maps of a kind are made: the parts that each of them has, in this order."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, Protocol, TypeAlias, cast

from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, PlacedImage, Rect, SheetMap
from fire_atlas.core.clip import Clip, FrontSurface
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import Bytes, Pixels, Plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.composition.smoke import Smoke
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.maps.kinds import MapKind, kinds_in
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps

FrameData: TypeAlias = Sequence[PlacedImage] | Bytes
"""What is kept of a frame for a map: what is drawn on the pages of each scale, the largest first;
or, of motion, a small picture (h, w, 4)."""


@dataclass(frozen=True, slots=True)
class FrameParts:
    """A frame of which maps are made.

    Attributes:
        flame: (H, W, 4), the flame as the page shows it, without smoke that is apart.
        moving: The same with its smoke, as it moves.
        flakes: Composes the flakes without a flame behind them, (H, W, 4).
        light: Computes the light of all layers before it is exposed, (H, W, 4).
        smoke: The smoke under the flame; None if it is not apart.
        form: The form of the fire; None if no map of it is made.
        cover: Returns how much of what is behind it a picture (H, W, 4) of flame or flakes hides,
            (H, W); None: as much as its coverage says.
        visible: What is visible of the frame, px; known for maps that are cut to it.
        shared: What several maps are made of, by name.
    """

    flame: Picture
    moving: Picture
    flakes: Callable[[], Picture]
    light: Callable[[], Pixels]
    smoke: Smoke | None = None
    form: FrontSurface | None = None
    cover: Callable[[Picture], Plane | None] = lambda picture: None
    visible: Rect | None = None
    shared: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class AnimationParts:
    """An animation of which maps are made.

    Attributes:
        sizes: Width and height of each frame, px.
        loop: Whether frame 0 follows the last one.
        skipped: By frame number, the time (0..1) of a source frame between it and the next, and
            what gives its flame (H, W, 4).
        clip, study, field: The clip, what holds for all of it, and the field of its air; None of
            sprites that are only packed, and ``field`` of effects that have none.
        frames: What was kept of each frame for one kind, in playing order.
    """

    sizes: Sequence[tuple[int, int]]
    loop: bool
    skipped: Mapping[int, tuple[float, Callable[[], Picture]]] = field(default_factory=dict)
    clip: Clip | None = None
    study: FlameStudy | None = None
    field: FieldRecord | None = None
    frames: Sequence[FrameData] = ()


class MappedFrame(Protocol):
    """A rendered frame, with what is kept of it for each map."""

    @property
    def maps(self) -> Mapping[str, FrameData]:
        """By kind."""


class MappedAnimation(Protocol):
    """A finished animation, with what is kept of it for each map."""

    @property
    def frames(self) -> Sequence[MappedFrame]:
        """In playing order."""

    @property
    def maps(self) -> Mapping[str, Any]:
        """By kind; of kinds that are made frame by frame, None."""


class Maker:
    """Makes the maps of a module's kinds, part by part; a subclass has the parts of its kinds."""

    def of_frame(self, kind: MapKind, parts: FrameParts, recipe: Recipe) -> FrameData:
        """Return what is kept of a frame."""
        return ()

    def of_animation(self, parts: AnimationParts, recipe: Recipe, context: BuildContext) -> Any:
        """Return what is found of the whole animation; None if nothing is."""
        return None

    def statistics(self, found: Any) -> dict[str, Any]:
        """Return what the manifest states of ``found``, as from ``of_animation``."""
        return {}

    def seen(self, found: Any, i: int) -> Rect | None:
        """Return where a map shows anything in frame ``i``, px; None: only where the page does."""
        return None

    def margin(self, found: Sequence[Any]) -> int:
        """Return how many px around all frames must be kept free for it."""
        return 0

    def described(
        self, kind: MapKind, sheet: AtlasSheet, animations: Sequence[MappedAnimation], maps: Maps
    ) -> SheetMap:
        """Return what a sheet says of its maps."""
        return files_of(kind, sheet)

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[Any],
        edges: Edges,
        workers: Workers,
    ) -> NDArray[Any]:
        """Draw one page (H, W, 4); ``content`` is what the method of that name returned."""
        raise NotImplementedError

    def content(
        self, kind: MapKind, animations: Sequence[MappedAnimation], scale: int
    ) -> Sequence[Any]:
        """Return what is drawn of each frame of all animations, on pages of a scale by its number;
        here, what was kept of the frame."""
        return [
            frame.maps[kind.name][scale] for animation in animations for frame in animation.frames
        ]

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        """Return how a client reads it, for the JSON; empty if it reads it like a page."""
        return {}

    def read(self, stated: SheetMap, entry: Mapping[str, Any]) -> SheetMap:
        """Return what an entry says of a map; the inverse of ``entry``.

        Raises:
            KeyError, TypeError, ValueError: The entry is invalid.
        """
        return stated


def maker_of(kind: MapKind) -> Maker:
    """Return what makes maps of a kind; its module is imported now."""
    return cast("Maker", import_module(f"fire_atlas.maps.{kind.module}").MAKER)


def with_maps(sheet: AtlasSheet, animations: Sequence[MappedAnimation], maps: Maps) -> AtlasSheet:
    """Return a sheet with what it says of the maps that a recipe asks for."""
    described = (maker_of(kind).described(kind, sheet, animations, maps) for kind in kinds_in(maps))
    return replace(sheet, maps=tuple(described))


def files_of(kind: MapKind, sheet: AtlasSheet) -> SheetMap:
    """Return the maps of a kind beside all pages of a sheet."""
    ending = kind.ending(sheet.image_format)
    files = tuple(sheet.file(page, ending) for page in range(len(sheet.pages)))
    return stated_map(kind, files)


def stated_map(kind: MapKind, files: tuple[str, ...]) -> SheetMap:
    """Return maps of a kind, by the names of their files."""
    return SheetMap(kind.name, files, kind.holds == "data", kind.is_under, kind.channels)
