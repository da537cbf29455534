"""The fire to simulate, as a recipe describes it: grid, burners and physics, heights, seconds."""

import math
from dataclasses import dataclass, replace

import scipy.fft

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import hex_to_linear
from fire_atlas.generators.fluid.burners import FluidBurner, Vector
from fire_atlas.generators.fluid.combustion import Chemistry
from fire_atlas.generators.fluid.fires import FIRES, Look, ReadyFire
from fire_atlas.generators.fluid.forces import Forces
from fire_atlas.generators.fluid.grid import FluidGrid
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import CELLS, FluidSource
from fire_atlas.recipe.wind import Wind

MAX_CELLS = 8_000_000
"""Most cubes of a box; fewer if its frames take much memory (`memory.py`)."""

_FASTEST = 36.0
"""Most cubes that gas may leave a burner by in a frame: 4.5 in each of eight steps."""

_LEAST_CELLS = 3.0
"""Least width of a burner, cubes."""

_SIDES, _TOP = 0.08, 0.11
"""Width of the box beyond the sides and below the frame, and above it, heights: gas fades there."""

_DEEPEST = 1.5
"""Depth up to which the box grows with what burns, heights."""

_BLAST, _BLAST_TIME = 25.0, 0.11
"""Expansion of what burns at the beginning of a blast of 1, and the time, s, by which it is e times
less."""

_OVERLAP = 0.25
"""Part of a loop over which its end is led to its beginning, if it does not repeat by itself."""

_VANISHING = 0.5
"""Last part of a fire that plays once in which it thins to nothing, slowly at first."""


@dataclass(frozen=True)
class Scene:
    """What is simulated.

    Attributes:
        grid: The box.
        corner: Columns and rows of the grid to the left of the frame and above it.
        burners, chemistry, forces, look: What burns, and how it burns, moves and looks.
        heat: Factor of the temperature of what is drawn.
        detail: How far noise displaces what is drawn, 0..1.
        steady: Expansion of what burns, in its own volumes.
        blast: Expansion that is added at first.
        thinning: Part of the frame, from its top, in which gas thins to nothing, heights.
        begin: When it begins to burn, s.
        wind: The wind.
        seed: Seed of its random numbers.
        frames, fps: Length, and frames per second.
        loop: Whether frame 0 follows the last frame.
        settling: Frames that are simulated before the first one.
    """

    grid: FluidGrid
    corner: tuple[int, int]
    burners: tuple[FluidBurner, ...]
    chemistry: Chemistry
    forces: Forces
    look: Look
    heat: float
    detail: float
    steady: float
    blast: float
    thinning: float
    begin: float
    wind: Wind
    seed: int
    frames: int
    fps: float
    loop: bool
    settling: int

    @property
    def has_smoke(self) -> bool:
        """Whether there may be smoke."""
        return self.chemistry.soot > 0 or any(burner.smoke > 0 for burner in self.burners)

    @property
    def period(self) -> float:
        """Time after which all that feeds and moves it repeats, s."""
        return self.frames / self.fps

    @property
    def overlap(self) -> int:
        """Number of frames before the first one that are compared with the last ones."""
        return min(self.settling, max(1, round(self.frames * _OVERLAP))) if self.loop else 0

    def expansion(self, time: float) -> float:
        """Return how far what burns at ``time`` s expands, in its own volumes."""
        if time < self.begin or not self.blast:
            return self.steady
        return self.steady + self.blast * math.exp(-(time - self.begin) / _BLAST_TIME)

    def presence(self, number: int) -> float:
        """Return how much of the gas of a frame is left, 0..1: one that plays once ends empty."""
        if self.loop or self.frames < 2:
            return 1.0
        left = (self.frames - 1 - number) / max(1.0, _VANISHING * (self.frames - 1))
        return 1 - max(0.0, 1 - left) ** 2


def plays_once(source: FluidSource) -> bool:
    """Return whether a fire plays once, however its timeline is: it burns out, or blasts."""
    ready = FIRES[source.fire]
    blast = ready.blast if source.blast is None else source.blast
    return source.burning is not None or ready.burning is not None or blast > 0


def build_scene(source: FluidSource, settings: GenerationSettings) -> Scene:
    """Return the fire that a recipe describes.

    Raises:
        RecipeError: A burner is too small, too fast or outside of the box; the box is too large;
            or there is nothing to see.
    """
    ready = FIRES[source.fire]
    loop = settings.loop and not plays_once(source)
    blast = ready.blast if source.blast is None else source.blast
    smoke = ready.smoke if source.smoke is None else source.smoke
    burning = source.burning or ready.burning
    burners = _burners(source, ready, smoke)
    if not any(burner.fuel or burner.smoke for burner in burners):
        raise RecipeError(
            f"nothing is to be seen of a {source.fire} without fuel and smoke; set fuel_rate or "
            "smoke above 0",
            key=("source", "fuel_rate"),
        )
    grid, corner = _grid(source, ready, burners)
    _check_burners(source, burners, grid, settings.fps)
    chemistry = replace(
        ready.chemistry, life=ready.chemistry.life * max(source.fuel_rate, 0.05), soot=smoke
    )
    forces = replace(
        ready.forces,
        lift=ready.forces.lift * source.lift,
        confinement=ready.forces.confinement * source.turbulence,
        stirring=ready.forces.stirring * source.turbulence,
    )
    look = replace(ready.look, thin=ready.look.thin * smoke)
    if source.smoke_colour is not None:
        look = replace(look, albedo=_linear(source.smoke_colour))
    return Scene(
        grid, corner, burners, chemistry, forces, look, source.heat, source.detail,
        ready.expansion, blast * _BLAST, ready.thinning, burning[0] if burning else 0.0,
        settings.wind, settings.seed, settings.frames, settings.fps, loop,
        math.ceil(ready.settling * settings.fps) if loop or not burning else 0,
    )  # fmt: skip


