"""What generated fire shows of its clip, and when."""

from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate, measure_fire
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.model import node_heights
from tests.generators.profile.likeness import learnt_from, learnt_kite, settings
from tests.support.clips import real


@pytest.mark.parametrize("seed", range(4))
def test_no_part_of_the_clip_is_played_much_more_than_another(seed: int) -> None:
    profile = learnt_kite()
    fire = GeneratedFire.of(profile, settings(240, seed=seed))
    sequence, count = fire.sequences[0], profile.front.detail.count
    assert sequence.closed
    for track in fire.tracks[0]:
        played = np.zeros(count)
        starts = [segment.start for segment in track]
        for segment, end in zip(track, [*starts[1:], starts[0] + 240], strict=True):
            ages = np.arange(float(end - segment.start))
            np.add.at(played, sequence.frames_at(np.array(segment.first), ages)[0], 1)
        assert np.ptp(played) <= 4, played
        assert played.mean() == pytest.approx(7.5)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_fire_sways_as_far_as_its_clip(seed: int) -> None:
    profile = learnt_kite()
    sway = GeneratedFire.of(profile, settings(480, seed=seed)).sways[0]
    offset = profile.front.pose.offset
    moved = np.stack([sway.at(time)[0] for time in range(480)])
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
        plain = measure_fire(GeneratedFire.of(profile, wanted), workers).steps
        assert len(plain) == (96 if loop else 95)
        # As if the clip had been calmer.
        statistics = replace(profile.front.statistics, step=0.9 * float(plain.max()))
        calmer = replace(profile, front=replace(profile.front, statistics=statistics))
        fire = calibrate(calmer, wanted, workers)
        steps = measure_fire(fire, workers).steps
    assert steps.max() <= 0.9 * plain.max()
    assert np.median(steps) > 0.9 * np.median(plain)
    times = np.append(fire.frame_times, fire.frame_times[0] + 96) if loop else fire.frame_times
    assert (np.diff(times) > 0).all() and np.ptp(np.diff(times)) > 0.02
    assert np.ptp(times) == pytest.approx(96.0 if loop else 95.0)
    assert fire.time_rate(95) == pytest.approx(np.diff(times)[-1])


@pytest.mark.slow
def test_a_short_fire_need_not_lean_as_all_of_its_clip() -> None:
    profile = learnt_kite()
    with Workers(2) as workers:
        short, long = (calibrate(profile, settings(frames), workers) for frames in (2, 96))
        found = measure_fire(long, workers)
    assert abs(short.lean_bias) <= 1.0 and 0.95 <= short.sway_gain <= 1.05
    assert np.median(found.leans) == pytest.approx(np.median(profile.front.leans), abs=1.0)
