"""What generated fire shows of its clip, and when."""

from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate, measure_steps
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.playback import FrameSequence, Reference
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


@pytest.mark.slow
@pytest.mark.parametrize("loop", [True, False])
@pytest.mark.parametrize("name", ["pixel_art", real("cartoon_tauran_flame_sheet")])
def test_time_goes_slower_where_a_fire_would_jump_and_never_back(name: str, loop: bool) -> None:
    profile = learnt_from(name)
    wanted = settings(96, loop=loop)
    with Workers(2) as workers:
        plain = measure_steps(GeneratedFire.of(profile, wanted), workers)
        assert len(plain) == (96 if loop else 95)
        # As if the clip had been calmer.
        statistics = replace(profile.front.statistics, step=0.9 * float(plain.max()))
        calmer = replace(profile, front=replace(profile.front, statistics=statistics))
        fire = calibrate(calmer, wanted, workers)
        steps = measure_steps(fire, workers)
    assert steps.max() <= 0.9 * plain.max()
    assert np.median(steps) > 0.9 * np.median(plain)
    times = np.append(fire.frame_times, fire.frame_times[0] + 96) if loop else fire.frame_times
    assert (np.diff(times) > 0).all() and np.ptp(np.diff(times)) > 0.02
    assert np.ptp(times) == pytest.approx(96.0 if loop else 95.0)
    assert fire.time_rate(95) == pytest.approx(np.diff(times)[-1])
