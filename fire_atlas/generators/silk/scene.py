"""Build the scene to simulate from a recipe: sheets, forces, intruders, in heights and seconds."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.silk.burning_picture import BurningPicture
from fire_atlas.generators.silk.controls import Controls
from fire_atlas.generators.silk.forces import SheetForces
from fire_atlas.generators.silk.fuel import FUELS, Fuel
from fire_atlas.generators.silk.intruders import IntruderBody
from fire_atlas.generators.silk.mechanics import (
    Elasticity,
    SheetModel,
    SheetPlacement,
    StepLimit,
    across_of,
    build_model,
)
from fire_atlas.recipe.silk import Arrangement, FuelName, SilkSource
from fire_atlas.recipe.wind import Wind

_MAX_STEP_RATE = 6000
"""Maximum number of time steps per second; more would take minutes."""

_MAX_NODES = 200_000
"""Maximum number of nodes of all sheets; the forces on more would take too much memory."""

_MAX_POSITIONS = 20_000_000
"""Maximum number of node positions recorded (480 MB with their velocities)."""

_MATCH_FLAME, _WICK_FLAME = (19.0, 22.0), (3.6, 6.0)
"""Width and height of the sheets at the end of a burning match, in radii, and wick, in lengths."""

_LOG_FLAME, _BALL_FLAME = (4.5, 8.0), (2.2, 5.0)
"""Width and height of the sheets along a burning log or on a wrap, and around a burning sphere,
radii."""

_BALL_SHEETS = 8
"""Number of sheets around a burning sphere."""

_LOWERED = 0.06
"""Greatest distance of a sheet's base below the ground, sheet heights: flames whose sheets vary
begin a little above it."""

_TRIED, _MASK_DEPTH = 8, 0.03
"""Places that are tried on a mask for each sheet that lies on it already; and how far in front of
it or behind it sheets stand, heights."""

_AWAY_FROM_EDGES = 0.08
"""How often a sheet begins in the middle of a board, relative to its edge, which burns best."""

_GOLDEN_ANGLE = 2.399963
"""Turn, rad, from one sheet to the next that spreads any number of them evenly over a disc."""


Masks = Mapping[int, BurningPicture]
"""What burns, by the number of the arrangement that burns on it."""

NO_MASKS: Masks = {}


@dataclass(frozen=True, slots=True)
class SilkScene:
    """The scene to simulate: the sheets and everything that moves them.

    Attributes:
        fuels: The fuel of each sheet.
        fires: (sheets,) number of the fire that each sheet is part of.
        model: The mesh of the sheets.
        forces: Forces on the sheets other than their springs and the intruders.
        controls: The keys that change with time.
        intruders: Objects in the flame.
        attached_to: (sheets,) index of the intruder that carries each sheet; -1 for none.
        lit_by: (sheets,) index of the intruder with which each sheet catches fire; -1 if it burns
            from the start.
        dt: Time step, s.
        steps: Time steps per frame.
        fps: Frames per second.
    """

    fuels: tuple[Fuel, ...]
    fires: tuple[int, ...]
    model: SheetModel
    forces: SheetForces
    controls: Controls
    intruders: tuple[IntruderBody, ...]
    attached_to: tuple[int, ...]
    lit_by: tuple[int, ...]
    dt: float
    steps: int
    fps: float

    def of_fuels(self, value: Callable[[Fuel], float]) -> NDArray[np.float64]:
        """Return a constant of each sheet's fuel: (sheets,)."""
        return np.array([value(fuel) for fuel in self.fuels])


@dataclass(frozen=True, slots=True)
class _PlacedSheet:
    """Where a sheet stands and what burns on it: the parts of a ``SilkScene`` that are per sheet.

    Attributes:
        placement: Position and size.
        fuel: Name of its fuel.
        fire: Number of the fire that it is part of.
        attached_to: Index of the intruder that carries it; -1 for none.
        lit_by: Index of the intruder with which it catches fire; -1 if it burns from the start.
    """

    placement: SheetPlacement
    fuel: FuelName
    fire: int
    attached_to: int = -1
    lit_by: int = -1