def _burners(source: FluidSource, ready: ReadyFire, smoke: float) -> tuple[FluidBurner, ...]:
    """Return the burners, in heights, as the keys change them."""
    radius = ready.radius if source.radius is None else source.radius
    found = []
    if source.burners:
        model = ready.burners[0]
        placed = [
            replace(
                model, at=stated.at, size=(stated.size, stated.size, 0.7 * stated.size),
                fuel=model.fuel * stated.strength,
            )
            for stated in source.burners
        ]  # fmt: skip
    else:
        placed = [
            replace(burner, at=_scaled(burner.at, radius), size=_scaled(burner.size, radius))
            for burner in ready.burners
        ]
    for burner in placed:
        changed = replace(
            burner,
            fuel=burner.fuel if source.fuel_rate > 0 else 0.0,
            smoke=burner.smoke * smoke,
            speed=burner.speed if source.speed is None else source.speed,
        )
        if source.direction is not None:
            changed = replace(changed, direction=source.way)
        if source.burning is not None:
            changed = replace(changed, burning=source.burning)
        found.append(changed)
    return tuple(found)


def _scaled(vector: Vector, factor: float) -> Vector:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def cells_across(source: FluidSource) -> int:
    """Return how many cubes the side of a square of the frame's area has."""
    return source.resolution if isinstance(source.resolution, int) else CELLS[source.resolution]


def _grid(
    source: FluidSource, ready: ReadyFire, burners: tuple[FluidBurner, ...]
) -> tuple[FluidGrid, tuple[int, int]]:
    """Return the box, and where the frame begins in it; see ``Scene.corner``.

    The frame's top left corner is one of cubes, so that what is seen from the front need not be
    interpolated. The sides of the box are lengths of which transforms are fast.
    """
    across, aspect = cells_across(source), source.width / source.height
    cell = math.sqrt(aspect) / across
    wide, high = math.ceil(aspect / cell - 1e-6), math.ceil(1 / cell - 1e-6)
    left = math.ceil(_SIDES / cell)
    columns = _fast(wide + 2 * left)
    ground = round((1 - ready.foot) / cell) if ready.has_ground else high + left
    rows = _fast(ground + math.ceil(_TOP / cell))
    top = rows - ground
    reach = max(abs(burner.at[1]) + burner.size[1] for burner in burners)
    layers = _fast(math.ceil(max(ready.depth, min(2 * reach, _DEEPEST)) / cell))
    if layers * rows * columns > MAX_CELLS:
        most = int(across * (MAX_CELLS / (layers * rows * columns)) ** (1 / 3))
        raise RecipeError(
            f"{across} makes a box of {columns} x {rows} x {layers} cubes, "
            f"{layers * rows * columns / 1e6:.1f} million; at most {MAX_CELLS // 10**6} million "
            f"can be simulated, as with {most}",
            key=("source", "resolution"),
        )
    foot = top + (1 - ready.foot) / cell
    foot = min(foot, rows) if ready.has_ground else foot
    origin = (left + ready.side * aspect / cell, foot, layers / 2)
    grid = FluidGrid((layers, rows, columns), cell, origin, ready.has_ground)
    return grid, (left, top)


def _fast(length: int) -> int:
    """Return the next even length of which a transform is fast."""
    return 2 * int(scipy.fft.next_fast_len(math.ceil(length / 2), real=True))


def _check_burners(
    source: FluidSource, burners: tuple[FluidBurner, ...], grid: FluidGrid, fps: float
) -> None:
    """Refuse burners that the grid cannot show."""
    layers, rows, columns = grid.shape
    right, down, away = grid.origin
    for number, burner in enumerate(burners):
        key = ("source", "burners", str(number)) if source.burners else ("source", "radius")
        x, y, z = (place / grid.cell for place in burner.at)
        if not (0 < right + x < columns and 0 < away + y < layers and 0 < down - z <= rows):
            raise RecipeError(
                f"places a burner at {[round(place, 3) for place in burner.at]} heights, outside "
                f"of the box, which reaches from {-right * grid.cell:.2f} to "
                f"{(columns - right) * grid.cell:.2f} to the right and up to "
                f"{down * grid.cell:.2f}; move it inside",
                key=key,
            )
        thin = 2 * max(burner.size) / grid.cell
        if thin < _LEAST_CELLS:
            needed = math.ceil(cells_across(source) * _LEAST_CELLS / thin)
            fitting = [name for name, across in CELLS.items() if across >= needed]
            raise RecipeError(
                f"makes a burner {2 * max(burner.size):.3g} heights wide, which is {thin:.2f} "
                f"cubes at resolution: {source.resolution}; it needs {_LEAST_CELLS:.0f}, as with "
                f"resolution: {fitting[0] if fitting else needed}, or a larger one",
                key=key,
            )
        if burner.speed / fps > _FASTEST * grid.cell:
            raise RecipeError(
                f"lets gas leave at {burner.speed:g} heights/s, "
                f"{burner.speed / fps / grid.cell:.0f} cubes a frame at "
                f"resolution: {source.resolution}; at most {_FASTEST:.0f} can be "
                f"simulated: use {_FASTEST * grid.cell * fps:.1f} or less, a coarser resolution, "
                "or more timeline.fps",
                key=("source", "speed"),
            )


def _linear(colour: str) -> tuple[float, float, float]:
    """Return the linear light of a colour like ``#808080``."""
    red, green, blue = hex_to_linear([colour])[0].tolist()
    return (red, green, blue)
