"""Emission: where and when flakes are spawned (Kim & Lee, sections III-B and C, Figure 7b)."""

import math
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.recipe.effect import Flakes

TICK = 1 / 60
"""Time step, s, in which flakes are spawned and fly, whatever the frame rate."""

_RATE_PER_AREA, _SMALL_AREA = 180.0, 0.15
"""Automatic spawn rate per heights² of moving fire, and the area below which the rate falls faster
than the area, because a small fire is calmer as well."""

_MIN_SPAWNS = 6.0
"""Minimum automatic number of flakes of a one-shot clip."""

_CALM_RATE, _BURSTS_PER_FLAKE = 20.0, 1 / 40
"""Spawn rate, 1/s, up to which a fire is too calm for bursts; bursts per flake beyond it."""

_GOLDEN = (math.sqrt(5) - 1) / 2

_BURST_SPARKS = (3, 14)
"""Minimum and maximum number of sparks in a burst."""

_MEAN_BURST_SPARKS = sum(_BURST_SPARKS) / 2

_BURST_SPEED = (0.2, 0.8)
"""Minimum and maximum speed that a burst gives its sparks, heights/s."""

_BURST_WIDTH = 0.05
"""Side of the square in which the sparks of a burst are spawned, heights."""

_MAX_TERMINAL_VELOCITY = (0.03, 0.2)
"""Maximum terminal velocity of a flake, and of a spark of a burst, heights/s."""

_FLICKER_RATE = (0.5, 6.0)
"""Minimum and maximum rate of the flicker, Hz."""

_TURBULENCE_RATE = (0.3, 1.3)
"""Minimum and maximum rate of a flake's own turbulent motion, Hz."""

_SIZE_SPREAD = 2.0
"""Number of standard deviations from the mean log size to that of a recipe's minimum or maximum."""


@dataclass(frozen=True, slots=True)
class Spawns:
    """Spawned flakes, in the order of spawning. All arrays (flakes,) float64 but the first two.

    Attributes:
        in_burst: Whether the flake is a spark of a burst, bool.
        tick: Time step in which the flake is spawned, in units of ``TICK``, int64.
        x, y: Place where it is spawned, px.
        impulse_x, impulse_y: Initial velocity in addition to the field's, px/s.
        terminal_velocity: Speed at which the flake falls through still air, px/s.
        life: Lifetime until cooled, s.
        size: Width, px.
        size_score: Standard score of the size's logarithm: standard deviations above the mean.
        flicker_rate: Hz.
        flicker_phase: rad.
        turbulence_rate: Rate of the flake's own turbulent motion, Hz.
        turbulence_phase_x, turbulence_phase_y: Its phases, rad.
    """

    in_burst: NDArray[np.bool_]
    tick: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    impulse_x: NDArray[np.float64]
    impulse_y: NDArray[np.float64]
    terminal_velocity: NDArray[np.float64]
    life: NDArray[np.float64]
    size: NDArray[np.float64]
    size_score: NDArray[np.float64]
    flicker_rate: NDArray[np.float64]
    flicker_phase: NDArray[np.float64]
    turbulence_rate: NDArray[np.float64]
    turbulence_phase_x: NDArray[np.float64]
    turbulence_phase_y: NDArray[np.float64]

    def shifted(self, x: float, y: float) -> Self:
        """Return the same flakes, spawned ``x`` px further right and ``y`` px further down."""
        return replace(self, x=self.x + x, y=self.y + y)

    def take(self, places: NDArray[np.intp]) -> Self:
        """Return the flakes at the given indices."""
        return replace(self, **{f.name: getattr(self, f.name).take(places) for f in fields(self)})

    def cooled_by(self, end: float) -> Self:
        """Return the same flakes, lifetimes shortened to end half a tick before ``end``, s."""
        left = np.maximum(end - (self.tick + 0.5) * TICK, TICK / 2)
        return replace(self, life=np.minimum(self.life, left))

    @classmethod
    def empty(cls) -> Self:
        """Return no flakes."""
        rest = (np.empty(0) for _ in fields(cls)[2:])
        return cls(np.empty(0, np.bool_), np.empty(0, np.int64), *rest)

    @classmethod
    def concatenate(cls, parts: list[Self]) -> Self:
        """Return the flakes of all parts, in the order of spawning."""
        together = cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))
        return together.take(np.argsort(together.tick, kind="stable"))


