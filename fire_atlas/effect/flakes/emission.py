"""Emission: where and when flakes are spawned (Kim & Lee, sections III-B and C, Figure 7b)."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Clip, Values
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.effect.flame.fires import Fire, Fires, Labels
from fire_atlas.recipe.effect import Flakes
from fire_atlas.vision.pixel_grid import PixelGrid

TICK = 1 / 60
"""Time step, s, in which flakes are spawned and fly, whatever the frame rate."""

ROOMY = 96.0
"""Height, px, of frames below which soft flakes, of a pixel each, would be a cloud: there are as
many fewer as the frame has fewer pixels."""

_RATE_PER_AREA, _SMALL_AREA = 280.0, 0.15
"""Automatic spawn rate per heights² of moving fire, and the area below which the rate falls faster
than the area, because a small fire is calmer as well."""

_MIN_SPAWNS = 6.0
"""Minimum automatic number of flakes of a one-shot clip."""

_CALM_RATE, _BURSTS_PER_FLAKE = 20.0, 1 / 60
"""Spawn rate, 1/s, up to which a fire is too calm for bursts; bursts per flake from twice that."""

EMBER_SIZE = (0.0026, 0.017)
"""Minimum and maximum width of an ember, heights."""

TEXTURE_SIZE = (0.02, 0.08)
"""Minimum and maximum height of a user's texture, heights: so large that it can be made out."""

_GOLDEN, _SILVER = (math.sqrt(5) - 1) / 2, math.sqrt(2) - 1
"""Irrational steps, whose multiples fill 0..1 evenly and independently of each other."""

EMBER, SPARK = 0, 1
"""Kinds of flakes: embers are carried by the gas, sparks are thrown and fly on their own."""

_BURST_SPARKS = 16.0
"""Mean number of sparks in a burst where the recipe does not say how many sparks there are."""

_BURST_SHAPE = 4.0
"""Shape of the gamma distribution of burst sizes: a few bursts are several times as large."""

_LAUNCH_SPEED, _LAUNCH_SPREAD = 0.9, 0.6
"""Median speed at which a spark is thrown, heights/s, and standard deviation of its logarithm."""

_BLAST_SPEED = 3.0
"""That median speed of an explosion: its sparks outrun its cloud."""

_LAUNCH_RISE = 0.6
"""Upward velocity of a burst's centre relative to its sparks' speed: sparks fly up rather than
down."""

_SPARK_LIFE = 0.5
"""Lifetime of a spark relative to that of an ember: it is small, and the air cools it."""

_FALL_SPEED, _FALL_SPREAD = (0.02, 0.18), 0.35
"""Median terminal velocity of an ember and of a spark, heights/s, and standard deviation of its
logarithm."""

_DRIFT_SPREAD = 0.5
"""Standard deviation of the logarithm of an ember's speed relative to that of the gas."""

_TURBULENCE_RATE = (0.2, 1.0)
"""Minimum and maximum rate of a flake's own turbulent motion, Hz."""

_EDDY, _EDDY_SPREAD = 0.5, 1.0
"""Distance, heights, at which embers of one moment are moved alike again by turbulence, and the
standard deviation, rad, of what each is ahead of its neighbours: eddies are larger than the gaps
between embers."""

_PLACES_TRIED = 16
"""Places tried for an ember, so that it is apart from those born before it."""

_APART, _APART_TIME = 0.05, 0.15
"""Distance, heights, and time, s, within which two embers that leave a tongue of a fire with depth
fly alike: a tip sheds several at once, and the same gas carries them."""

_SPARK_SMALLER = 1.0
"""Number of standard deviations by which sparks of a burst are smaller than other flakes."""

_SIZE_SPREAD = 2.0
"""Number of standard deviations from the mean log size to that of a recipe's minimum or maximum."""


