"""What is seen where an end passes into a beginning."""

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.loop_figures import Figures, LoopFigures, loop_figures
from fire_atlas.vision.palette import Palette
from tests.support.clips import clip_of, open_clip, piece, real
from tests.timeline.moving import arranged, blob, centre, moving, ramp_fire, turbulent

CUT = [
    ("torch", 2, 26),
    ("torch", 4, 26),
    ("cartoon", 0, 16),
    real("real_candle_red", 0, 40),
    real("real_firewall_stock", 0, 40),
]
"""Pieces of samples, and whole real clips, that do not close: name, first frame and frames."""

OVERLAP = 8


def _figures(clip: Clip) -> LoopFigures:
    return loop_figures(clip.read(i) for i in range(clip.count))


def _in_the_overlap(values: Figures, overlap: int) -> Figures:
    """Return the steps of a seam: into its first frame, between its frames, and out of its last."""
    return values[-overlap - 1 :]


@pytest.mark.parametrize(("name", "start", "count"), CUT)
def test_clips_that_do_not_close_get_a_seam_that_is_not_seen(
    name: str, start: int, count: int
) -> None:
    clip = piece(open_clip(name), start, count)
    assert _figures(clip).seam_ratio > 1.25, "it should need one"
    figures = _figures(arranged(clip))
    assert 0.8 <= figures.seam_ratio <= 1.25
    assert _in_the_overlap(figures.steps, OVERLAP).max() <= 1.25 * np.median(figures.steps)
    assert figures.seam_flow <= 1.1
    assert figures.details[-OVERLAP:].min() >= 0.9 * np.median(figures.details)


def test_a_shape_that_has_moved_passes_over_by_moving() -> None:
    """No ghosts: one blob in every frame of the seam, on its way from one place to the other."""
    clip = moving(lambda i: (38 + 0.5 * i, 48), 40)
    loop = arranged(clip, loop="crossfade", overlap=8)
    assert loop.count == 32
    for k in range(8):
        frame = loop.read(24 + k)
        share = (k + 1) / 9
        wanted = (1 - share) * (38 + 0.5 * (32 + k)) + share * (38 + 0.5 * k)
        x, y = centre(frame)
        assert abs(x - wanted) < 2.5 and abs(y - 48) < 0.5
        spread = _spread(frame)
        assert spread < 1.2 * _spread(clip.read(0)), "two blobs would be wider than one"


def _spread(frame: Pixels) -> float:
    cover = frame[..., 3].sum(axis=0).astype(np.float64)
    at = np.arange(len(cover)) + 0.5
    mean = (cover * at).sum() / cover.sum()
    return float(np.sqrt((cover * (at - mean) ** 2).sum() / cover.sum()))


def test_contrast_is_kept_where_a_linear_crossfade_loses_it() -> None:
    clip, overlap = turbulent(48, size=96), 8
    loop = arranged(clip, loop="crossfade", overlap=overlap)
    usual = np.median([np.var(clip.read(i)[..., 3]) for i in range(clip.count)])
    for k in range(overlap):
        share = (k + 1) / (overlap + 1)
        one, other = clip.read(40 + k), clip.read(k)
        plain = one * (1 - share) + other * share
        made = np.var(loop.read(32 + k)[..., 3])
        if 3 <= k <= 4:
            assert np.var(plain[..., 3]) < 0.75 * usual, "the linear one should be paler"
            assert made > 0.85 * usual


def test_what_stands_still_stays_as_it_is_through_the_seam() -> None:
    chance = np.random.default_rng(5)
    wall = chance.uniform(0.02, 0.4, (64, 64, 3))
    fire = turbulent(40)
    frames = []
    for i in range(40):
        rgb = wall.copy()
        rgb[20:44, 20:44] = np.maximum(rgb[20:44, 20:44], fire.read(i)[20:44, 20:44, :3])
        frames.append(np.dstack([rgb, np.ones((64, 64))]).astype(np.float32))
    loop = arranged(clip_of(frames, matte="none"), loop="crossfade", overlap=8)
    away = np.ones((64, 64), bool)
    away[14:50, 14:50] = False
    for i in range(loop.count):
        frame = loop.read(i)
        assert (frame[..., 3] == 1).all(), "an opaque scene stays opaque"
        assert np.abs(frame[..., :3] - wall)[away].max() < 0.03
        assert np.abs(luminance(frame) - luminance(frames[0]))[away].max() < 0.005


def test_light_never_exceeds_coverage_nor_is_negative() -> None:
    loop = arranged(turbulent(40), loop="crossfade", overlap=10)
    for i in range(loop.count):
        frame = loop.read(i)
        assert frame.min() >= 0 and frame[..., 3].max() <= 1
        assert (frame[..., :3] <= frame[..., 3:] + 1e-5).all()


def test_a_frame_is_fresh_each_time_it_is_read() -> None:
    loop = arranged(turbulent(40), loop="crossfade")
    first = loop.read(loop.count - 2)
    kept = first.copy()
    first[:] = 7
    assert np.array_equal(loop.read(loop.count - 2), kept)


def test_frames_may_be_made_of_nothing() -> None:
    frames = [blob(48, 48, light=0.0) for _ in range(20)]
    loop = arranged(clip_of(frames), loop="crossfade")
    assert not loop.read(loop.count - 1).any()


def test_the_hues_of_a_crossfade_are_measured() -> None:
    clip = ramp_fire([(0, 0, 0), (0.08, 0, 0.05), (0.5, 0.02, 0.2), (1, 0.2, 0.5)], 36)
    loop = arranged(clip, loop="crossfade")
    assert loop.hue_error is not None and loop.hue_error < 2
    assert arranged(clip, loop="none").hue_error is None
    with Workers(1) as workers:
        palette = Palette.of(clip, workers)
    swapped = clip.read(0)[..., [2, 1, 0, 3]]
    assert palette.hue_error(clip.read(0)) < 1 and palette.hue_error(swapped) > 20