def build_scene(
    source: SilkSource, wind: Wind, seed: int, fps: float, masks: Masks = NO_MASKS
) -> SilkScene:
    """Build the scene that a recipe describes; ``masks`` are those that its sheets burn on.

    Raises:
        RecipeError: It needs more nodes or time steps than are allowed.
    """
    intruders = tuple(IntruderBody.of(intruder) for intruder in source.intruders)
    if source.tile_width is not None:
        _check_inside(intruders, source.tile_width)
    sheets = _place_sheets(source, intruders, masks, seed)
    for i, body in enumerate(intruders):
        if body.ignites:
            fire = sheets[-1].fire + 1
            sheets += [
                _PlacedSheet(placement, source.fuel, fire, i, i) for placement in _flames_on(body)
            ]
    nodes = len(sheets) * source.rows * source.columns
    if nodes > _MAX_NODES:
        raise RecipeError(
            f"{len(sheets)} sheets of {source.rows} x {source.columns} have "
            f"{nodes} nodes; at most {_MAX_NODES} can be simulated, which is "
            f"{_MAX_NODES // (source.rows * source.columns)} sheets of this mesh",
            key=("source", "sheets"),
        )
    fuels = tuple(FUELS[sheet.fuel] for sheet in sheets)
    placements = [sheet.placement for sheet in sheets]
    model = build_model(placements, source.rows, source.columns, _elasticities(source, fuels))
    controls = Controls.of(source)
    forces = SheetForces.of(model.rest, fuels, wind, controls, source.mass, seed, source.tile_width)
    drag = float((forces.drag[..., 0] / forces.mass).max())
    limit = StepLimit.of(model, drag, max(controls.pressure.values))
    dt, steps = _time_step(source, limit, fps)
    return SilkScene(
        fuels=fuels,
        fires=tuple(sheet.fire for sheet in sheets),
        model=model,
        forces=forces,
        controls=controls,
        intruders=intruders,
        attached_to=tuple(sheet.attached_to for sheet in sheets),
        lit_by=tuple(sheet.lit_by for sheet in sheets),
        dt=dt,
        steps=steps,
        fps=fps,
    )


def check_length(scene: SilkScene, frames: int) -> None:
    """Check that ``frames`` frames can be recorded.

    Raises:
        RecipeError: The sheets have too many nodes for that.
    """
    nodes = scene.model.rest[..., 0].size
    if nodes * frames > _MAX_POSITIONS:
        raise RecipeError(
            f"{frames} frames of {nodes} nodes do not fit in memory; use at most "
            f"{_MAX_POSITIONS // nodes} frames, or fewer or coarser sheets",
            key=("timeline", "frames"),
        )


def check_loop(scene: SilkScene, duration: float) -> None:
    """Check that everything that changes ends a loop of ``duration`` s as it began.

    Raises:
        RecipeError: It would jump.
    """
    scene.controls.check_loop(duration)
    for i, body in enumerate(scene.intruders):
        if not np.allclose(body.position(0.0), body.position(duration), rtol=0, atol=1e-6):
            raise RecipeError(
                f"is elsewhere after {duration:g} s, when the loop starts again, so it would jump; "
                f"add a keyframe that brings it back to its start by then, or play once with "
                f"timeline.loop: none",
                key=("source", "intruders", i),
            )


def _check_inside(intruders: Sequence[IntruderBody], width: float) -> None:
    """Check that what is drawn stands inside a tile of a ``width``, heights.

    Raises:
        RecipeError: The next tile would cut it off.
    """
    for i, body in enumerate(intruders):
        ends = np.stack([body.ends(float(time)) for time in body.times])
        if body.visible and np.abs(ends[..., 0]).max() + body.radius > width / 2:
            raise RecipeError(
                f"crosses a side of the tile, where its neighbour would cut it off; keep all of it "
                f"between x = {-width / 2:g} and {width / 2:g}",
                key=("source", "intruders", i),
            )


def _elasticities(source: SilkSource, fuels: Sequence[Fuel]) -> list[Elasticity]:
    """Return mass and stiffness of each sheet: alike for all sizes, so that a large sheet moves
    like a small one."""
    return [
        Elasticity(
            fuel.mass * source.mass,
            fuel.structural * source.stiffness,
            fuel.shear * source.stiffness,
            fuel.bending * source.stiffness,
            fuel.damping * source.damping,
        )
        for fuel in fuels
    ]


