"""Where and when flakes are born (Kim & Lee, section III-B/C, Figure 7b)."""

import math
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.recipe.effect import Flakes

TICK = 1 / 60
"""Flakes are born and fly in ticks of this many seconds, whatever the frame rate."""

_DENSITY, _SMALL = 180.0, 0.15
"""Automatic rate for each square height of moving fire, from so many on; a smaller fire is calmer
as well."""

_FEWEST, _LEAST = 4.0, 6.0
"""Least automatic rate, and least births of what plays once: the smallest fire still sheds a
few."""

_CALM, _BURSTS = 20.0, 1 / 40
"""Rate up to which a fire is too calm to burst; bursts for each flake beyond it."""

_GOLDEN = (math.sqrt(5) - 1) / 2

_SPLINTERS = (3, 14)
"""Fewest and most sparks of a burst."""

_BURST_SPEED = (0.2, 0.8)
"""Speed at which a burst throws its sparks, heights/s."""

_BURST_REACH = 0.05
"""How far apart, at most, its sparks begin, across and down, heights."""

_SINK = (0.03, 0.2)
"""Fastest fall through still air of a flake, and of a splinter, heights/s."""

_TWINKLE = (0.5, 6.0)
"""Slowest and fastest twinkle, Hz."""

_WANDER = (0.3, 1.3)
"""Slowest and fastest meandering, Hz."""

_SIZE_SPREAD = 2.0
"""[min, max] of a recipe's sizes lie this many standard deviations from the middle."""


@dataclass(frozen=True, slots=True)
class Spawns:
    """Newborn flakes, one entry each. All arrays (flakes,) float64 but ``tick`` (int64).

    Attributes:
        tick: Tick of birth.
        x, y: Place of birth, px.
        throw_x, throw_y: Velocity given on top of the field's, px/s.
        sink: Speed at which the flake falls through still air, px/s.
        life: Seconds until cooled.
        size: Width, px.
        bulk: Size as a standard normal deviate: how much larger than usual.
        twinkle: Rate, Hz.
        phase: Of the twinkle, rad.
        wander: Rate of the flake's own meandering, Hz.
        wander_x, wander_y: Its phases, rad.
    """

    tick: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    throw_x: NDArray[np.float64]
    throw_y: NDArray[np.float64]
    sink: NDArray[np.float64]
    life: NDArray[np.float64]
    size: NDArray[np.float64]
    bulk: NDArray[np.float64]
    twinkle: NDArray[np.float64]
    phase: NDArray[np.float64]
    wander: NDArray[np.float64]
    wander_x: NDArray[np.float64]
    wander_y: NDArray[np.float64]

    def moved(self, x: float, y: float) -> Self:
        """Return the same births ``x`` px to the right and ``y`` px down."""
        return replace(self, x=self.x + x, y=self.y + y)

    def where(self, places: NDArray[np.intp]) -> "Spawns":
        """Return the births at ``places``."""
        return Spawns(*(getattr(self, f.name).take(places) for f in fields(self)))

    def cold_by(self, end: float) -> Self:
        """Return the same births, all of which have cooled half a tick before ``end``, s."""
        left = np.maximum(end - (self.tick + 0.5) * TICK, TICK / 2)
        return replace(self, life=np.minimum(self.life, left))

    @classmethod
    def none(cls) -> Self:
        """No births."""
        return cls(np.empty(0, np.int64), *(np.empty(0) for _ in fields(cls)[1:]))

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """All of ``parts``, in the order of their birth."""
        together = [np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)]
        order = np.argsort(together[0], kind="stable")
        return cls(*(column[order] for column in together))


