"""How much memory a fire takes: while it is simulated, and while its frames are drawn.

The figures are bounds: of gas that fills its box and does not compress, and of frames that show all
of it. They were found in November 2026 as the most resident memory of processes and the most that
`tracemalloc` counted, at 64 to 120 cubes and 384 to 1024 px.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from fire_atlas.core.clip import CACHE_BYTES, COMPRESSED_BYTES
from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.fluid.grid import SLAB
from fire_atlas.generators.fluid.renderer import fluid_camera
from fire_atlas.generators.fluid.scene import Scene, build_scene, cells_across
from fire_atlas.generators.fluid.sight import Sight
from fire_atlas.generators.fluid.simulation import MOST_THREADS
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource

MAX_MEMORY = 2 << 30
"""Most memory that a fire may need, bytes: 2 GB."""

_SIMULATING, _BUILDING = 110_000_000, 200_000_000
"""Memory of a process that simulates, and of one that builds, without gas and frames, bytes."""

_OF_CUBE, _OF_SLAB = 195, 230
"""Memory of a cube of the box, and further that of each which a thread works on, bytes."""

_KEPT = 3
"""Bytes in which a frame keeps a cube, if no byte repeats."""

_PLACE = 16
"""Bytes in which a view that turns the gas, or displaces it, keeps where a cube lies."""

_OF_DRAWING, _OF_SEEN, _OF_PIXEL = 155_000_000, 160, 125
"""Memory of drawing a frame, or its front: at least, of each cube that is seen, and of each px."""

_PIXEL, _SHOWN = 16, 4
"""Bytes of a px of a frame as it is drawn, and as it goes onto a page."""

_BESIDES = 2
"""Further views that are drawn for the flight of flakes: from the front and from the right."""

_LEAST, _STEP = 16, 4
"""Resolutions that are tried are this and more, so far apart."""

_SHARES = 16
"""Sizes that are tried are whole numbers of such a part of the present one."""


@dataclass(frozen=True, slots=True)
class Memory:
    """What a fire needs, bytes.

    Attributes:
        simulating: While it is simulated, in both processes.
        kept: While it is drawn: all but the frames that are drawn at the moment.
        drawing: For each of these.
    """

    simulating: int
    kept: int
    drawing: int

    @property
    def needed(self) -> int:
        """The least that it can be built in."""
        return max(self.simulating, self.kept + self.drawing)

    @property
    def at_once(self) -> int:
        """How many frames may be drawn at the same time, at least one."""
        return max(1, (MAX_MEMORY - self.kept) // self.drawing)

    @property
    def at_once_while_simulating(self) -> int:
        """How many may be while the rest is simulated. Both figures count the process that builds:
        rather too few than too many."""
        return max(0, (MAX_MEMORY - self.simulating - self.kept) // self.drawing)


def memory_of(source: FluidSource, scene: Scene, settings: GenerationSettings) -> Memory:
    """Return how much memory a fire takes, with any number of workers."""
    layers, rows, columns = scene.grid.shape
    cubes, pixels = layers * rows * columns, source.width * source.height
    worked_on = min(MOST_THREADS * SLAB, layers) * rows * columns
    recorded = _KEPT * cubes * scene.frames
    sights = list(_sights(source, scene, settings))
    turned = sum(sight.cubes for sight in sights if not sight.is_plain)
    most_seen = max(sight.cubes for sight in sights)
    views = settings.views.count
    cached = min(_PIXEL * pixels * scene.frames, CACHE_BYTES + COMPRESSED_BYTES)
    return Memory(
        _SIMULATING + _BUILDING + _OF_CUBE * cubes + _OF_SLAB * worked_on
        + 2 * recorded + _KEPT * cubes * scene.overlap,
        _BUILDING + recorded + _PLACE * turned + (views + _BESIDES) * cached
        + views * _SHOWN * pixels * scene.frames,
        _OF_DRAWING + _OF_SEEN * most_seen + _OF_PIXEL * pixels,
    )  # fmt: skip


def memory_within_limit(source: FluidSource, scene: Scene, settings: GenerationSettings) -> Memory:
    """Return how much memory a fire takes, and refuse one that needs more than ``MAX_MEMORY``.

    Raises:
        RecipeError: With what it needs, and the resolution or size that would do.
    """
    memory = memory_of(source, scene, settings)
    if memory.needed <= MAX_MEMORY:
        return memory

    def fits(keys: dict[str, object]) -> bool:
        other = source.model_copy(update=keys)
        try:
            found = memory_of(other, build_scene(other, settings), settings)
        except RecipeError:  # a burner is too small for these cubes, say
            return False
        return found.needed <= MAX_MEMORY

    said = (
        f"needs up to {memory.needed / (1 << 30):.1f} GB to be simulated and drawn, of "
        f"{scene.frames} frames of {source.width}x{source.height} px"
        + (f" from {settings.views.count} sides" if settings.views.count > 1 else "")
        + f"; at most {MAX_MEMORY >> 30} GB are used"
    )
    across = cells_across(source)
    for resolution in range((across - 1) // _STEP * _STEP, _LEAST - 1, -_STEP):
        if fits({"resolution": resolution}):
            raise RecipeError(
                f"{across} {said}, as with {resolution}", key=("source", "resolution")
            )
    for share in range(_SHARES - 1, 0, -1):
        width, height = (length * share // _SHARES for length in (source.width, source.height))
        if width and height and fits({"width": width, "height": height}):
            raise RecipeError(
                f"{said}, as with frames of {width}x{height} px, or fewer views.count or "
                "timeline.frames",
                key=("source",),
            )
    raise RecipeError(
        f"{said}; use fewer views.count or timeline.frames, and a coarser source.resolution",
        key=("source",),
    )


def _sights(source: FluidSource, scene: Scene, settings: GenerationSettings) -> Iterator[Sight]:
    """Yield what each view sees, and those from the front and from the right."""
    views = settings.views
    angles = [(azimuth, views.elevation, views.distance) for azimuth in settings.azimuths()]
    for azimuth, elevation, distance in [*angles, (0.0, 0.0, None), (90.0, 0.0, None)]:
        yield Sight(scene, fluid_camera(source, azimuth, elevation, distance))
