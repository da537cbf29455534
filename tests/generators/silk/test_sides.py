"""Fires that wind bends out of their frames: they die before its sides, and none is cut there."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.pixels import linear_to_srgb
from fire_atlas.generators.silk.renderer import SilkRenderer
from tests.generators.silk.small_fires import camera, fire

TALL: dict[str, Any] = {
    "width": 60, "height": 96, "sheets": {"count": 6, "width": 0.3, "height": 0.9}, "glow": 0.04,
}  # fmt: skip
"""A frame that is narrower than the flame is high."""

WINDS: dict[str, dict[str, Any]] = {
    "steady": {"level": 5.0, "direction": "left"},
    "gusts": {"gusts": {"mean": 2.5, "strength": 2.5, "period": 1.0}, "direction": "right"},
}


@cache
def blown(kind: str) -> SilkRenderer:
    return fire(24, wind=WINDS[kind], **TALL)


@pytest.mark.parametrize("azimuth", [0.0, 180.0])
@pytest.mark.parametrize("kind", WINDS)
def test_nothing_is_cut_at_the_sides_in_any_wind(kind: str, azimuth: float) -> None:
    eye = camera(azimuth, **TALL)
    frames = [blown(kind).draw(i, eye).light for i in range(0, 24, 3)]
    shown = np.asarray(linear_to_srgb(np.stack(frames))).max(axis=(0, 1, 3)) * 255
    assert max(shown[0], shown[-1]) <= 2
    # It burns as brightly as ever a little further in: without an end it would have been cut.
    near = round(0.08 * TALL["height"])
    assert max(shown[near], shown[-1 - near]) > 120


def test_what_burns_far_from_the_sides_is_as_it_is_in_a_wider_frame() -> None:
    narrow: dict[str, Any] = {
        "width": 72,
        "height": 96,
        "sheets": {"count": 4, "width": 0.2, "height": 0.6},
    }
    wide = {**narrow, "width": 120}
    light, further = (fire(4, **size).draw(2, camera(**size)).light for size in (narrow, wide))
    assert light.max() > 0.5
    np.testing.assert_array_equal(light, further[:, 24:-24])