def _time_step(source: SilkSource, limit: StepLimit, fps: float) -> tuple[float, int]:
    """Return the time step, s, and the number of steps per frame.

    Raises:
        RecipeError: The springs are so stiff, or so damped, or the nodes so light, that it takes
            too many.
    """
    if 1 / limit.longest_step <= _MAX_STEP_RATE:
        steps = math.ceil(1 / fps / limit.longest_step)
        return 1 / fps / steps, steps
    shortest = 1 / _MAX_STEP_RATE
    stiff, damped = limit.most_stiffness(shortest), limit.most_damping(shortest)
    both_stiff, both_damped = limit.most_of_both(shortest)
    # The key that needs the smaller change; a limit of 0 or less means that it alone does not help.
    if stiff > 0 and stiff >= damped:
        blamed, advice = "stiffness", _at_most("stiffness", source.stiffness * stiff)
    elif damped > 0:
        blamed, advice = "damping", _at_most("damping", source.damping * damped)
    elif both_stiff > 0:
        less_stiff = _at_most("stiffness", source.stiffness * both_stiff)
        less_damped = _at_most("damping", source.damping * both_damped)
        blamed, advice = "stiffness", f"{less_stiff} and {less_damped}"
    else:
        blamed, advice = "mass", "much more mass"
    raise RecipeError(
        f"{getattr(source, blamed):g} with stiffness {source.stiffness:g}, "
        f"damping {source.damping:g}, mass {source.mass:g} and a mesh of {source.rows} x "
        f"{source.columns} needs {1 / limit.longest_step:.0f} time steps per second, but at most "
        f"{_MAX_STEP_RATE} are done; use {advice} here, or more mass or a coarser mesh",
        key=("source", blamed),
    )


