"""What generated fire shows of its clip, and when."""

from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import DrawnFire, calibrate, seen_as_learnt
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.playback import FrameSequence, Reference
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.generators.profile.model import node_heights
from tests.support.clips import real
from tests.support.likeness import learnt_from, learnt_kite, settings


@pytest.mark.parametrize("seed", range(4))
def test_no_part_of_the_clip_is_played_much_more_than_another(seed: int) -> None:
    front = learnt_kite().front
    sequence = FrameSequence.of(front, 24.0)
    assert sequence.closed
    reference = Reference.random(sequence, 240, True, 5, seed, 0)
    played = np.bincount(reference.positions.astype(int), minlength=sequence.count)
    assert np.ptp(played) <= 4, played
    assert played.mean() == pytest.approx(7.5)


@pytest.mark.parametrize("seed", range(3))
def test_the_ends_of_a_clip_that_does_not_loop_are_played_as_often_as_its_middle(
    seed: int,
) -> None:
    sequence = FrameSequence.of(replace(learnt_kite().front, closed=False), 24.0)
    reference = Reference.random(sequence, 640, True, 5, seed, 0)
    played = np.bincount(reference.positions.astype(int), minlength=sequence.count)
    assert played.sum() == 640 and played.min() >= 14 and played.max() <= 26, played
    # Nothing is skipped but where a segment begins.
    forwards = np.diff(reference.positions) == 1
    assert (forwards | reference.cuts[1:]).all()


@pytest.mark.parametrize("seed", [0, 3])
def test_a_fire_sways_as_far_as_its_clip(seed: int) -> None:
    profile = learnt_kite()
    plane = GeneratedFire.of(profile, settings(480, seed=seed)).planes[0]
    offset = profile.front.pose.offset
    moved = np.stack([plane.sway(time)[0] for time in range(480)])
    top = int(np.argmin(np.abs(node_heights() - 1.0)))
    assert moved[:, top].std() == pytest.approx(offset[:, top].std(), rel=0.15)
    assert abs(moved[:, top].mean()) < 0.2 * offset[:, top].std()
    # A cut is not seen at once: nothing moves much further at a time than in the clip.
    most = np.abs(np.diff(offset, axis=0)).max()
    assert np.abs(np.diff(moved, axis=0)).max() < 1.5 * most


def test_a_loop_that_begins_elsewhere_has_the_frames_and_steps_that_it_shows() -> None:
    fire = GeneratedFire.of(learnt_kite(), settings(24))
    with Workers(2) as workers:
        drawn = DrawnFire.of(seen_as_learnt(fire), workers)
        moved = drawn.with_small_seam()
        again = DrawnFire.of(moved.rendering, workers)
    assert moved.fire.frame_times[0] > 0 and moved.seam < drawn.seam
    assert moved.steps == pytest.approx(again.steps)
    for i, frame in again.frames.items():
        assert np.array_equal(moved.frames[i].whole(), frame.whole())


def test_frames_that_were_drawn_to_be_measured_are_those_of_the_same_view_alone() -> None:
    profile = learnt_kite()
    with Workers(2) as workers:
        timed = calibrate(profile, settings(12), workers)
    assert timed.drawn is not None
    front, behind = renderings(timed.fire, [0.0, 180.0], 0.0, None)
    kept = len(timed.drawn.frames)
    assert np.array_equal(timed.picture(behind)(3), behind.frame(3))
    assert len(timed.drawn.frames) == kept == 12
    for _ in range(2):  # the second time it is drawn again
        assert np.array_equal(timed.picture(front)(3), front.frame(3))
        assert len(timed.drawn.frames) == 11


def test_a_fire_in_other_colours_than_those_it_was_measured_in_is_drawn_in_them() -> None:
    profile = learnt_kite()
    blue = replace(profile.front.colours, colours=profile.front.colours.colours[..., ::-1].copy())
    edited = replace(profile, front=replace(profile.front, colours=blue))
    with Workers(2) as workers:
        timed = calibrate(edited, settings(4), workers)
    [view] = renderings(timed.fire, [0.0], 0.0, None)
    red, _, shown_blue, _ = timed.picture(view)(0).sum(axis=(0, 1))
    assert shown_blue > red


@pytest.mark.slow
@pytest.mark.parametrize("loop", [True, False])
@pytest.mark.parametrize("name", ["pixel_art", real("cartoon_tauran_flame_sheet")])
def test_time_goes_slower_where_a_fire_would_jump_and_never_back(name: str, loop: bool) -> None:
    profile = learnt_from(name)
    wanted = settings(96, loop=loop)
    with Workers(2) as workers:
        plain = DrawnFire.of(seen_as_learnt(GeneratedFire.of(profile, wanted)), workers).steps
        assert len(plain) == (96 if loop else 95)
        # As if the clip had been calmer.
        statistics = replace(profile.front.statistics, step=0.9 * float(plain.max()))
        calmer = replace(profile, front=replace(profile.front, statistics=statistics))
        fire = calibrate(calmer, wanted, workers).fire
        steps = DrawnFire.of(seen_as_learnt(fire), workers).steps
    assert steps.max() <= 0.9 * plain.max()
    assert np.median(steps) > 0.9 * np.median(plain)
    times = np.append(fire.frame_times, fire.frame_times[0] + 96) if loop else fire.frame_times
    assert (np.diff(times) > 0).all() and np.ptp(np.diff(times)) > 0.02
    assert np.ptp(times) == pytest.approx(96.0 if loop else 95.0)
    assert fire.time_rate(95) == pytest.approx(np.diff(times)[-1])
