"""Other frame rates: the fire keeps its speed."""

import math
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.vision.palette import Palette
from tests.support.clips import clip_of, open_clip, piece, real
from tests.support.effect import VX, VY, run_effect
from tests.timeline.moving import (
    Notes,
    arranged,
    blob,
    centre,
    circling,
    moving,
    ramp_fire,
    steps,
    turbulent,
)


def _path(t: float) -> tuple[float, float]:
    """Place at ``t`` s: across the frame, on a wave."""
    return 20 + 50 * t, 48 - 18 * math.sin(2.2 * t)


@pytest.mark.parametrize("fps", [60.0, 48.0, 30.0, 15.0])
def test_a_blob_is_where_it_is_at_that_time(fps: float) -> None:
    clip = moving(lambda i: _path(i / 24), 25)
    made = arranged(clip, loop="none", fps=fps)
    assert made.fps == fps and made.count == math.floor(fps + 1e-6) + 1
    for i in range(made.count):
        x, y = centre(made.read(i))
        wanted = _path(i / fps)
        assert math.hypot(x - wanted[0], y - wanted[1]) < 0.5, f"frame {i}"


def test_frames_that_are_there_already_are_shown_as_they_are() -> None:
    clip = moving(lambda i: _path(i / 24), 25)
    made = arranged(clip, loop="none", fps=48)
    assert all(np.array_equal(made.read(2 * i), clip.read(i)) for i in range(25))


def test_a_loop_lasts_as_long_as_before_and_has_no_seam() -> None:
    made = arranged(circling(32, 32), fps=60)
    assert made.loop and made.count == 80
    places = [centre(made.read(i)) for i in range(made.count)]
    for i, (x, y) in enumerate(places):
        turn = 2 * math.pi * i / made.count
        assert math.hypot(x - 48 - 24 * math.cos(turn), y - 48 - 24 * math.sin(turn)) < 0.5
    assert steps(made)[-1] < 1.3 * np.median(steps(made))


def test_two_flames_that_have_nothing_in_common_are_not_shown_at_once() -> None:
    """A blob that jumps is here or there, and never at both places by half."""
    clip = clip_of([blob(24 if i % 2 else 72, 48) for i in range(12)])
    progress = Notes()
    made = arranged(clip, progress, loop="none", fps=60)
    for i in range(made.count):
        frame = made.read(i)
        here, there = frame[48, 24, 3], frame[48, 72, 3]
        assert max(here, there) > 0.8 and min(here, there) < 0.25
    assert any("nearest" in note for note in progress.notes)


def test_a_clip_keeps_its_rate_by_default() -> None:
    clip = circling(24, 24)
    assert arranged(clip).fps == clip.fps
    assert arranged(clip, fps=24.0).picture is clip.picture


LIVELY = ["campfire", "torch", *map(real, ("cartoon_tauran_flame_sheet", "sim_unity_flame03"))]


@pytest.mark.parametrize("name", LIVELY)
def test_no_frame_is_shown_twice_at_60_fps(name: str) -> None:
    made = steps(arranged(open_clip(name), fps=60.0))
    assert made.min() >= 0.3 * np.median(made)


@pytest.mark.parametrize(
    "name", ["campfire", "torch", real("real_fireplace_gif"), real("real_firewall_stock")]
)
def test_no_frame_is_shown_twice_where_32_go_on_for_96(name: str) -> None:
    made = arranged(piece(open_clip(name), 0, 32), frames=96)
    assert made.loop and made.count == 96
    assert steps(made).min() >= 0.3 * np.median(steps(made))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["campfire", real("sim_unity_flame03")])
def test_sparks_are_as_fast_as_at_the_rate_of_the_clip(name: str) -> None:
    """A little faster where frames follow one another sooner: they lose their flame less often."""
    clip = open_clip(name)

    def speed(**timeline: Any) -> float:
        keys = {"flakes": {"rate": 3600, "bursts": 0}, "timeline": timeline}
        rows = run_effect(clip, keys).rows
        return float(np.mean(np.hypot(rows[:, VX], rows[:, VY])))

    own = speed()
    assert speed(fps=24.0) == pytest.approx(own, rel=0.05)
    assert speed(fps=60.0) == pytest.approx(own, rel=0.1)