@dataclass(frozen=True, slots=True)
class EmitterSettings:
    """How flakes are spawned in a clip, in px and s.

    Attributes:
        seed: The recipe's seed.
        rate: Flakes per second at the automatic α, those of bursts included.
        burst_rate: Bursts per second at the automatic α.
        candidate_count: Mean number of candidates per frame at the automatic α: N(α_auto).
        alpha: α, the recipe's or the automatic one: pixels with ‖Fv*‖ > α are candidates.
        life, size: (min, max), s and px.
        height: Frame height, px.
        fps: Frames per second.
    """

    seed: int
    rate: float
    burst_rate: float
    candidate_count: float
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
        moving_area: float,
        candidate_count: float,
        automatic_alpha: float,
        seed: int,
    ) -> Self:
        """Convert the recipe's section to px and s, and replace ``auto`` by numbers.

        Args:
            flakes: The recipe's section.
            clip: The clip; only its size, length and rate are used.
            moving_area: Area in which the fire moves, heights².
            candidate_count: Mean number of candidates per frame at the automatic α.
            automatic_alpha: The automatic α.
            seed: The recipe's seed.
        """
        size = (flakes.size[0] * clip.height, flakes.size[1] * clip.height)
        median = np.sqrt(size[0] * size[1])
        width_ratio = float(median / drawn_width(median, flakes.sprite == "pixel"))
        duration = math.inf if clip.loop else clip.body / clip.fps
        automatic = automatic_rate(moving_area, width_ratio, duration)
        rate = automatic if flakes.rate == "auto" else flakes.rate
        bursts = automatic_burst_rate(rate) if flakes.bursts == "auto" else flakes.bursts
        return cls(
            seed=seed,
            rate=rate,
            burst_rate=min(bursts, rate / _MEAN_BURST_SPARKS),
            candidate_count=candidate_count,
            alpha=automatic_alpha if flakes.alpha == "auto" else flakes.alpha,
            life=flakes.life,
            size=size,
            height=clip.height,
            fps=clip.fps,
        )


def automatic_rate(moving_area: float, width_ratio: float, duration: float) -> float:
    """Return the spawn rate, 1/s, that suits a fire.

    Sparks tear off where fire moves, so the rate is proportional to that area; in a small, calm
    fire, to its square. Flakes too small to show are drawn wider, and are fewer in proportion. A
    clip that plays once gets a few, however short.

    Args:
        moving_area: Area in which the fire moves, heights².
        width_ratio: Width of a median flake divided by the width at which it is drawn.
        duration: Duration of a one-shot clip, s; infinite for a loop.
    """
    calm = min(moving_area / _SMALL_AREA, 1.0)
    rate = _RATE_PER_AREA * moving_area * calm * min(width_ratio, 1.0)
    return max(rate, _MIN_SPAWNS / duration)


def automatic_burst_rate(rate: float) -> float:
    """Return how many bursts a second suit a fire that sheds ``rate`` flakes a second."""
    return max(rate - _CALM_RATE, 0.0) * _BURSTS_PER_FLAKE


