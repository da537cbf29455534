"""``features: {preset: paper}`` alone is the paper: what it sets, and what each part of it does.

Each test is of a place where formulas that hold by themselves were joined in another way than the
paper joins them.
"""

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import ndimage, stats

from fire_atlas.core.pixels import Pixels
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.flakes.emission import TICK
from fire_atlas.effect.flakes.flight import FlightField
from fire_atlas.effect.flame.features import difference_of_gaussians, gradient
from fire_atlas.pipeline.animation.analyse import FrameAnalyser
from fire_atlas.pipeline.animation.layers import flame_of
from tests.support.clips import ALL_CLIPS, campfire, open_clip, real
from tests.support.effect import (
    AGE,
    BLUR,
    ID,
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
    recipe_of,
    run_effect,
)

PAPER = {"preset": "paper"}

SIGMA = (1.0, 1.6)

CLIPS = ("campfire", "torch", "cartoon", *(real(name) for name in ALL_CLIPS))


@cache
def _run(name: str = "campfire", **flakes: Any) -> EffectRun:
    return run_effect(open_clip(name), {"features": PAPER, "flakes": {"rate": 120, **flakes}})


def test_what_a_recipe_states_wins_over_the_preset() -> None:
    keys: dict[str, Any] = {
        "features": {**PAPER, "n": 0, "kernel": "unit"},
        "buoyancy": {"motion": "flow", "drag": 1.0},
        "flakes": {"alpha": 2.0, "own_motion": 0.5},
        "motion_blur": {"flame": False},
        "wind": {"level": 2},
    }
    recipe = recipe_of(keys)
    for block, stated in keys.items():
        for key, value in stated.items():
            assert getattr(getattr(recipe, block), key) == value
    assert recipe.features.epsilon == 40 and recipe.buoyancy.lift == 0
    assert recipe_of({"features": PAPER, "flakes": "none", "motion_blur": "none"}).flakes == "none"


STATED: dict[str, list[Any]] = {
    "features": [{"n": 0}, {"sigma": [2, 3]}, {"epsilon": 90}, {"beta": 1}, {"clamp": 9},
                 {"kernel": "unit"}, {"kappa_over": "flame"}],
    "buoyancy": [{"motion": "flow"}, {"cell": 9}, {"coupling": 9}, {"feature_force": 9},
                 {"lift": 1}, {"gravity": 1}, {"drag": 2}, {"viscosity": 0.1}, {"turbulence": 0.5},
                 {"projection": True}],
    "flakes": [{"class": "none"}, {"style": "pixel"}, {"alpha": 9}, {"alpha": "auto"},
               {"bursts": 5}, {"sparks": 0.5}, {"life": [2, 3]}, {"size": [0.02, 0.03]},
               {"stretch": 0}, {"scatter": 1}, {"own_motion": 1}, {"lag": 0.2},
               {"colors": ["#00ff00"]}, {"intensity": 2}, {"edge": "fade"}, {"glow": 1},
               {"sprite": "pixel"}, {"max": 3}, {"bake": False}],
    "motion_blur": [{"shutter": 3}, {"exaggeration": 9}, {"flame": False}],
    "composite": [{"blend": "over"}, {"intensity": 2}, {"palette": "clip"}],
    "wind": [{"level": 4}, {"gusts": {"mean": 3}}],
}  # fmt: skip
"""Keys that are stated with the preset, a block at a time."""


BASE: dict[str, Any] = {"features": PAPER, "flakes": {"rate": 200}}
"""The preset, and enough flakes to see."""


@cache
def _shown_by_default() -> tuple[Array, Array]:
    return _shown(BASE)


def _shown(keys: dict[str, Any]) -> tuple[Array, Array]:
    """Return the rows of the tracks and some frames."""
    effect = run_effect(open_clip("cartoon"), keys)
    flakes = effect.recipe.flakes
    assert flakes != "none"
    frames = [effect.finished(i) for i in (5, 11)]
    return effect.rows, np.stack(frames).astype(np.float64)


@pytest.mark.parametrize(
    ("block", "stated"),
    [(block, keys) for block, each in STATED.items() for keys in each],
    ids=str,
)
def test_a_key_stated_with_the_preset_acts_or_is_refused(block: str, stated: Any) -> None:
    stated_too = {**BASE, block: {**BASE.get(block, {}), **stated}}
    try:
        recipe_of(stated_too)
    except ValidationError:
        return  # with advice: tests/recipe/test_validate.py
    pairs = zip(_shown_by_default(), _shown(stated_too), strict=True)
    assert not all(one.shape == other.shape and (one == other).all() for one, other in pairs)