@dataclass(frozen=True, slots=True)
class Spawns:
    """Spawned flakes, in the order of spawning. All arrays (flakes,) float64 but the first two.

    Attributes:
        kind: ``EMBER`` or ``SPARK``, int64.
        tick: Time step in which the flake is spawned, in units of ``TICK``, int64.
        x, y: Place where it is spawned, px.
        launch_x, launch_y: Velocity at which a spark is thrown, px/s; of an ember 0.
        terminal_velocity: Speed at which the flake falls through still air, px/s.
        drift: Velocity of an ember outside the flame relative to that of the gas.
        life: Lifetime until cooled, s.
        size: Width, px.
        size_score: Standard score of the size's logarithm: standard deviations above the mean.
        turbulence_rate: Rate of the flake's own turbulent motion, Hz.
        turbulence_phase_x, turbulence_phase_y: Its phases, rad.
        z, launch_z, turbulence_phase_z: The same in depth, towards the viewer; 0 in a flat clip.
    """

    kind: NDArray[np.int64]
    tick: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    launch_x: NDArray[np.float64]
    launch_y: NDArray[np.float64]
    terminal_velocity: NDArray[np.float64]
    drift: NDArray[np.float64]
    life: NDArray[np.float64]
    size: NDArray[np.float64]
    size_score: NDArray[np.float64]
    turbulence_rate: NDArray[np.float64]
    turbulence_phase_x: NDArray[np.float64]
    turbulence_phase_y: NDArray[np.float64]
    z: NDArray[np.float64]
    launch_z: NDArray[np.float64]
    turbulence_phase_z: NDArray[np.float64]

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
        return cls(np.empty(0, np.int64), np.empty(0, np.int64), *rest)

    @classmethod
    def concatenate(cls, parts: list[Self]) -> Self:
        """Return the flakes of all parts, in the order of spawning."""
        flakes = cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))
        return flakes.take(np.argsort(flakes.tick, kind="stable"))


@dataclass(frozen=True, slots=True)
class EmitterSettings:
    """How flakes are spawned in a clip, in px and s.

    Attributes:
        seed: The recipe's seed.
        rate: Flakes per second at the automatic α, those of bursts included.
        burst_rate: Bursts per second at the automatic α.
        burst_sparks: Mean number of sparks in a burst, at least 1.
        fires: The fires that shed them, each in proportion to its area. Their α is the recipe's or
            the automatic one: pixels with ‖Fv*‖ > α are candidates. Their number of candidates is
            that at the automatic α: N(α_auto).
        life, size: (min, max), s and px.
        height: Frame height, px.
        fps: Frames per second.
        launch_speed: Median speed at which a spark is thrown, px/s.
        is_weighted: Whether candidates are chosen by ‖Fv*‖, or all alike.
    """

    seed: int
    rate: float
    burst_rate: float
    burst_sparks: float
    fires: tuple[Fire, ...]
    life: tuple[float, float]
    size: tuple[float, float]
    height: int
    fps: float
    launch_speed: float
    is_weighted: bool = True

    @classmethod
    def of(
        cls,
        flakes: Flakes,
        clip: Clip,
        *,
        moving_area: float,
        fires: tuple[Fire, ...],
        seed: int,
        art: PixelGrid,
    ) -> Self:
        """Convert the recipe's section to px and s, and replace ``auto`` by numbers.

        Args:
            flakes: The recipe's section.
            clip: The clip; only its size, length and rate are used.
            moving_area: Area in which the fire moves, heights².
            fires: The fires as measured.
            seed: The recipe's seed.
            art: The pixels of the clip's art.
        """
        smallest, largest = size_range(flakes)
        size = smallest * clip.height, largest * clip.height
        median = np.sqrt(size[0] * size[1])
        # Soft flakes thinner than a pixel are dimmer, but hard ones are drawn wider.
        is_hard = flakes.sprite == "pixel"
        width_ratio = float(median / drawn_width(median, art)) if is_hard else 1.0
        duration = math.inf if clip.loop else clip.body / clip.fps
        room = 1.0 if is_hard else min(clip.height / ROOMY, 1.0) ** 2
        automatic = automatic_rate(moving_area, width_ratio, duration, room)
        rate = automatic if flakes.rate == "auto" else flakes.rate
        bursts, sparks = _bursts_of(flakes, rate)
        is_blast = flakes.fire_class == "explosion"
        if flakes.alpha != "auto":
            fires = tuple(replace(fire, alpha=flakes.alpha) for fire in fires)
        return cls(
            seed=seed,
            rate=rate,
            burst_rate=bursts,
            burst_sparks=sparks,
            fires=fires,
            life=flakes.life,
            size=size,
            height=clip.height,
            fps=clip.fps,
            launch_speed=clip.height * (_BLAST_SPEED if is_blast else _LAUNCH_SPEED),
            is_weighted=flakes.alpha == "auto",
        )


def size_range(flakes: Flakes) -> tuple[float, float]:
    """Return the minimum and maximum width of flakes, heights."""
    if flakes.size != "auto":
        return flakes.size
    return EMBER_SIZE if flakes.own_texture is None else TEXTURE_SIZE


