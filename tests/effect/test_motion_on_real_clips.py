"""Flakes move with the flame of real clips, and leave it as embers do.

``tests/bench/motion.py`` prints the figures behind these bounds.
"""

from functools import cache
from pathlib import Path

import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.effect.flakes.statistics import flake_figures
from tests.support.clip_motion import (
    correlation,
    crowding,
    dis_flow,
    flows_of,
    in_the_flame,
    other_flow,
    share_that_rises,
)
from tests.support.fires import ALL_CLIPS, RISING, Burnt, burn, looped, real_clip

MANY = 600
"""Births a second, for statistics: flakes do not know of each other."""

CUT = ("real_candle_red", "real_firewall_stock")
"""Clips that do not close, and are cut by themselves."""


@cache
def _clip(clips: Path, name: str) -> Clip:
    return real_clip(clips, name)


@cache
def _long(clips: Path, name: str) -> Burnt:
    keys = {"flakes": {"rate": 200}, "timeline": {"loop": "none"}}
    return burn(looped(_clip(clips, name), 5.0), keys)


@pytest.mark.parametrize("name", RISING)
def test_flakes_follow_the_flow_of_the_flame(clips: Path, name: str) -> None:
    clip = _clip(clips, name)
    flows = flows_of(clip, dis_flow)
    # What is cut has no frames to compare with.
    loop = "none" if name in CUT else "auto"
    burnt = burn(clip, {"flakes": {"scatter": 1, "rate": MANY}, "timeline": {"loop": loop}})
    places = in_the_flame(burnt, flows, flows)
    x, y = correlation(places.flakes, places.flow)
    assert x >= 0.75 and y >= 0.6, f"{x:.2f} {y:.2f} at {len(places.flow)} places"


@pytest.mark.parametrize("name", ["cartoon_freedoom_fire", "cartoon_tauran_flame_sheet"])
def test_flakes_follow_the_flow_by_other_methods(clips: Path, name: str) -> None:
    """On small clips; the others take minutes, in ``tests/bench/motion.py``."""
    clip = _clip(clips, name)
    flows, others = flows_of(clip, dis_flow), flows_of(clip, other_flow)
    keys = {"flakes": {"scatter": 1, "rate": MANY}, "timeline": {"loop": "none"}}
    places = in_the_flame(burn(clip, keys), flows, others)
    x, y = correlation(places.flakes, places.other)
    assert x >= 0.75 and y >= 0.6, f"{x:.2f} {y:.2f} at {len(places.flow)} places"


@pytest.mark.parametrize("name", RISING)
def test_nearly_all_flakes_end_higher_than_they_began(clips: Path, name: str) -> None:
    assert share_that_rises(burn(_clip(clips, name), {"flakes": {"rate": MANY}})) >= 0.95


@pytest.mark.parametrize("name", ALL_CLIPS)
def test_no_clip_is_without_flakes(clips: Path, name: str) -> None:
    assert len(burn(_clip(clips, name)).tracks.spawns) > 0


@pytest.mark.parametrize("name", RISING)
def test_flakes_do_not_pile_up_above_the_flame(clips: Path, name: str) -> None:
    part, cell = crowding(_long(clips, name))
    assert part <= 4
    # The painted campfire fills its frame: all of its plume is in a few cells at the top.
    assert cell <= (5 if name == "cartoon_wesnoth_campfire" else 4)


@pytest.mark.parametrize("name", RISING)
def test_most_flakes_leave_by_the_top_or_the_sides_or_burn_out(clips: Path, name: str) -> None:
    fates = {f.name: f.value for f in flake_figures(_long(clips, name).tracks)}
    assert fates["left by the top"] + fates["left by the sides"] + fates["burnt out"] > 0.5
    assert fates["fell out of the bottom"] < 0.5