@dataclass(frozen=True, slots=True)
class EmitterSettings:
    """How flakes are spawned in a clip, in px and s.

    Attributes:
        seed: Of the recipe.
        rate, bursts: Flakes, and bursts, per second at the automatic α.
        candidates: Candidates a frame at the automatic α: N(α_auto).
        alpha: α in force.
        life, size: (min, max), s and px.
        height: Frame height, px.
        fps: Frames per second.
    """

    seed: int
    rate: float
    bursts: float
    candidates: float
    alpha: float
    life: tuple[float, float]
    size: tuple[float, float]
    height: int
    fps: float

    @classmethod
    def of(
        cls,
        flakes: Flakes,
        clip: Clip,
        *,
        extent: float,
        candidates: float,
        automatic_alpha: float,
        seed: int,
    ) -> Self:
        """Turn what a recipe says of flakes into px and s, and decide what is automatic.

        Args:
            flakes: The recipe's section.
            clip: Its size, length and rate.
            extent: Area in which the fire moves, heights².
            candidates: Mean candidates a frame at the automatic α.
            automatic_alpha: α where the recipe leaves it open.
            seed: Of the recipe.
        """
        size = (flakes.size[0] * clip.height, flakes.size[1] * clip.height)
        middling = np.sqrt(size[0] * size[1])
        shown = float(middling / drawn_width(middling, flakes.sprite == "pixel"))
        seconds = math.inf if clip.loop else clip.body / clip.fps
        automatic = automatic_rate(extent, shown, seconds)
        rate = automatic if flakes.rate == "auto" else flakes.rate
        return cls(
            seed=seed,
            rate=rate,
            bursts=automatic_burst_rate(rate) if flakes.bursts == "auto" else flakes.bursts,
            candidates=candidates,
            alpha=automatic_alpha if flakes.alpha == "auto" else flakes.alpha,
            life=flakes.life,
            size=size,
            height=clip.height,
            fps=clip.fps,
        )


def automatic_rate(extent: float, shown: float, seconds: float) -> float:
    """Return how many flakes a second suit a fire: the automatic rate.

    Sparks tear off where fire comes and goes, so their number goes with the area in which it moves,
    and of a small and calm fire with its square. Flakes too small to be shown are drawn larger than
    they are: there are as many fewer. A few there are in any clip, however short.

    Args:
        extent: Area in which the fire moves, heights².
        shown: Width of a middling flake against that at which it is drawn.
        seconds: Of a clip that plays once; of one that goes round, infinite.
    """
    rate = _DENSITY * extent * min(extent / _SMALL, 1.0) * min(shown, 1.0)
    return max(rate, _FEWEST, _LEAST / seconds)


def automatic_burst_rate(rate: float) -> float:
    """Return how many bursts a second suit a fire that sheds ``rate`` flakes a second."""
    return max(rate - _CALM, 0.0) * _BURSTS


def emit(frame: int, strength: Plane, emitter: EmitterSettings) -> Spawns:
    """Flakes born while ``frame`` shows.

    Candidates are the pixels whose strength ‖Fv*‖ exceeds α. The births of a frame are Poisson
    distributed with λ = rate · N(α) / N(α_auto) a second, so a lower α gives more flakes
    (Figure 22); each picks a candidate with weight ‖Fv*‖. Bursts are a Poisson process.

    Args:
        frame: Index of the frame; the chance of a frame depends on it and the seed alone.
        strength: (H, W), ‖Fv*‖, 0 where no flake may be born.
        emitter: What the recipe says.
    """
    places = np.flatnonzero(strength > emitter.alpha)
    weights = np.cumsum(strength.ravel()[places], dtype=np.float64)
    busy = places.size / emitter.candidates / emitter.fps
    first = round(frame / emitter.fps / TICK)
    ticks = max(1, round((frame + 1) / emitter.fps / TICK) - first)
    chance = generator(emitter.seed, Stage.EMISSION, frame)
    singles = _trickle(emitter.rate * busy, frame, emitter.seed)
    where = _choose(chance, places, weights, singles)
    single = _born(chance, singles, where, strength, emitter)
    born = [Spawns(first + chance.integers(ticks, size=singles), *single)]
    throws = generator(emitter.seed, Stage.BURSTS, frame)
    if bursts := int(throws.poisson(emitter.bursts * busy)):
        sizes = throws.integers(*_SPLINTERS, bursts, endpoint=True)
        middles = _choose(throws, places, weights, bursts)
        reach, width = _BURST_REACH * emitter.height / 2, strength.shape[1]
        where = np.concatenate([
            _choose_near(throws, places, weights, count, middle, reach, width)
            for middle, count in zip(middles, sizes, strict=True)
        ])  # fmt: skip
        splinter = _born(throws, len(where), where, strength, emitter, thrown=True)
        when = np.repeat(first + throws.integers(ticks, size=bursts), sizes)
        born.append(Spawns(when, *splinter))
    return Spawns.joined(born)