def _at_most(key: str, value: float) -> str:
    """Return advice on a key: at most a positive value, to three digits, rounded down."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"a {key} of at most about {math.floor(value / unit) * unit:.3g}"


def _place_sheets(
    source: SilkSource, intruders: Sequence[IntruderBody], masks: Masks, seed: int
) -> list[_PlacedSheet]:
    """Place the sheets of a recipe. Each arrangement is a fire; so are single sheets of a fuel."""
    chance = generator(seed, RandomStream.SHEETS)
    placed: list[_PlacedSheet] = []
    single: dict[FuelName, int] = {}
    for fire, entry in enumerate(source.arrangements):
        fuel = entry.fuel or source.fuel
        if isinstance(entry, Arrangement):
            if entry.tile:
                entry = entry.model_copy(update={"spread": source.tile_width})
            carrier = entry.on if isinstance(entry.on, int) else -1
            bases = None
            if carrier >= 0:
                bases = _bases_on(intruders[carrier], entry.count)
            elif entry.on != "none":
                bases = _bases_over(masks[fire], entry.count, source.foot, chance)
            places = _arrange(entry, FUELS[fuel].variety, chance, bases)
            placed += [_PlacedSheet(place, fuel, fire, carrier) for place in places]
        else:
            placement = SheetPlacement(entry.at, entry.width, entry.height, entry.angle)
            placed.append(_PlacedSheet(placement, fuel, single.setdefault(fuel, fire)))
    return placed


def _arrange(
    sheets: Arrangement,
    variety: float,
    chance: np.random.Generator,
    bases: NDArray[np.float64] | None,
) -> list[SheetPlacement]:
    """Place the sheets of an arrangement, which vary a little in size and angle; with ``variety``,
    0..1, more in width, and their feet are not on one line.

    ``bases`` (count, 3) are where sheets begin that are not on the ground, heights.
    """
    count = sheets.count
    heights = sheets.height * chance.uniform(0.88, 1.0, count)
    widths = sheets.width * chance.uniform(0.9 - 0.1 * variety, 1.08 + 0.17 * variety, count)
    jitter = chance.uniform(-0.5, 0.5, (3, count))
    lowered = heights * chance.uniform(0, _LOWERED * variety, count)
    up = (0.0, 0.0, 1.0)
    if sheets.direction is not None:
        x, y, z = sheets.direction
        length = math.hypot(x, y, z)
        up = (x / length, y / length, z / length)
    right, away = across_of(up)
    placements = []
    for i in range(count):
        x, y, angle = _arranged(sheets, i, *(float(value) for value in jitter[:, i]))
        base = x * right + y * away if bases is None else bases[i]
        at = _point(base + sheets.at - float(lowered[i]) * np.array(up))
        placements.append(SheetPlacement(at, float(widths[i]), float(heights[i]), angle, up))
    return placements


def _bases_on(body: IntruderBody, count: int) -> NDArray[np.float64]:
    """Return where ``count`` sheets begin on an intruder, all over it but for the underside of a
    sphere: (count, 3), heights."""
    start, end = body.ends(float(body.times[0]))
    share = (np.arange(count) + 0.5) / count
    turn = np.arange(count) * _GOLDEN_ANGLE
    along = end - start
    length = float(np.sqrt(along @ along))
    if length == 0:
        height = 1 - 1.6 * share  # a sphere's surface has as much of each height
        level = np.sqrt(1 - height**2)
        around = np.stack([level * np.cos(turn), level * np.sin(turn), height], axis=1)
        return np.asarray(start + body.radius * around)
    right, away = across_of(_point(along / length))
    around = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * away
    return np.asarray(start + share[:, None] * along + body.radius * around)


def _bases_over(
    picture: BurningPicture, count: int, foot: float, chance: np.random.Generator
) -> NDArray[np.float64]:
    """Return where ``count`` sheets begin, spread over a picture: (count, 3), heights.

    Each is the one of some random places that is farthest from the others (Mitchell 1991). Most
    are on edges.
    """
    rows, columns = np.nonzero(picture.burns)
    height, width = picture.burns.shape
    share = np.cumsum(_AWAY_FROM_EDGES + picture.edges()[rows, columns], dtype=np.float64)
    places = np.stack([columns + 0.5 - width / 2, height * (1 - foot) - rows - 0.5], axis=1)
    places /= height

    def tried(number: int) -> NDArray[np.float64]:
        at = np.searchsorted(share, chance.random(number) * share[-1], side="right")
        return np.asarray(places[np.minimum(at, len(places) - 1)])

    found = tried(1)
    while len(found) < count:
        others = tried(_TRIED * len(found))
        away = np.square(others[:, None] - found).sum(axis=2).min(axis=1)
        found = np.concatenate([found, others[[away.argmax()]]])
    depth = chance.uniform(-_MASK_DEPTH, _MASK_DEPTH, count)
    return np.stack([found[:, 0], depth, found[:, 1]], axis=1)


def _arranged(
    sheets: Arrangement, i: int, one: float, two: float, three: float
) -> tuple[float, float, float]:
    """Return x, y and angle (degrees) of sheet ``i``; three numbers of -0.5..0.5 vary them."""
    count, spread = sheets.count, sheets.spread
    share = (i + 0.5) / count
    match sheets.arrangement:
        case "crossed" | "jet":
            radius = spread * math.sqrt(share)
            turn = i * _GOLDEN_ANGLE
            angle = 180 * i / count + 60 * three / count  # the first faces the front
            return radius * math.cos(turn), radius * math.sin(turn), angle
        case "ring":
            turn = 2 * math.pi * (share + 0.3 * one / count)
            return spread * math.cos(turn), spread * math.sin(turn), _angle_on_ring(turn, i)
        case "line":
            along = (share - 0.5) * spread + two * spread / (2 * count)
            return along, 0.3 * sheets.width * one, 40 * three + (25 if i % 2 else -25)


def _angle_on_ring(turn: float, i: int) -> float:
    """Return the angle, degrees, of sheet ``i`` of a ring, at ``turn``, rad: not along the ring, so
    that from no side are all of them seen edge-on."""
    return math.degrees(turn) + (125 if i % 2 else 55)


def _flames_on(body: IntruderBody) -> list[SheetPlacement]:
    """Return the sheets of the flame on an intruder, where it is at first."""
    first = body.positions[0]
    match body.shape:
        case "match":
            return _crossed_at(first, *(body.radius * k for k in _MATCH_FLAME))
        case "wick":
            length = float(np.linalg.norm(body.axis))
            return _crossed_at(first + body.axis, *(length * k for k in _WICK_FLAME))
        case "wrap":
            return _crossed_at(first + body.axis, *(body.radius * k for k in _LOG_FLAME))
        case "sphere":
            width, height = (body.radius * k for k in _BALL_FLAME)
            placements = []
            for i in range(_BALL_SHEETS):
                turn = 2 * math.pi * i / _BALL_SHEETS
                foot = first + body.radius * np.array([math.cos(turn), math.sin(turn), -0.7])
                angle = _angle_on_ring(turn, i)
                placements.append(SheetPlacement(_point(foot), width, height, angle))
            top = first + np.array([0, 0, 0.5 * body.radius])
            return [*placements, *_crossed_at(top, width, height)]
        case "log" | "wax":
            width, height = (body.radius * k for k in _LOG_FLAME)
            count = max(3, math.ceil(2 * float(np.linalg.norm(body.axis)) / (0.4 * width)))
            turn = math.degrees(math.atan2(body.axis[1], body.axis[0]))
            shares = (np.arange(count) + 0.5) / count * 2 - 1
            return [
                SheetPlacement(
                    _point(first + share * body.axis), width, height, turn + (-1) ** i * 25
                )
                for i, share in enumerate(shares)
            ]


def _crossed_at(foot: NDArray[np.float64], width: float, height: float) -> list[SheetPlacement]:
    """Return three sheets that cross at ``foot`` (3,), a little above their bases."""
    base = _point(foot - np.array([0, 0, 0.06 * height]))
    return [SheetPlacement(base, width, height, angle) for angle in (25.0, 85.0, 145.0)]


def _point(place: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = map(float, place)
    return x, y, z
