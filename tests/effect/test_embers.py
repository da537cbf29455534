"""Embers are as embers are: heat, colour, size, streaks, bursts and flicker, on several clips."""

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.appearance import (
    COOLEST,
    HOTTEST,
    ember_flicker,
    ember_light,
    temperature,
)
from fire_atlas.effect.flakes.emission import TICK, EmitterSettings, emit
from fire_atlas.effect.flakes.statistics import flake_figures
from fire_atlas.pipeline.layers import draw
from fire_atlas.pipeline.simulate import SimulationSettings, simulate
from fire_atlas.recipe.effect import Flakes
from tests.support.clips import looped, open_clip, real
from tests.support.effect import (
    AGE,
    LIFE,
    SIZE,
    STRETCH,
    VX,
    VY,
    A,
    Array,
    B,
    EffectRun,
    G,
    R,
    X,
    Y,
    context_of,
    pixel_of,
    run_effect,
)

SAMPLES = ("campfire", "torch")
REAL = ("real_fireplace_gif", "sim_unity_flame03")
SECONDS = 12.8
"""Whole rounds of most clips, so that the frames looked at first are like all others."""

RATE = 400


@pytest.fixture(scope="module", params=[*SAMPLES, *map(real, REAL)])
def effect(request: pytest.FixtureRequest) -> EffectRun:
    """A long run, so that most of it is steady; without bursts, which are counted apart."""
    keys = {"flakes": {"rate": RATE, "bursts": 0}, "timeline": {"loop": "none"}}
    return run_effect(looped(open_clip(request.param), SECONDS), keys)


def _flakes(effect: EffectRun) -> Flakes:
    assert isinstance(effect.recipe.flakes, Flakes)
    return effect.recipe.flakes


def test_as_many_are_alive_as_rate_and_time_in_frame_say(effect: EffectRun) -> None:
    longest = _flakes(effect).life[1]
    born = effect.analysis.spawns.tick * TICK
    rows = np.zeros(len(born))
    for table in effect.tracks.frames:
        rows[table[:, 0].astype(np.intp)] += 1
    early = born < SECONDS - longest  # those that had time to live
    in_frame = rows[early].mean() / effect.clip.fps
    alive = np.mean([len(t) for t in effect.tracks.frames[math.ceil(longest * effect.clip.fps) :]])
    assert alive == pytest.approx(RATE * in_frame, rel=0.05)


def test_as_many_are_born_as_the_rate_says(effect: EffectRun) -> None:
    born = len(effect.analysis.spawns.tick) / (effect.clip.count / effect.clip.fps)
    assert born == pytest.approx(RATE, rel=0.05)


def test_embers_glow_between_1100_and_1600_kelvin(effect: EffectRun) -> None:
    heat = temperature(effect.rows[:, AGE] / effect.rows[:, LIFE])
    assert heat.max() <= HOTTEST <= 1600 and heat.min() >= COOLEST >= 980
    assert np.median(heat) > 1150


def test_an_ember_ends_by_cooling_not_by_popping() -> None:
    age = np.linspace(0, 1.5, 400)
    light = ember_light(age, np.full_like(age, 1.5))
    assert light[-1] == pytest.approx(0, abs=1e-9)
    assert np.abs(np.diff(light)).max() < 0.1
    cooling = light[np.argmax(light) :]
    assert (np.diff(cooling) <= 0).all()


def test_burnt_out_embers_were_already_dim_in_their_last_frame(effect: EffectRun) -> None:
    flights = [f for f in effect.flights(4) if f[-1, AGE] + 1.5 / effect.clip.fps >= f[-1, LIFE]]
    last = np.array([f[-1, A] / f[:, A].max() for f in flights if f[:, A].max() > 0])
    assert len(last) > 20 and np.median(last) < 0.1


def test_colours_stay_between_orange_red_and_orange(effect: EffectRun) -> None:
    rows = effect.rows
    dull, bright = srgb_to_linear(np.array([48 / 255, 115 / 255]))
    green = rows[:, G] / rows[:, R]
    assert green.min() >= dull - 1e-6 and green.max() <= bright + 1e-6
    assert not rows[:, B].any()
    flights = effect.flights(4)
    orange = [np.mean(f[:, G] / f[:, R]) for f in flights]
    speed = [np.hypot(f[:, VX], f[:, VY]).mean() for f in flights]
    assert spearmanr(orange, speed).statistic > 0.7, "faster ones are more orange"


def test_no_ember_flickers_in_colour(effect: EffectRun) -> None:
    """Though turbulence may shake it: its colour follows its speed of late."""
    widest = np.ptp(effect.rows[:, G] / effect.rows[:, R])
    steps = np.concatenate([np.abs(np.diff(f[:, G] / f[:, R])) for f in effect.flights(2)])
    assert np.quantile(steps, 0.99) < 0.3 * widest


def test_sizes_are_log_normal(effect: EffectRun) -> None:
    """Within two standard deviations, beyond which they are held at the recipe's bounds."""
    smallest, largest = (s * effect.clip.height for s in _flakes(effect).size)
    middle, sigma = math.log(smallest * largest) / 2, math.log(largest / smallest) / 4
    deviates = np.sort((np.log(effect.analysis.spawns.size) - middle) / sigma)
    inside = np.abs(deviates) < 1.999
    wanted = np.array([0.5 * (1 + math.erf(d / math.sqrt(2))) for d in deviates])
    found = (np.arange(len(deviates)) + 0.5) / len(deviates)
    assert np.abs(found - wanted)[inside].max() < 1.63 / math.sqrt(len(deviates))
    assert 0.4 <= sigma <= 0.7


