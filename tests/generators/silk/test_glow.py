"""Light that is scattered around a flame, and flames that catch fire."""

from typing import Any

import numpy as np
import pytest

from fire_atlas.core.pixels import as_plane, encode_unit
from fire_atlas.generators.silk.glow import scattered
from tests.generators.silk.small_fires import camera, fire


def test_the_glow_of_a_point_is_the_sum_of_three_gaussians() -> None:
    side, scale, share = 401, 200.0, 0.1
    light = np.zeros((side, side, 3), np.float32)
    light[200, 200] = 1000, 500, 0
    glow = scattered(light, scale, share)
    assert glow.sum(axis=(0, 1)) == pytest.approx([100, 50, 0], rel=0.03)
    away = np.arange(0, 120, 6)
    wide = np.array([0.025, 0.06, 0.14])[:, None] * scale
    wanted = (np.exp(-((away / wide) ** 2) / 2) / (2 * np.pi * wide**2)).mean(axis=0) * 100
    assert np.allclose(glow[200, 200 + away, 0], wanted, rtol=0.05, atol=1e-3)
    assert np.allclose(glow[200 + away, 200, 0], wanted, rtol=0.05, atol=1e-3)
    assert np.allclose(scattered(2 * light, scale, share), 2 * glow, atol=1e-6)


def test_a_glow_surrounds_the_flame_and_ends_within_the_frame() -> None:
    keys: dict[str, Any] = {"fuel": "candle", "sheets": {"count": 5}}
    plain, glowing = (fire(4, glow=glow, **keys).draw(1, camera()).light for glow in (0.0, 0.1))
    row = 50
    lit = np.flatnonzero(plain[row].max(axis=-1) > 0.2)
    beside = glowing[row, lit.max() + 5 :].max(axis=-1)
    assert not plain[row, lit.max() + 5 :].any()
    assert beside[0] > 0.005
    shown = 255 * encode_unit(as_plane(beside))
    assert (np.diff(shown) < 1).all(), "dither changes it by less than a step"
    assert (np.diff(np.convolve(shown, np.ones(9) / 9, "valid")) < 0.1).all()
    edges = [glowing[0], glowing[-1], glowing[:, 0], glowing[:, -1]]
    assert max(float(edge.max()) for edge in edges) < 1e-4


def test_a_flame_that_catches_fire_grows() -> None:
    sheets = {"count": 1, "width": 0.3}
    made = fire(4, fuel="candle", sheets=sheets)
    heights = []
    for lit in (0.0, 0.3, 0.6, 1.0):
        made.textures.burning[:] = lit
        light = made.draw(1, camera()).light.max(axis=(1, 2))
        heights.append(int((light > 0.1).sum()))
    assert heights[0] == 0
    assert (np.diff(heights) >= 4).all()
