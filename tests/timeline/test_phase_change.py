"""Which frames of a loop are shown while its fire is lit and put out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.recipe.phases import MAX_EXIT
from fire_atlas.timeline.phase_change import exit_frames, extinction, ignition


@given(st.integers(1, 400), st.floats(1, 120), st.integers(0, 399))
def test_a_loop_is_left_within_the_longest_time_from_any_frame(
    loop: int, fps: float, main: int
) -> None:
    others = exit_frames(loop, fps, main % loop)
    exits = sorted([*others, main % loop])
    assert len({*exits}) == len(exits)
    waits = np.diff([exits[-1] - loop, *exits])
    assert waits.max() <= max(MAX_EXIT * fps + 1e-6, 1)


@pytest.mark.parametrize(("loop", "count"), [(48, 24), (10, 36), (7, 7)])
def test_an_ignition_ends_before_the_first_frame_and_burns_more_and_more(
    loop: int, count: int
) -> None:
    frames = ignition(loop, count)
    assert (np.diff(frames.shown) % loop == 1 % loop).all()
    assert (frames.shown[-1] + 1) % loop == 0
    assert (np.diff(frames.fuel) > 0).all()
    assert 0 < frames.fuel[0] < 0.2
    assert 0.95 < frames.fuel[-1] < 1


@pytest.mark.parametrize(("loop", "count"), [(48, 36), (10, 36), (7, 3)])
def test_an_extinction_goes_on_after_the_last_frame_and_ends_dark(loop: int, count: int) -> None:
    frames = extinction(loop, count)
    assert frames.shown[0] == 0
    assert (np.diff(frames.shown) % loop == 1 % loop).all()
    assert (np.diff(frames.fuel) <= 0).all()
    assert frames.fuel[-1] == 0