def test_sizes_that_are_seen_spread_too_though_a_pixel_grid_cannot_show_the_smallest(
    effect: EffectRun,
) -> None:
    figures = {figure.name: figure for figure in flake_figures(effect.tracks)}
    assert figures["size, σ of its logarithm"].is_in_range


def test_streaks_are_as_long_as_the_way_in_the_open_shutter(effect: EffectRun) -> None:
    rows = effect.rows
    streak = (rows[:, STRETCH] - 1) * rows[:, SIZE]
    weight = effect.study.kappa[pixel_of(rows, effect.clip)]
    way = np.hypot(rows[:, VX], rows[:, VY]) / effect.clip.fps * 0.5 * weight
    moves = way > 0.05
    assert np.allclose(streak[moves], way[moves], rtol=0.05)


def _inner(rows: Array, effect: EffectRun) -> Array:
    """Rows of flakes that lie wholly in the frame, with and without their streaks."""
    reach = rows[:, SIZE] * rows[:, STRETCH]
    room = np.minimum.reduce(
        [rows[:, X], rows[:, Y], effect.clip.width - rows[:, X], effect.clip.height - rows[:, Y]]
    )
    return np.asarray(rows[room > reach])


def test_blur_keeps_the_light_of_flakes(effect: EffectRun) -> None:
    clip, flakes = effect.clip, _flakes(effect)
    still = SimulationSettings.of(effect.recipe.model_copy(update={"motion_blur": "none"}))
    with Workers(2) as workers:
        sharp = simulate(clip, effect.study, effect.analysis, still, context_of(workers))
    light, streaks = 0.0, 0.0
    for i in range(90, 110):
        blurred = _inner(effect.tracks.frames[i], effect)
        same = np.isin(sharp.frames[i][:, 0], blurred[:, 0])
        streaks += float(draw(flakes, blurred, clip.height, clip.width).sum())
        light += float(draw(flakes, sharp.frames[i][same], clip.height, clip.width).sum())
    assert light > 0
    assert streaks == pytest.approx(light, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [("campfire", "torch", "candle"), pytest.param(("campfire", *REAL), marks=pytest.mark.clips)],
)
def test_all_four_ends_of_life_occur_over_long_runs(names: tuple[str, ...]) -> None:
    shares = dict.fromkeys(("left by the top", "left by the sides", "burnt out", "fell back"), 0.0)
    for name in names:
        effect = run_effect(looped(open_clip(name), SECONDS), {"timeline": {"loop": "none"}})
        for figure in flake_figures(effect.tracks):
            if figure.name in shares:
                shares[figure.name] += figure.value / len(names)
        fallen = [f[-1, Y] > f[:, Y].min() + 0.02 * effect.clip.height for f in effect.flights(2)]
        shares["fell back"] += float(np.mean(fallen)) / len(names)
    assert all(share > 0.005 for share in shares.values()), shares


def _bursts(rate: float, frames: int) -> list[tuple[float, int]]:
    """Time and number of sparks of every burst of a steady fire at 24 fps."""
    plane = np.zeros((120, 120), np.float32)
    plane[10::20, 10::20] = 1  # too far apart for one burst to reach two of them
    emitter = EmitterSettings(1, 0.0, rate, 16.0, 36.0, 0.5, (1.0, 2.0), (1.0, 2.0), 100, 24.0)
    chance = np.random.default_rng(0)
    bursts: list[tuple[float, int]] = []
    for frame in range(frames):
        born = emit(frame, plane, emitter)
        assert (np.hypot(born.launch_x, born.launch_y) > 0).all()
        places = np.column_stack([born.tick, np.floor(born.x), np.floor(born.y)])
        for place, sparks in zip(*np.unique(places, axis=0, return_counts=True), strict=True):
            bursts.append(((place[0] + chance.random()) * TICK, int(sparks)))
    return sorted(bursts)


@pytest.mark.slow
def test_bursts_of_16_sparks_on_average_come_at_exponential_intervals() -> None:
    bursts = _bursts(rate=1.0, frames=12000)
    assert len(bursts) == pytest.approx(500, rel=0.15)
    sparks = np.array([n for _, n in bursts])
    assert sparks.mean() == pytest.approx(16, abs=1.2)
    waits = np.sort(np.diff([time for time, _ in bursts]))
    found = (np.arange(len(waits)) + 0.5) / len(waits)
    assert np.abs(found - (1 - np.exp(-waits))).max() < 1.63 / math.sqrt(len(waits))


def test_embers_flicker_visibly_and_slightly(effect: EffectRun) -> None:
    rate = effect.analysis.spawns.flicker_rate
    assert rate.min() >= 0.5 and rate.max() <= 6.0
    age = np.linspace(0, 10, 6001)
    for hertz in (0.5, 2.0, 6.0):
        light = ember_flicker(age, np.full_like(age, hertz), np.full_like(age, 0.3))
        assert light.min() > 0 and light.max() <= 1.25
        crossings = np.count_nonzero(np.diff(np.sign(light - light.mean())))
        assert crossings / 2 / 10 == pytest.approx(hertz, rel=0.06)
        assert 0.05 < np.std(light) / light.mean() < 0.35