def automatic_rate(
    moving_area: float, width_ratio: float, duration: float, room: float = 1.0
) -> float:
    """Return the spawn rate, 1/s, that suits a fire.

    Sparks tear off where fire moves, so the rate is proportional to that area; in a small, calm
    fire, to its square. Flakes that are drawn wider than they are, are fewer in proportion. A clip
    that plays once gets a few, however short.

    Args:
        moving_area: Area in which the fire moves, heights².
        width_ratio: Width of a median flake divided by the width at which it is drawn.
        duration: Duration of a one-shot clip, s; infinite for a loop.
        room: Number of flakes that the frame has room for, relative to a large one's, 0..1.
    """
    calm = min(moving_area / _SMALL_AREA, 1.0)
    rate = _RATE_PER_AREA * moving_area * calm * min(width_ratio, 1.0) * room
    return max(rate, _MIN_SPAWNS / duration)


def _bursts_of(flakes: Flakes, rate: float) -> tuple[float, float]:
    """Return the bursts per second of a fire that sheds ``rate`` flakes, and sparks in each.

    A given share of sparks is kept: by the size of bursts if their number is given too, else by
    their number. Without bursts, sparks are thrown one by one.
    """
    if flakes.sparks == "auto":
        bursts = automatic_burst_rate(rate) if flakes.bursts == "auto" else flakes.bursts
        return min(bursts, rate / _BURST_SPARKS), _BURST_SPARKS
    thrown = flakes.sparks * rate
    if flakes.bursts == "auto":
        return thrown / _BURST_SPARKS, _BURST_SPARKS
    bursts = min(flakes.bursts, thrown) or thrown
    return bursts, thrown / bursts if bursts else 1.0


def automatic_burst_rate(rate: float) -> float:
    """Return how many bursts a second suit a fire that sheds ``rate`` flakes a second."""
    return rate * _BURSTS_PER_FLAKE * min(max(rate / _CALM_RATE - 1, 0.0), 1.0)


def emit(frame: int, strength: Plane, labels: Labels, emitter: EmitterSettings) -> Spawns:
    """Spawn the flakes of one frame: as many as ``rate`` says, and bursts in addition to them.

    ``with_bursts_in_rate`` takes the sparks of bursts out of the number again, which needs the
    births of all frames.

    Candidates C_pos are the pixels whose strength ‖Fv*‖ exceeds α. The spawns of a frame are
    Poisson distributed with λ = rate · N(α) / N(α_auto) a second, so a lower α gives more flakes
    (Figure 22); of the paper's preset N(0.03) stands in the place of N(α_auto). All candidates of
    an α that the recipe states are alike, as in the paper; with the automatic one each is picked
    with weight ‖Fv*‖, so that flakes come from tips rather than from all along the outline. Of
    several fires each has a λ of its own: the part of the rate that is its part of the flame's
    area. Bursts are a Poisson process.

    Args:
        frame: Index of the frame; its random numbers depend on it and the seed alone.
        strength: (H, W) ‖Fv*‖; 0 where no flake may be spawned.
        labels: The fire of each pixel.
        emitter: How flakes are spawned.
    """
    candidates = Candidates.of(strength, Fires(labels, emitter.fires), emitter.is_weighted)
    duration = float(candidates.sheds.sum()) / emitter.fps
    first = round(frame / emitter.fps / TICK)
    ticks = max(1, round((frame + 1) / emitter.fps / TICK) - first)
    chance = generator(emitter.seed, RandomStream.EMISSION, frame)
    count = _steady_poisson(emitter.rate * duration, frame, emitter.seed)
    when = first + chance.integers(ticks, size=count)
    places = candidates.choose(chance, count, frame)
    spawned = [_flakes(chance, EMBER, when, places, emitter)]
    chance = generator(emitter.seed, RandomStream.BURSTS, frame)
    if bursts := int(chance.poisson(emitter.burst_rate * duration)):
        when = first + chance.integers(ticks, size=bursts)
        places = candidates.choose(chance, bursts, frame)
        # Poisson distributed about sizes of a gamma distribution: a negative binomial one.
        mean = chance.gamma(_BURST_SHAPE, (emitter.burst_sparks - 1) / _BURST_SHAPE, bursts)
        which = np.repeat(np.arange(bursts), 1 + chance.poisson(mean))
        spawned.append(_flakes(chance, SPARK, when[which], places[:, which], emitter))
    return Spawns.concatenate(spawned)