def emit(frame: int, strength: Plane, emitter: EmitterSettings) -> Spawns:
    """Spawn the flakes of one frame: as many as ``rate`` says, and bursts in addition to them.

    ``with_bursts_in_rate`` takes the sparks of bursts out of the number again, which needs the
    births of all frames.

    Candidates C_pos are the pixels whose strength ‖Fv*‖ exceeds α. The spawns of a frame are
    Poisson distributed with λ = rate · N(α) / N(α_auto) a second, so a lower α gives more flakes
    (Figure 22); each picks a candidate with weight ‖Fv*‖. Bursts are a Poisson process.

    Args:
        frame: Index of the frame; its random numbers depend on it and the seed alone.
        strength: (H, W) ‖Fv*‖; 0 where no flake may be spawned.
        emitter: How flakes are spawned.
    """
    candidates = _Candidates.of(strength, emitter.alpha)
    duration = candidates.places.size / emitter.candidate_count / emitter.fps
    first = round(frame / emitter.fps / TICK)
    ticks = max(1, round((frame + 1) / emitter.fps / TICK) - first)
    chance = generator(emitter.seed, RandomStream.EMISSION, frame)
    count = _steady_poisson(emitter.rate * duration, frame, emitter.seed)
    columns = _columns(chance, candidates.choose(chance, count), candidates.width, emitter)
    when = first + chance.integers(ticks, size=count)
    spawned = [Spawns(np.zeros(count, np.bool_), when, *columns)]
    chance = generator(emitter.seed, RandomStream.BURSTS, frame)
    if bursts := int(chance.poisson(emitter.burst_rate * duration)):
        sizes = chance.integers(*_BURST_SPARKS, bursts, endpoint=True)
        centres, radius = candidates.choose(chance, bursts), _BURST_WIDTH * emitter.height / 2
        near = [candidates.near(centre, radius) for centre in centres]
        where = [each.choose(chance, sparks) for each, sparks in zip(near, sizes, strict=True)]
        columns = _columns(chance, np.concatenate(where), candidates.width, emitter, in_burst=True)
        when = np.repeat(first + chance.integers(ticks, size=bursts), sizes)
        spawned.append(Spawns(np.ones(len(when), np.bool_), when, *columns))
    return Spawns.concatenate(spawned)


@dataclass(frozen=True, slots=True)
class _Candidates:
    """Candidate pixels C_pos of a frame.

    Attributes:
        places: (candidates,) flat indices of pixels, ascending.
        weights: (candidates,) running sum of their ‖Fv*‖.
        width: Width of the frame, px.
    """

    places: NDArray[np.intp]
    weights: NDArray[np.float64]
    width: int

    @classmethod
    def of(cls, strength: Plane, alpha: float) -> Self:
        """Return the pixels whose ``strength`` ‖Fv*‖, (H, W), exceeds α."""
        places = np.flatnonzero(strength > alpha)
        weights = np.cumsum(strength.ravel()[places], dtype=np.float64)
        return cls(places, weights, strength.shape[1])

    def choose(self, chance: np.random.Generator, count: int) -> NDArray[np.intp]:
        """Pick ``count`` of the pixels by weight; none where there are no candidates."""
        if count == 0 or self.places.size == 0:
            return np.empty(0, np.intp)
        total = self.weights[-1]
        at = np.searchsorted(self.weights, chance.random(count) * total, side="right")
        picked: NDArray[np.intp] = self.places[np.minimum(at, self.places.size - 1)]
        return picked

    def near(self, centre: int, radius: float) -> Self:
        """Return the candidates at most ``radius`` px from a pixel, horizontally and vertically."""
        row, column = divmod(centre, self.width)
        # Pixels are sorted by row, so that those of neighbouring rows form one slice.
        rows = math.ceil(row - radius), math.floor(row + radius) + 1
        band = slice(*np.searchsorted(self.places, [end * self.width for end in rows]))
        near = np.abs(self.places[band] % self.width - column) <= radius
        before = self.weights[band.start - 1] if band.start else 0.0
        own = np.diff(self.weights[band], prepend=before)
        return replace(self, places=self.places[band][near], weights=np.cumsum(own[near]))


