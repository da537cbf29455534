"""Embers are as embers are: heat, colour, size, streaks, bursts and flicker, on several clips."""

import math

import numpy as np
import pytest

from fire_atlas.effect.flakes.appearance import EMBER_LIGHT
from fire_atlas.effect.flakes.brightness import held_share, light_over_life
from fire_atlas.effect.flakes.drawing import SEEN_LENGTH
from fire_atlas.effect.flakes.emission import TICK, EmitterSettings, emit
from fire_atlas.effect.flakes.statistics import flake_figures
from fire_atlas.effect.flame.fires import Fire
from fire_atlas.recipe.effect import Flakes
from tests.support.clips import looped, open_clip, real
from tests.support.effect import (
    AGE,
    BLUR,
    LIFE,
    SIZE,
    STRETCH,
    TAIL,
    VX,
    VY,
    A,
    B,
    EffectRun,
    G,
    R,
    Y,
    pixel_of,
    run_effect,
)

SAMPLES = ("campfire", "torch")
REAL = ("real_fireplace_gif", "sim_unity_flame03")
SECONDS = 6.4
"""Whole rounds of most clips, so that the frames looked at first are like all others."""

RATE = 800


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


@pytest.mark.parametrize("held", [0.3, 0.45])
def test_an_ember_holds_its_light_and_then_dies(held: float) -> None:
    light = light_over_life(np.linspace(0, 1, 1001), np.full(1001, held))
    dies = round(1000 * held)
    assert light[0] == pytest.approx(0.55) and light[-1] == 0
    assert light[250 : dies + 1] == pytest.approx(1)
    assert (np.diff(light[:250]) > 0).all() and (np.diff(light[dies:]) < 0).all()
    assert light[(1000 + dies) // 2] == pytest.approx(0.5, abs=1e-3)


def test_some_embers_hold_their_light_longer_than_others() -> None:
    held = held_share(2000, seed=3)
    assert held.min() == pytest.approx(0, abs=0.01) and held.max() == pytest.approx(0.45, abs=0.01)
    assert np.std(held) == pytest.approx(0.45 / math.sqrt(12), rel=0.05)


def test_burnt_out_embers_were_already_dim_in_their_last_frame(effect: EffectRun) -> None:
    flights = [f for f in effect.flights(4) if f[-1, AGE] + 1.5 / effect.clip.fps >= f[-1, LIFE]]
    last = np.array([f[-1, A] / f[:, A].max() for f in flights if f[:, A].max() > 0])
    assert len(last) > 20 and np.median(last) < 0.1


def test_all_embers_have_one_colour(effect: EffectRun) -> None:
    light = effect.rows[:, [R, G, B]]
    assert light / light[:, :1] == pytest.approx(np.tile(EMBER_LIGHT, (len(light), 1)))


def test_sizes_are_log_normal(effect: EffectRun) -> None:
    """Within two standard deviations, beyond which they are held at the recipe's bounds."""
    size = _flakes(effect).size
    assert size != "auto"
    smallest, largest = (s * effect.clip.height for s in size)
    middle, sigma = math.log(smallest * largest) / 2, math.log(largest / smallest) / 4
    deviates = np.sort((np.log(effect.analysis.spawns.size) - middle) / sigma)
    inside = np.abs(deviates) < 1.999
    wanted = np.array([0.5 * (1 + math.erf(d / math.sqrt(2))) for d in deviates])
    found = (np.arange(len(deviates)) + 0.5) / len(deviates)
    assert np.abs(found - wanted)[inside].max() < 1.95 / math.sqrt(len(deviates))
    assert 0.4 <= sigma <= 0.7


def test_sizes_that_are_seen_spread_too_though_a_pixel_grid_cannot_show_the_smallest(
    effect: EffectRun,
) -> None:
    figures = {figure.name: figure for figure in flake_figures(effect.tracks)}
    assert figures["size, σ of its logarithm"].is_in_range


def test_streaks_are_as_long_as_the_way_in_the_open_shutter(effect: EffectRun) -> None:
    rows = effect.rows
    streak = (rows[:, STRETCH] - 1) * rows[:, SIZE] * SEEN_LENGTH
    weight = effect.study.kappa[pixel_of(rows, effect.clip)]
    exposed = np.minimum(0.7 * weight, 2 * effect.clip.fps * rows[:, AGE])  # from birth on
    way = np.hypot(rows[:, VX], rows[:, VY]) / effect.clip.fps * exposed
    moves = way > 0.05
    assert np.allclose(streak[moves], way[moves], rtol=0.05)


def test_streaks_taper_the_more_the_longer_they_are(effect: EffectRun) -> None:
    stretch, tail = effect.rows[:, STRETCH], effect.rows[:, TAIL]
    assert tail == pytest.approx(1 / stretch)


def test_dim_embers_are_out_of_focus(effect: EffectRun) -> None:
    rows = np.array([flight[0] for flight in effect.flights()])
    blurred = rows[:, BLUR] > 0
    assert np.mean(blurred) == pytest.approx(0.23, abs=0.03)
    blur, focused = rows[blurred, BLUR], rows[~blurred, SIZE]
    assert np.median(blur) / np.median(focused) == pytest.approx(2.45, rel=0.2)
    assert rows[blurred, R].max() < 2 < rows[~blurred, R].max()


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [("campfire", "torch", "candle"), pytest.param(("campfire", *REAL), marks=pytest.mark.clips)],
)
def test_all_four_ends_of_life_occur_over_long_runs(names: tuple[str, ...]) -> None:
    shares = dict.fromkeys(("left by the top", "left by the sides", "burnt out", "fell back"), 0.0)
    for name in names:
        effect = run_effect(looped(open_clip(name), 6.0), {"timeline": {"loop": "none"}})
        for figure in flake_figures(effect.tracks):
            if figure.name in shares:
                shares[figure.name] += figure.value / len(names)
        fallen = [f[-1, Y] > f[:, Y].min() + 0.02 * effect.clip.height for f in effect.flights(2)]
        shares["fell back"] += float(np.mean(fallen)) / len(names)
    assert all(share > 0.005 for share in shares.values()), shares