def elsewhere(
    spawns: Spawns, frame: int, strength: Plane, labels: Labels, emitter: EmitterSettings
) -> list[Spawns]:
    """Return the flakes that ``emit`` spawned in a frame, and for each other places where it might
    have been spawned as well, as flakes that are otherwise the same; sparks stay. See ``apart``."""
    tried, embers = [spawns], np.flatnonzero(spawns.kind == EMBER)
    if not len(embers):
        return tried * _PLACES_TRIED
    candidates = Candidates.of(strength, Fires(labels, emitter.fires), emitter.is_weighted)
    chance = generator(emitter.seed, RandomStream.ELSEWHERE, frame)
    for _ in range(_PLACES_TRIED - 1):
        x, y = spawns.x.copy(), spawns.y.copy()
        x[embers], y[embers] = candidates.choose(chance, len(embers), frame)
        tried.append(replace(spawns, x=x, y=y))
    return tried


def apart(tried: Sequence[Spawns], height: int, duration: float) -> Spawns:
    """Return flakes in the order of spawning, each ember where it is apart from those before it.

    Of its places it has the first that is far enough in space and time from them, or else the
    farthest (best candidate, Mitchell 1991).

    Args:
        tried: The same flakes in each of the places tried.
        height: Frame height, px.
        duration: Time, s, after which a loop begins again; infinite for what plays once.
    """
    if len(tried) == 1:
        return tried[0]
    first = tried[0]
    embers = np.flatnonzero(first.kind == EMBER)
    time = first.tick[embers] * (TICK / _APART_TIME)
    place = np.stack([[flakes.x[embers], flakes.y[embers]] for flakes in tried], axis=-1)
    place /= _APART * height
    since = np.searchsorted(time, time - 1)
    until = np.searchsorted(time, time + 1 - duration / _APART_TIME)  # those of the next round
    taken = np.zeros(len(embers), np.intp)
    for i, tries in enumerate(np.moveaxis(place, 1, 0)):
        others = np.append(np.arange(min(until[i], since[i])), np.arange(since[i], i))
        if not len(others):
            continue
        away = tries[:, None] - place[:, others, taken[others]][..., None]
        passed = time[i] - time[others]
        passed = np.minimum(passed, duration / _APART_TIME - passed)
        square = ((away * away).sum(axis=0) + np.square(passed)[:, None]).min(axis=0)
        taken[i] = np.argmax(np.minimum(square, 1))
    choice = np.zeros(len(first.tick), np.intp)
    choice[embers] = taken
    every = np.arange(len(choice))
    return Spawns(
        *(np.stack([getattr(t, f.name) for t in tried])[choice, every] for f in fields(Spawns))
    )


@dataclass(frozen=True, slots=True)
class Candidates:
    """Candidate pixels C_pos of a frame.

    Attributes:
        places: (candidates,) flat indices of pixels, fire by fire, ascending in each.
        weights: (candidates,) running sum of the weights by which they are chosen.
        ends: (fires,) how many of the candidates belong to a fire or those before it.
        sheds: (fires,) flakes of each fire, relative to all flakes at the automatic α.
        width: Width of the frame, px.
    """

    places: NDArray[np.intp]
    weights: NDArray[np.float64]
    ends: NDArray[np.intp]
    sheds: NDArray[np.float64]
    width: int

    @classmethod
    def of(cls, strength: Plane, fires: Fires, is_weighted: bool = True) -> Self:
        """Return the pixels whose ``strength`` ‖Fv*‖, (H, W), exceeds the α of their fire.

        They are chosen by it if ``is_weighted``, else all alike.
        """
        alpha = fires.per_pixel([fire.alpha for fire in fires.by_number])
        places = np.flatnonzero(strength > alpha)
        labels = fires.labels.ravel()[places]
        if len(fires.by_number) > 1:
            places = places[np.argsort(labels, kind="stable")]
        count = np.bincount(labels, minlength=len(fires.by_number))
        weight = strength.ravel()[places] if is_weighted else np.ones(len(places), np.float32)
        weights = np.cumsum(weight, dtype=np.float64)
        share, usual = np.array([(fire.share, fire.candidate_count) for fire in fires.by_number]).T
        return cls(places, weights, np.cumsum(count), share * count / usual, strength.shape[1])

    def choose(self, chance: np.random.Generator, count: int, frame: int) -> NDArray[np.float64]:
        """Return places (2, count), px, in pixels picked by weight; none without candidates.

        The fires take turns, each as often as it sheds: by chance alone, one of two that shed
        little would shed most in a short clip.
        """
        if count == 0 or self.places.size == 0:
            return np.empty((2, 0))
        turns = (np.arange(count) / count + frame * _SILVER) % 1.0 * self.sheds.sum()
        fire = np.searchsorted(np.cumsum(self.sheds), turns, side="right")
        fire = np.minimum(fire, np.flatnonzero(self.sheds)[-1])
        bounds = np.append(0.0, np.append(0.0, self.weights)[self.ends])
        first, last = bounds[fire], bounds[fire + 1]
        at = np.searchsorted(self.weights, first + chance.random(count) * (last - first), "right")
        picked = self.places[np.minimum(at, self.ends[fire] - 1)]
        row, column = np.divmod(picked, self.width)
        return np.stack([column, row]) + chance.random((2, count))


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


