"""Flow, warping and even sampling, on pictures whose motion was invented."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.vision.flow import farneback_flow, optical_flow
from fire_atlas.vision.sampling import ClipSamples, evenly_spread
from fire_atlas.vision.warp import (
    BidirectionalFlow,
    FlowField,
    bidirectional_flow,
    intermediate_flows,
    warp,
    warp_by_pixels,
)


def waves(shift: float, side: int = 96) -> NDArray[np.float32]:
    """Return a smooth pattern, 0..255, moved by ``shift`` px to the right."""
    x, y = np.meshgrid(np.arange(side) - shift, np.arange(side))
    return as_plane(127 + 60 * np.sin(x / 7) * np.cos(y / 9) + 60 * np.sin((x + 2 * y) / 11))


@pytest.mark.parametrize(("finest_scale", "refinements"), [(1, 3), (0, 5)])
@pytest.mark.parametrize("is_small", [True, False])
def test_a_known_shift_is_found(is_small: bool, finest_scale: int, refinements: int) -> None:
    one, other = waves(0).astype(np.uint8), waves(3).astype(np.uint8)
    flow = optical_flow(one, other, is_small, finest_scale=finest_scale, refinements=refinements)
    assert np.median(flow[..., 0]) == pytest.approx(3, abs=0.2)
    assert np.median(flow[..., 1]) == pytest.approx(0, abs=0.2)


def test_a_known_shift_is_found_by_farneback_too() -> None:
    one, other = (np.ascontiguousarray(waves(by).astype(np.uint8).T) for by in (0, 3))
    flow = farneback_flow(one, other)
    assert np.median(flow[..., 0]) == pytest.approx(0, abs=0.2)
    assert np.median(flow[..., 1]) == pytest.approx(3, abs=0.2)
    assert np.abs(farneback_flow(one, one))[20:-20, 20:-20].max() < 0.01


def test_no_motion_is_no_flow() -> None:
    one = waves(0).astype(np.uint8)
    flow = bidirectional_flow(one, one, 0.01)
    assert all(not plane.any() for field in flow for plane in field)


def test_a_picture_warped_by_its_flow_is_the_other_picture() -> None:
    flow = np.zeros((96, 96, 2), np.float32)
    flow[..., 0] = 3
    assert np.allclose(warp_by_pixels(waves(3), flow)[:, 3:-3], waves(0)[:, 3:-3], atol=1e-3)
    assert np.allclose(warp_by_pixels(waves(0), flow, -1.0)[:, 3:-3], waves(3)[:, 3:-3], atol=1e-3)


def test_both_pictures_meet_between_their_places() -> None:
    forward = FlowField(np.full((8, 8), 4 / 96, np.float32), np.zeros((8, 8), np.float32))
    flow = BidirectionalFlow(forward, forward.scaled(-1))
    for time in (0.25, 0.5):
        to_one, to_other = intermediate_flows(flow, time)
        wanted = waves(4 * time)[:, 4:-4]
        assert np.allclose(warp(waves(0), to_one)[:, 4:-4], wanted, atol=1.0)
        assert np.allclose(warp(waves(4), to_other)[:, 4:-4], wanted, atol=1.0)


@pytest.mark.parametrize(
    ("first", "last", "most", "found"),
    [(0, 9, 4, [0, 3, 6, 9]), (1, 3, 8, [1, 2, 3]), (5, 5, 3, [5]), (0, -1, 3, [])],
)
def test_numbers_are_spread_evenly_with_both_ends(
    first: int, last: int, most: int, found: list[int]
) -> None:
    assert evenly_spread(first, last, most) == found


@pytest.mark.parametrize(("count", "steps"), [(1, []), (2, [pytest.approx(0.1)])])
def test_samples_of_a_clip_hold_both_frames_of_each_step(count: int, steps: list[float]) -> None:
    frames = [np.full((4, 4, 4), 0.1 * i, np.float32) for i in range(count)]
    clip = Clip(4, 4, 12.0, count, frames.__getitem__, (), "srgb", "alpha", "")
    samples = ClipSamples.of(clip, Workers(1))
    assert sorted(samples.frames) == list(range(count))
    assert samples.steps() == steps