def _bursts(rate: float, frames: int) -> list[tuple[float, int]]:
    """Time and number of sparks of every burst of a steady fire at 24 fps, ``rate`` a second."""
    plane = np.zeros((120, 120), np.float32)
    plane[10::20, 10::20] = 1  # too far apart for one burst to reach two of them
    fires = (Fire(share=1.0, epsilon=0.0, alpha=0.5, candidate_count=36.0),)
    labels = np.zeros(plane.shape, np.uint8)
    emitter = EmitterSettings(1, 0.0, rate, 16.0, fires, (1.0, 2.0), (1.0, 2.0), 100, 24.0, 90.0)
    chance = np.random.default_rng(0)
    bursts: list[tuple[float, int]] = []
    for frame in range(frames):
        born = emit(frame, plane, labels, emitter)
        assert (np.hypot(born.launch_x, born.launch_y) > 0).all()
        places = np.column_stack([born.tick, np.floor(born.x), np.floor(born.y)])
        for place, sparks in zip(*np.unique(places, axis=0, return_counts=True), strict=True):
            bursts.append(((place[0] + chance.random()) * TICK, int(sparks)))
    return sorted(bursts)


@pytest.mark.slow
def test_bursts_of_16_sparks_on_average_come_at_exponential_intervals() -> None:
    bursts = _bursts(rate=4.0, frames=3000)
    assert len(bursts) == pytest.approx(500, rel=0.15)
    sparks = np.array([n for _, n in bursts])
    assert sparks.mean() == pytest.approx(16, abs=1.2)
    waits = 4 * np.sort(np.diff([time for time, _ in bursts]))
    found = (np.arange(len(waits)) + 0.5) / len(waits)
    assert np.abs(found - (1 - np.exp(-waits))).max() < 1.63 / math.sqrt(len(waits))
