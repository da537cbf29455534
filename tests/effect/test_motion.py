"""Embers move with the flame of their clip, and leave it as filmed ones do.

``tools/bench/motion.py`` prints the figures behind these bounds.
"""

from functools import lru_cache

import pytest

from fire_atlas.effect.flakes.statistics import flake_figures
from tests.support.clip_motion import (
    Flow,
    correlation,
    crowding,
    dis_flow,
    flows_of,
    in_the_flame,
    other_flow,
    share_that_rises,
)
from tests.support.clips import (
    ALL_CLIPS,
    RISING,
    RISING_SAMPLES,
    SAMPLES,
    looped,
    open_clip,
    piece,
    real,
)
from tests.support.effect import EffectRun, run_effect

MANY = 600
"""Births a second, for statistics: flakes do not know of each other."""

CUT = ("real_candle_red", "real_firewall_stock")
"""Clips that do not close, and are cut by default."""

MOST_IN_A_CELL = {
    "candle": 6.5, "cartoon": 5.5, "cartoon_wesnoth_campfire": 7.0, "pixel_art": 6.5,
    "torch": 6.5,
}  # fmt: skip
"""Most rows in a cell against the plume's mean, where it is not 5: all flakes of the calm candle
leave by its tip, the torch is narrow and swings, and the paintings fill their frame, with the plume
in a few cells at the top. Embers that are slower than the gas stay longer where they leave the
flame, and those that one eddy moves stay together.
"""

RISING_CLIPS = [*RISING_SAMPLES, *map(real, RISING)]
OTHER_CLIPS = [
    *(name for name in SAMPLES if name not in RISING_SAMPLES),
    *(real(name) for name in ALL_CLIPS if name not in RISING),
]
of_rising_clips = pytest.mark.parametrize("name", RISING_CLIPS, scope="module")
of_all_clips = pytest.mark.parametrize("name", [*RISING_CLIPS, *OTHER_CLIPS], scope="module")
"""In the scope of the module pytest runs all tests of a clip one after another, so that each clip
is read once. For this, clips that both lists have must be at the same places of both."""


@pytest.fixture(scope="module")
def long_run(name: str) -> EffectRun:
    """Embers over a clip for a while."""
    # Sparks of bursts leave from one point.
    keys = {"flakes": {"rate": 200, "bursts": 0}, "timeline": {"loop": "none"}}
    burns_low = name == "real_fireplace_gif"  # in its frame: little of that is above its flames
    clip = open_clip(name, "source" if burns_low else None)
    return run_effect(looped(clip, 5.0), keys)


@lru_cache(maxsize=1)
def _flows(name: str) -> list[Flow]:
    return flows_of(open_clip(name), dis_flow)


@of_rising_clips
def test_embers_follow_the_flow_of_the_flame(name: str) -> None:
    clip, flows = open_clip(name), _flows(name)
    # What is cut has no frames to compare with.
    loop = "none" if name in CUT else "auto"
    effect = run_effect(clip, {"flakes": {"scatter": 1, "rate": MANY}, "timeline": {"loop": loop}})
    places = in_the_flame(effect, flows, flows)
    x, y = correlation(places.flakes, places.flow)
    assert x >= 0.75 and y >= 0.6, f"{x:.2f} {y:.2f} at {len(places.flow)} places"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["candle", real("cartoon_freedoom_fire"), real("cartoon_tauran_flame_sheet")]
)
def test_embers_follow_the_flow_by_other_methods(name: str) -> None:
    """On the beginning of small clips; the others take minutes, in ``tools/bench/motion.py``."""
    whole = open_clip(name)
    clip = piece(whole, 0, min(24, whole.count))
    flows, others = (flows_of(clip, method) for method in (dis_flow, other_flow))
    keys = {"flakes": {"scatter": 1, "rate": MANY}, "timeline": {"loop": "none"}}
    places = in_the_flame(run_effect(clip, keys), flows, others)
    x, y = correlation(places.flakes, places.other)
    assert x >= 0.75 and y >= 0.6, f"{x:.2f} {y:.2f} at {len(places.flow)} places"


@of_all_clips
def test_no_clip_is_without_flakes(name: str) -> None:
    assert len(run_effect(open_clip(name)).tracks.spawns) > 0


@of_rising_clips
def test_nearly_all_embers_end_higher_than_they_began(long_run: EffectRun) -> None:
    assert share_that_rises(long_run) >= 0.95


@of_rising_clips
def test_flakes_do_not_pile_up_above_the_flame(name: str, long_run: EffectRun) -> None:
    part, cell = crowding(long_run)
    assert part <= 4.5
    assert cell <= MOST_IN_A_CELL.get(name, 5.0)


@of_rising_clips
def test_most_flakes_leave_by_the_top_or_the_sides_or_burn_out(long_run: EffectRun) -> None:
    fates = {f.name: f.value for f in flake_figures(long_run.tracks)}
    assert fates["left by the top"] + fates["left by the sides"] + fates["burnt out"] > 0.5
    assert fates["fell out of the bottom"] < 0.5
