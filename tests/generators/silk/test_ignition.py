"""Objects that catch fire: where there is flame, and only there."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.generators.silk.renderer import SilkRenderer
from tests.generators.silk.small_fires import camera, fire, planned

CANDLE: dict[str, Any] = {
    "fuel": "candle", "sheets": {"arrangement": "crossed", "count": 5, "width": 0.4, "height": 0.9},
    "rows": 16, "columns": 10, "height": 120, "width": 120,
}  # fmt: skip


def with_match(z: float, **keys: Any) -> SilkRenderer:
    match = {"shape": "match", "at": [0, 0, z], "radius": 0.02, "strength": 0, "draw": False}
    return fire(24, loops=False, intruders=[{**match, **keys}], **CANDLE)


@cache
def candle_light() -> list[NDArray[np.float32]]:
    """Light of some frames of the candle alone."""
    made, eye = fire(24, loops=False, **CANDLE), camera(width=120, height=120)
    return [made.draw(i, eye).light for i in range(0, 24, 3)]


def light_at(z: float) -> float:
    """Brightest light of the candle within the reach of a match at a height, in all frames."""
    rows, columns = np.mgrid[:120, :120]
    row = 120 * (1 - 0.06 - z)
    near = np.hypot(rows - row, columns - 60) < 0.07 * 120
    return float(max(light[near].max() for light in candle_light()))


@pytest.mark.parametrize(
    ("z", "is_in_flame"), [(0.3, True), (0.5, True), (0.86, False), (0.93, False)]
)
def test_a_match_lights_in_fire_and_not_above_it_where_the_sheet_goes_on(
    z: float, is_in_flame: bool
) -> None:
    assert (light_at(z) > 0.2) == is_in_flame
    lit = with_match(z).ignition.burning[:, 5:]
    assert lit[-1].max() == is_in_flame
    assert lit.any() == is_in_flame


def test_a_match_lights_the_same_on_a_coarse_mesh() -> None:
    for rows in (4, 48):
        keys = {**CANDLE, "rows": rows}
        match = {"shape": "match", "at": [0, 0, 0.45], "radius": 0.02, "draw": False}
        assert fire(12, loops=False, intruders=[match], **keys).ignition.burning[-1, 5:].max() == 1


CARRIED = [
    {"t": 0, "at": [0, 0, 0.2]},
    {"t": 0.2, "at": [0, 0, 0.2]},
    {"t": 1, "at": [0.7, 0, 0.2]},
]


@pytest.mark.parametrize("shape", ["sphere", "log", "wick", "match"])
def test_what_ignites_carries_its_fire_away(shape: str) -> None:
    body = {
        "shape": shape, "keyframes": CARRIED, "radius": 0.03, "length": 0.1, "draw": False,
        "strength": 0, "tilt": 90 if shape == "wick" else 0,
    }  # fmt: skip
    keys: dict[str, Any] = {"width": 240, "height": 120, "sheets": {"count": 3, "width": 0.3}}
    eye = camera(width=240, height=120)
    shed = []
    for ignites in (False, True):
        made = fire(26, loops=False, intruders=[{**body, "ignites": ignites}], **keys)
        shed.append(float(made.draw(25, eye).light[:, 170:].max()))
    assert shed[0] < 0.05 < 0.3 < shed[1]


def test_only_a_match_ignites_by_itself() -> None:
    for shape, sheets in (("sphere", 3), ("log", 3), ("wick", 3), ("match", 6)):
        body = {"shape": shape, "at": [0, 0, 0.2]}
        scene = planned(2, loops=False, intruders=[body], sheets={"count": 3})
        assert scene.model.sheets == sheets, shape


def test_wax_does_not_ignite() -> None:
    with pytest.raises(ValueError, match="its wick does"):
        fire(2, intruders=[{"shape": "wax", "at": [0, 0, 0], "ignites": True}])