def _steady_poisson(mean: float, frame: int, seed: int) -> int:
    """Draw a frame's number of flakes, Poisson distributed with ``mean`` but evenly spread in time.

    It is a quantile whose probability advances by the golden ratio from frame to frame, so that
    few flakes are soon followed by many: by chance alone a small fire may shed none for a second.
    """
    if mean == 0:
        return 0
    place = (generator(seed, RandomStream.TRICKLE).random() + frame * _GOLDEN) % 1.0
    counts = np.arange(1, math.ceil(mean + 12 * math.sqrt(mean) + 24))
    probability = np.exp(np.cumsum(np.concatenate([[-mean], np.log(mean / counts)])))
    return int(np.searchsorted(np.cumsum(probability), place, side="right"))


def _columns(
    chance: np.random.Generator,
    where: NDArray[np.intp],
    width: int,
    emitter: EmitterSettings,
    in_burst: bool = False,
) -> tuple[NDArray[np.float64], ...]:
    """Return the columns of ``Spawns`` from ``x`` on, of flakes at flat pixel indices ``where``."""
    count, (row, column) = len(where), np.divmod(where, width)
    inside = chance.random((2, count))
    heading = chance.uniform(0, 2 * np.pi, count)
    speed = chance.uniform(*_BURST_SPEED, count) * emitter.height * (1.0 if in_burst else 0.0)
    score = np.clip(chance.standard_normal(count), -_SIZE_SPREAD, _SIZE_SPREAD)
    if in_burst:  # sparks of a burst are small
        score = -np.abs(score)
    smallest, largest = np.log(emitter.size)
    size = np.exp((smallest + largest) / 2 + score * (largest - smallest) / (2 * _SIZE_SPREAD))
    slow, fast = np.log(_FLICKER_RATE)
    return (
        column + inside[0],
        row + inside[1],
        speed * np.cos(heading),
        speed * np.sin(heading) - speed * 0.5,  # sparks of a burst fly up rather than down
        chance.uniform(0, _MAX_TERMINAL_VELOCITY[in_burst], count) * emitter.height,
        chance.uniform(*emitter.life, count),
        size,
        score,
        np.exp(chance.uniform(slow, fast, count)),
        chance.uniform(0, 2 * math.pi, count),
        chance.uniform(*_TURBULENCE_RATE, count),
        chance.uniform(0, 2 * math.pi, count),
        chance.uniform(0, 2 * math.pi, count),
    )


def with_bursts_in_rate(spawns: Spawns, seed: int) -> Spawns:
    """Remove as many flakes as bursts have sparks, so that as many are left as the rate says.

    Single flakes are removed at random over the whole clip; sparks only where bursts alone are more
    than the rate.
    """
    rank = generator(seed, RandomStream.REPLACED_BY_BURSTS).permutation(len(spawns.tick))
    order = np.lexsort((rank, ~spawns.in_burst))
    return spawns.take(np.sort(order[: np.count_nonzero(~spawns.in_burst)]))


def limit_alive(spawns: Spawns, limit: int, count: int, fps: float, seed: int) -> Spawns:
    """Remove flakes so that at most ``limit`` are alive at once in a loop of ``count`` frames.

    They are removed at random over the whole loop. Spawning none while ``limit`` are alive would
    make the loop dense at its beginning and sparse at its end.
    """
    first = np.ceil(spawns.tick * (TICK * fps)).astype(np.intp)
    frames = np.ceil(spawns.life * fps).astype(np.intp)
    order = generator(seed, RandomStream.THINNING).permutation(len(first))

    def max_alive(kept: int) -> int:
        """Return the maximum alive in a frame if the first ``kept`` of ``order`` are spawned."""
        begin, (whole, rest) = first[order[:kept]], np.divmod(frames[order[:kept]], count)
        change = np.bincount(begin % count, minlength=2 * count).astype(np.intp)
        np.subtract.at(change, begin % count + rest, 1)
        alive = np.cumsum(change)
        return int((alive[:count] + alive[count:]).max() + whole.sum())

    if len(first) == 0 or max_alive(len(first)) <= limit:
        return spawns
    kept, over = 0, len(first)
    while over - kept > 1:
        middle = (kept + over) // 2
        kept, over = (middle, over) if max_alive(middle) <= limit else (kept, middle)
    return spawns.take(np.sort(order[:kept]))