@pytest.mark.parametrize(
    ("fps", "least"), [(12.0, 11), (8.0, 7), (10.0, 5), (4.8, 4), (24.0, 0), (20.0, 0), (60.0, 0)]
)
def test_frames_about_halfway_that_nothing_shows_can_be_had(fps: float, least: int) -> None:
    clip = moving(lambda i: _path(i / 24), 25)
    made = arranged(clip, loop="none", fps=fps)
    assert len(made.skipped) >= least
    assert least or not made.skipped
    for i, (part, read) in made.skipped.items():
        assert 0.3 <= part <= 0.7 and i < made.count - 1
        wanted, shown = _path((i + part) / fps), centre(read())
        assert math.hypot(shown[0] - wanted[0], shown[1] - wanted[1]) < 0.01


def test_a_loop_has_a_frame_between_its_last_and_its_first() -> None:
    clip = circling(32, 32)
    made = arranged(clip, fps=12.0)
    assert made.loop and made.count == 16
    part, read = made.skipped[15]
    assert part == 0.5 and np.array_equal(read(), clip.read(31))


def test_what_is_shown_between_frames_moves_as_in_them() -> None:
    """A small blob on its way: its speed is where it is, not where it was."""
    clip = moving(lambda i: (20 + 7.0 * i, 48), 9, sigma=4.0)
    made = arranged(clip, fps=96.0, loop="none")
    assert made.flow is not None
    for i in range(made.count):
        light = made.read(i)[..., 3]
        u, v = (float((made.flow(i)[..., n] * light).sum() / light.sum()) for n in (0, 1))
        assert u == pytest.approx(7 * 24, rel=0.12) and abs(v) < 5


def test_a_frame_that_is_shown_again_moves_as_it_did() -> None:
    """Pixel art is never mixed: the flow is that of the frame that is shown."""
    frames = []
    for i in range(8):
        frame = np.zeros((48, 48, 4), np.float32)
        top = 40 - i * (i + 1) // 2  # faster and faster upwards
        frame[top : top + 6, 20:28] = (1.0, 0.5, 0.0, 1.0)
        frames.append(frame)
    clip = clip_of(frames)
    made = arranged(clip, fps=60.0, loop="none")
    assert made.flow is not None
    flows: dict[int, np.ndarray[Any, np.dtype[np.float32]]] = {}
    for i in range(made.count):
        shown = next(n for n in range(8) if np.array_equal(made.read(i), frames[n]))
        assert np.array_equal(flows.setdefault(shown, made.flow(i)), made.flow(i))
    assert len(flows) == 8


def test_fire_that_goes_on_does_not_repeat_itself() -> None:
    clip = turbulent(36)
    made = arranged(clip, frames=108)
    frames = np.stack([made.read(i)[::4, ::4, 3] for i in range(108)])
    for shift in range(12, 96):
        apart = np.sqrt(np.mean((frames - np.roll(frames, shift, axis=0)) ** 2))
        assert apart > 2 * np.median(steps(made)), f"it repeats after {shift} frames"


def test_fire_that_goes_on_once_begins_as_the_clip_does() -> None:
    clip = turbulent(36)
    made = arranged(clip, loop="none", frames=90)
    assert made.count == 90 and not made.loop
    assert np.array_equal(made.read(0), clip.read(0))
    assert steps(made).max() < 1.5 * np.median(steps(made))


def test_frames_in_between_have_colours_of_the_clip() -> None:
    """A mix of channels has hues between dark red and yellow that this ramp does not have."""
    clip = ramp_fire([(0, 0, 0), (0.5, 0, 0.02), (0.9, 0.05, 0), (1, 0.9, 0.1)], 12)
    made = arranged(clip, loop="none", fps=48)
    with Workers(2) as workers:
        palette = Palette.of(clip, workers)
    errors = [palette.hue_error(made.read(i)) for i in range(1, made.count, 2)]
    plain = [
        palette.hue_error(as_plane((clip.read(i) + clip.read(i + 1)) / 2))
        for i in range(clip.count - 1)
    ]
    assert max(errors) <= 6 and max(errors) < 0.5 * max(plain)