def _trickle(mean: float, frame: int, seed: int) -> int:
    """Draw a frame's number from the Poisson distribution of a ``mean``: a steady trickle.

    It is the quantile at a place in 0..1 that goes on by the golden ratio from frame to frame, so
    frames make up for each other: by chance alone a small fire may shed nothing for a second.
    """
    if mean == 0:
        return 0
    place = (generator(seed, Stage.TRICKLE).random() + frame * _GOLDEN) % 1.0
    counts = np.arange(1, math.ceil(mean + 12 * math.sqrt(mean) + 24))
    likely = np.exp(np.cumsum(np.concatenate([[-mean], np.log(mean / counts)])))
    return int(np.searchsorted(np.cumsum(likely), place, side="right"))


def _choose(
    chance: np.random.Generator,
    places: NDArray[np.intp],
    weights: NDArray[np.float64],
    count: int,
) -> NDArray[np.intp]:
    """Pick ``count`` of ``places``; ``weights`` is the running sum of their weights."""
    if count == 0 or places.size == 0:
        return np.empty(0, np.intp)
    at = np.searchsorted(weights, chance.random(count) * weights[-1], side="right")
    picked: NDArray[np.intp] = places[np.minimum(at, places.size - 1)]
    return picked


def _choose_near(
    chance: np.random.Generator,
    places: NDArray[np.intp],
    weights: NDArray[np.float64],
    count: int,
    middle: int,
    reach: float,
    width: int,
) -> NDArray[np.intp]:
    """As ``_choose``, of those ``places`` that lie within ``reach`` px of one of them, the
    ``middle``, across and down; all are flat pixels of a plane ``width`` px wide."""
    row, column = divmod(middle, width)
    # Places are in order, row by row: those of neighbouring rows lie together.
    rows = math.ceil(row - reach), math.floor(row + reach) + 1
    band = slice(*np.searchsorted(places, [end * width for end in rows]))
    near = np.abs(places[band] % width - column) <= reach
    own = np.diff(weights[band], prepend=weights[band.start - 1] if band.start else 0.0)
    return _choose(chance, places[band][near], np.cumsum(own[near]), count)


def _born(
    chance: np.random.Generator,
    count: int,
    where: NDArray[np.intp],
    strength: Plane,
    emitter: EmitterSettings,
    thrown: bool = False,
) -> tuple[NDArray[np.float64], ...]:
    """Columns of ``Spawns`` but the tick, for flakes born in the flat pixels ``where``."""
    row, column = np.divmod(where, strength.shape[1])
    inside = chance.random((2, count))
    heading = chance.uniform(0, 2 * np.pi, count)
    speed = chance.uniform(*_BURST_SPEED, count) * emitter.height * (1.0 if thrown else 0.0)
    bulk = np.clip(chance.standard_normal(count), -_SIZE_SPREAD, _SIZE_SPREAD)
    if thrown:  # splinters are small
        bulk = -np.abs(bulk)
    smallest, largest = np.log(emitter.size)
    size = np.exp((smallest + largest) / 2 + bulk * (largest - smallest) / (2 * _SIZE_SPREAD))
    slow, fast = np.log(_TWINKLE)
    return (
        column + inside[0],
        row + inside[1],
        speed * np.cos(heading),
        speed * np.sin(heading) - speed * 0.5,  # splinters fly up rather than down
        chance.uniform(0, _SINK[thrown], count) * emitter.height,
        chance.uniform(*emitter.life, count),
        size,
        bulk,
        np.exp(chance.uniform(slow, fast, count)),
        chance.uniform(0, 2 * math.pi, count),
        chance.uniform(*_WANDER, count),
        chance.uniform(0, 2 * math.pi, count),
        chance.uniform(0, 2 * math.pi, count),
    )