def _flakes(
    chance: np.random.Generator,
    kind: int,
    tick: NDArray[np.int64],
    places: NDArray[np.float64],
    emitter: EmitterSettings,
) -> Spawns:
    """Return flakes of one kind, spawned at the given time steps and ``places``, (2, flakes) px."""
    count, height, (x, y) = len(tick), emitter.height, places
    heading = chance.uniform(0, 2 * np.pi, count)
    speed = emitter.launch_speed * np.exp(_LAUNCH_SPREAD * chance.standard_normal(count))
    speed *= kind == SPARK
    score = chance.standard_normal(count) - (_SPARK_SMALLER if kind == SPARK else 0.0)
    score = np.clip(score, -_SIZE_SPREAD, _SIZE_SPREAD)
    smallest, largest = np.log(emitter.size)
    size = np.exp((smallest + largest) / 2 + score * (largest - smallest) / (2 * _SIZE_SPREAD))
    passed = sum(_TURBULENCE_RATE) / 2 * TICK * tick
    eddy = 2 * math.pi * np.stack([x / height / _EDDY + passed, x / height / _EDDY - passed])
    fall = _FALL_SPEED[kind] * np.exp(_FALL_SPREAD * chance.standard_normal(count))
    return Spawns(
        np.full(count, kind),
        tick,
        x,
        y,
        speed * np.cos(heading),
        speed * (np.sin(heading) - _LAUNCH_RISE),
        fall * height,
        np.exp(_DRIFT_SPREAD * np.clip(chance.standard_normal(count), -2, 2)),
        chance.uniform(*emitter.life, count) * (_SPARK_LIFE if kind == SPARK else 1.0),
        size,
        score,
        chance.uniform(*_TURBULENCE_RATE, count),
        *(eddy + _EDDY_SPREAD * chance.standard_normal((2, count))),
        *np.zeros((3, count)),
    )


def in_depth(
    tried: Sequence[Spawns],
    fire_depth: Callable[[Values, Values, Values], Values],
    frame: int,
    seed: int,
) -> list[Spawns]:
    """Return flakes of a flat view with a place in depth, on the fire that is seen there.

    Sparks of a burst stay together; they are thrown into all directions around the vertical.

    Args:
        tried: The flakes spawned in one frame, in each of the places tried.
        fire_depth: As ``FireInDepth.fire_depth``, in that frame.
        frame: Index of the frame, for the random numbers.
        seed: The recipe's seed.
    """
    count = len(tried[0].tick)
    if not count:
        return list(tried)
    chance = generator(seed, RandomStream.DEPTH, frame)
    places = np.concatenate([[spawns.x, spawns.y] for spawns in tried], axis=1)
    _, first, which = np.unique(places, axis=1, return_index=True, return_inverse=True)
    x, y = places[:, first]
    heading = chance.uniform(0, 2 * math.pi, count)
    z = fire_depth(x, y, chance.random(len(first)))[which.reshape(-1)]
    phase = chance.uniform(0, 2 * math.pi, count)
    return [
        replace(
            spawns,
            z=deep,
            launch_x=spawns.launch_x * np.cos(heading),
            launch_z=spawns.launch_x * np.sin(heading),
            turbulence_phase_z=phase,
        )
        for spawns, deep in zip(tried, np.split(z, len(tried)), strict=True)
    ]


def with_bursts_in_rate(spawns: Spawns, labels: Labels, seed: int) -> Spawns:
    """Remove as many flakes as there are sparks, so that as many are left as the rate says.

    Embers are removed at random over the whole clip, in the fire that throws the sparks; sparks
    only where they alone are more than the rate. ``labels`` has the fire of each pixel.
    """
    rank = generator(seed, RandomStream.REPLACED_BY_BURSTS).permutation(len(spawns.tick))
    is_ember = spawns.kind == EMBER
    fire = labels[spawns.y.astype(np.intp), spawns.x.astype(np.intp)]
    order = np.lexsort((rank, is_ember, fire))
    place = np.arange(len(order)) - np.searchsorted(fire[order], fire[order])
    embers = np.bincount(fire, is_ember, int(labels.max()) + 1)
    return spawns.take(np.sort(order[place < embers[fire[order]]]))


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