def test_the_printed_kernel_is_equation_1_term_by_term() -> None:
    picture = campfire(96).brightness(10)
    y, x = np.mgrid[-9:10, -9:10]
    narrow, wide = (np.exp(-(x * x + y * y) / (2 * s * s)) / s for s in SIGMA)
    wanted = ndimage.correlate(
        picture.astype(float), (narrow - wide) / np.sqrt(2 * np.pi), mode="nearest"
    )
    found = difference_of_gaussians(picture, SIGMA, "printed")
    assert np.abs(found - wanted).max() < 0.002 * np.abs(wanted).max()


@pytest.mark.parametrize("name", ["campfire", "torch", "cartoon", real("real_candle_red")])
def test_vectors_of_the_printed_kernel_lead_out_of_the_flame(name: str) -> None:
    """Those of the kernel with sums of 1 lead back on the outer side of an edge."""
    clip = open_clip(name)
    bright = clip.brightness(clip.count // 2)
    darker = [-slope for slope in np.gradient(ndimage.gaussian_filter(bright, 2.0))]
    shares = {}
    for kernel in ("printed", "unit"):
        gx, gy = gradient(difference_of_gaussians(bright, SIGMA, kernel))
        length = np.hypot(gx, gy)
        strong = length > np.quantile(length[length > 1], 0.7)
        outwards = gx * darker[1] + gy * darker[0] > 0
        shares[kernel] = outwards[strong].mean()
    assert shares["printed"] > 0.93 and shares["unit"] < shares["printed"] - 0.1, shares


def test_nothing_but_feature_vectors_moves_the_air() -> None:
    keys = {"features": PAPER, "buoyancy": {"feature_force": 0}}
    field = run_effect(campfire(96), keys).analysis.field
    assert not field.u.any() and not field.v.any()


@pytest.mark.parametrize("name", CLIPS)
def test_the_field_stays_within_bounds(name: str) -> None:
    """Divided by a mean that κ had made small, the force of single cells was that of an explosion
    (57 heights/s): a fast gas jet does about 10."""
    field = _run(name).analysis.field
    assert np.hypot(field.u, field.v).max() < 8 * open_clip(name).height


@pytest.mark.parametrize("name", CLIPS)
def test_the_rate_is_that_of_births_at_the_papers_alpha(name: str) -> None:
    effect = _run(name, rate=600)
    seconds = effect.clip.count / effect.clip.fps
    assert len(effect.births) / seconds == pytest.approx(600, rel=0.15)


def _candidates(effect: EffectRun, i: int) -> int:
    analyser = FrameAnalyser.of(effect.clip, effect.study, effect.recipe)
    return len(analyser.candidates(analyser.features(i)).places)


@pytest.mark.parametrize("name", ["campfire", "cartoon", real("real_fireplace_gif")])
def test_births_are_in_proportion_to_the_candidates(name: str) -> None:
    found = []
    for alpha in (0.0, 0.03, 3.0, 30.0):
        effect = _run(name, rate=2000, alpha=alpha)
        frames = range(0, effect.clip.count, 4)
        found.append((np.mean([_candidates(effect, i) for i in frames]), len(effect.births)))
    candidates, births = np.array(found).T
    assert candidates[0] > 2 * candidates[-1]
    assert births / births[1] == pytest.approx(candidates / candidates[1], rel=0.12)


@pytest.mark.parametrize("preset", ["auto", "paper"])
def test_births_are_alike_all_over_the_candidates_of_a_stated_alpha(preset: str) -> None:
    keys = {"features": {"preset": preset}, "flakes": {"alpha": 1.0, "rate": 3000, "bursts": 0}}
    effect = run_effect(open_clip("campfire"), keys)
    analyser = FrameAnalyser.of(effect.clip, effect.study, effect.recipe)
    window, spawns = analyser.window, effect.analysis.spawns
    ranks: list[float] = []
    for i in range(0, effect.clip.count, 3):
        strength = analyser.features(i).strength
        candidates = np.sort(strength[strength > 1.0])
        frame = np.floor(spawns.tick * TICK * effect.clip.fps + 1e-6).astype(int) == i
        row = spawns.y[frame].astype(int) - window.top
        column = spawns.x[frame].astype(int) - window.left
        born = strength[row, column]
        ranks += (np.searchsorted(candidates, born[born > 1.0]) / len(candidates)).tolist()
    assert len(ranks) > 300
    # The ranks of births among the candidates' strengths are uniform.
    assert stats.kstest(ranks, "uniform").statistic < 0.08


def test_a_flake_has_the_velocity_of_the_field_alone() -> None:
    keys = {"features": PAPER, "flakes": {"rate": 200, "scatter": 1}, "timeline": {"loop": "none"}}
    effect = run_effect(campfire(), keys)
    air, births = FlightField(effect.analysis.field), effect.analysis.spawns.tick
    errors: list[float] = []
    for flight in effect.flights(3):
        for before, after in pairwise(flight):
            # Follow the field from one row to the next.
            place, time = before[[X, Y]], births[int(before[ID])] * TICK + before[AGE]
            steps = 5
            dt = (after[AGE] - before[AGE]) / steps
            for step in range(steps):
                x, y = place[:, None]
                u, v, *_ = air.at_time(time + step * dt).at(x, y, np.zeros(1))
                place = place + np.array([u[0], v[0]]) * dt
            way = np.hypot(*(after[[X, Y]] - before[[X, Y]]))
            if way > 0.3:
                errors.append(float(np.hypot(*(after[[X, Y]] - place)) / way))
    assert len(errors) > 300
    assert np.median(errors) < 0.03 and np.quantile(errors, 0.9) < 0.15


def test_flakes_differ_in_neither_light_nor_focus_but_by_speed_and_age() -> None:
    rows = _run().rows
    coloured = rows[:, [R, G, B]]
    speed = np.hypot(rows[:, VX], rows[:, VY])
    assert (effectively := np.unique(coloured[speed < 1e-6], axis=0)).shape[0] <= 1, effectively
    # Their brightest channel grows with their speed, smoothed over 0.2 s.
    assert stats.spearmanr(speed, coloured[:, 0]).statistic > 0.7
    assert not rows[:, BLUR].any(), "all are in focus"
    flights = _run().flights(12)
    for flight in flights[:40]:  # none flickers: they brighten up, and then fade
        peak = int(np.argmax(flight[:, A]))
        assert (np.diff(flight[peak:, A]) <= 0.02).all()


def test_flakes_are_the_longer_the_faster_they_are() -> None:
    """Figure 9: a circle at its birth, scaled and turned by the field's velocity."""
    rows = _run().rows
    speed, length = np.hypot(rows[:, VX], rows[:, VY]), rows[:, SIZE] * (rows[:, STRETCH] - 1)
    grown = rows[:, AGE] > 0.1
    assert stats.spearmanr(speed[grown], length[grown]).statistic > 0.9
    fast = speed > np.quantile(speed, 0.75)
    assert np.median(length[fast]) > 2 * np.median(length[~fast])


def test_the_flame_is_blurred_by_equation_17_itself() -> None:
    effect = _run()
    blur = effect.recipe.motion_blur
    assert blur != "none" and blur.flame and blur.exaggeration == 1 and blur.shutter == 1
    i = 20
    sharp = effect.clip.read(i)
    blurred = flame_of(i, sharp, effect.simulated, effect.recipe)
    field = effect.analysis.field
    wanted = blur_along(
        sharp, field.u[i], field.v[i], field.cell, effect.study.kappa, 1 / effect.clip.fps, 9
    )
    assert np.array_equal(np.asarray(blurred), wanted)


def _line() -> Pixels:
    """Return a thin bright line across a frame of 240 px."""
    pixels = np.zeros((240, 240, 4), np.float32)
    pixels[119:121, :] = 1.0
    return pixels


def _blurred_line(speed: float) -> Array:
    still, fast = np.zeros((60, 60), np.float32), np.full((60, 60), speed, np.float32)
    everywhere = np.ones((240, 240), np.float32)
    return blur_along(_line(), still, fast, 4, everywhere, 1.0, 9)[:, 120, 0].astype(float)


def test_a_long_blur_is_a_smear_and_no_row_of_copies() -> None:
    row = _blurred_line(48.0)
    inside = row[100:140]
    assert inside.std() < 0.1 * inside.mean()


def test_a_blur_is_at_most_a_quarter_of_the_frame_long() -> None:
    """However fast a cell of the field is, a pixel shows what lies near it."""
    lit = np.flatnonzero(_blurred_line(1e5) > 1e-3)
    assert 58 <= np.ptp(lit) <= 63
