"""The light of embers: its spread, its flicker, and what the width of a pixel takes from it."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.appearance import Appearance, track_rows
from fire_atlas.effect.flakes.brightness import defocus, ember_brightness, flicker
from fire_atlas.effect.flakes.drawing import SEEN_LENGTH
from fire_atlas.effect.flakes.emission import Spawns
from fire_atlas.effect.flakes.particles import ParticleState
from fire_atlas.effect.flakes.tracks import COLUMNS


@pytest.mark.parametrize("count", [20, 400, 5000])
def test_few_embers_have_the_whole_spread_of_light(count: int) -> None:
    light = np.sort(ember_brightness(count, seed=3))
    quantile = (np.arange(count) + 0.5) / count
    most = quantile <= 0.86
    scores = np.log(light[most] / 1.35) / 1.85
    assert scores == pytest.approx(norm.ppf(quantile[most]), abs=2e-3)
    least = 1.35 * np.exp(1.85 * norm.ppf(0.86))
    hot = least * (650 / least) ** ((quantile[~most] - 0.86) / 0.14)
    assert light[~most] == pytest.approx(hot, rel=1e-3)


def test_the_light_of_embers_is_in_no_order_and_depends_on_the_seed() -> None:
    light = np.log(ember_brightness(2000, seed=1))
    assert abs(np.corrcoef(light[1:], light[:-1])[0, 1]) < 0.05
    assert not np.array_equal(light, np.log(ember_brightness(2000, seed=2)))
    degree = defocus(2000, 0.08, seed=1)
    assert np.sort(degree[degree > 0]) == pytest.approx((np.arange(160) + 0.5) / 160)
    assert abs(np.corrcoef(degree, light)[0, 1]) < 0.05


def _flickers(count: int, frames: int, fps: float) -> NDArray[np.float64]:
    return np.array(list(itertools.islice(flicker(count, fps, seed=5), frames)))


@pytest.mark.parametrize("fps", [12.0, 24.0, 60.0])
def test_flicker_is_an_autoregressive_process_in_time_whatever_the_frame_rate(fps: float) -> None:
    score = np.log(_flickers(400, 300, fps)) / 0.5 + 0.25
    assert score.mean() == pytest.approx(0, abs=0.03)
    assert score.std() == pytest.approx(1, abs=0.03)
    for lag in (1, 2, 3):
        found = np.mean(score[lag:] * score[:-lag])
        ticks = np.diff(np.rint(np.arange(300) * 60 / fps)[::lag])
        wanted = np.mean(np.exp(-ticks / 60 / 0.13))
        assert found == pytest.approx(wanted, abs=0.02)


def test_flicker_keeps_the_mean_light() -> None:
    assert _flickers(400, 300, 24.0).mean() == pytest.approx(1, abs=0.02)


def test_flicker_at_24_frames_a_second_is_that_of_filmed_embers() -> None:
    logarithm = np.log(_flickers(400, 300, 24.0))
    assert 0.35 <= logarithm.std() <= 0.5
    assert 0.28 <= np.abs(np.diff(logarithm, axis=0)).mean() <= 0.45


def _rows(
    size: float | NDArray[np.float64], speed: float = 0.0, age: float = 0.0, **look: object
) -> dict[str, NDArray[np.float64]]:
    """Return the columns of one frame of 2000 flakes, ``size`` px wide, ``age`` s old."""
    count = 2000
    one, none = np.ones(count), np.zeros(count)
    spawns = Spawns(
        kind=np.zeros(count, np.int64), tick=np.zeros(count, np.int64), x=one, y=one,
        launch_x=none, launch_y=none, terminal_velocity=none, drift=one, life=one,
        size=one * size, size_score=none, turbulence_rate=one, turbulence_phase_x=none,
        turbulence_phase_y=none, z=none, launch_z=none, turbulence_phase_z=none,
    )  # fmt: skip
    moving, old = speed * 24 * one, age * one
    places = 200 * one, 200 * one, moving
    state = ParticleState(np.arange(count), *places, none, none, none, old, none, none)
    keys = {
        "seed": 1, "colours": np.array([[1.0, 0.5, 0.25]]), "intensity": 0.5, "stretch": 0.0,
        "shutter": 0.5, "kappa": np.ones((400, 400), np.float32),
        "glare": np.zeros((1, 1, 1), np.uint8), "cell": 400, "fades": False, "art": None,
        "fps": 24.0, **look,
    }  # fmt: skip
    with Workers(1) as workers:
        (rows,) = track_rows([state], spawns, Appearance(**keys), workers)  # type: ignore[arg-type]
    return dict(zip(COLUMNS, rows.T, strict=True))


def test_an_ember_thinner_than_a_pixel_is_dimmer_and_not_wider() -> None:
    """Each gives the light of its own area, drawn as wide as a pixel sees it."""
    thin, wide = _rows(0.2), _rows(0.8)
    focused = thin["blur"] == 0
    assert thin["size"][focused] == pytest.approx(0.2 + 1.7)
    assert wide["size"][focused] == pytest.approx(0.8 + 1.7)
    sums = [rows["r"] * rows["a"] * rows["size"] ** 2 for rows in (thin, wide)]
    assert sums[1] / sums[0] == pytest.approx(16)


def test_an_ember_out_of_focus_is_wider_by_any_degree_and_dimmer_by_its_area() -> None:
    rows = _rows(1.0)
    blurred = rows["blur"] > 0
    wider = rows["size"][blurred] / rows["size"][~blurred][0]
    assert wider.min() == pytest.approx(2.5, abs=0.1)
    assert wider.max() == pytest.approx(4.4, abs=0.1)
    assert np.median(wider) == pytest.approx(3.45, abs=0.15)
    flickering = np.array(list(itertools.islice(flicker(2000, 24.0, 1), 1)))[0]
    steady = rows["a"] / flickering
    assert steady[blurred] == pytest.approx(steady[~blurred][0] / wider**2)


def test_a_longer_streak_is_dimmer_in_each_pixel() -> None:
    still, fast = _rows(3.0, age=0.5), _rows(3.0, speed=20.0, age=0.5)
    focused = still["blur"] == 0
    size, streak = 3 + 1.7, 10 / SEEN_LENGTH
    stretch = 1 + streak / size
    assert fast["stretch"][focused] == pytest.approx(stretch)
    share = (3 + streak) * 3 / ((size + streak) * size) / (9 / size**2)
    dimmer = share * (1 + 0.35) / (1 + 0.35 * stretch)
    assert fast["a"][focused] / still["a"][focused] == pytest.approx(dimmer)


@pytest.mark.parametrize(("shown", "seen"), [(0, 1), (70, 1), (132, 0.5), (170, 0), (255, 0)])
def test_an_ember_is_lost_in_the_glare_of_bright_flame(shown: int, seen: float) -> None:
    """132 is a linear light of .23, halfway between .06 and .4."""
    glare = np.full((1, 4, 4), 255, np.uint8)
    glare[0, 2, 2] = shown  # the cell in which all are
    dark, lit = _rows(2.0), _rows(2.0, glare=glare, cell=90)
    assert lit["a"] == pytest.approx(dark["a"] * seen, rel=0.03, abs=1e-9)
    assert all((lit[name] == dark[name]).all() for name in COLUMNS if name != "a")


def test_embers_are_less_wide_the_hotter() -> None:
    """Up to the median width all are as wide as they are; above it, hot ones are narrower."""
    width = np.linspace(0.5, 4.5, 2000)
    rows = _rows(width)
    hot, focused = rows["r"] > 2, rows["blur"] == 0  # half of their light, by ``intensity``
    assert 0.2 < hot.mean() < 0.35 and (width[hot] > 4).any()
    wider = np.where(hot, 1 / (width / 2.5), (width / 2.5) ** 0.65)
    expected = np.where(width > 2.5, 2.5 * wider, width) + 1.7
    assert rows["size"][focused] == pytest.approx(expected[focused])


def test_a_streak_does_not_begin_before_the_birth_of_its_ember() -> None:
    """At 24 frames/s, half a frame of shutter: whole streaks from a quarter of a frame on."""
    ages = np.array([0.0, 1 / 192, 1 / 96, 0.5])
    rows = [_rows(3.0, speed=20.0, age=age) for age in ages.tolist()]
    length = [((r["stretch"] - 1) * r["size"])[r["blur"] == 0][0] * SEEN_LENGTH for r in rows]
    assert length == pytest.approx([0.0, 5.0, 10.0, 10.0])
