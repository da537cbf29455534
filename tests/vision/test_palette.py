"""Mixing two frames along the colours of their clip."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.palette import Palette
from tests.support.clips import clip_of, open_clip, real
from tests.timeline.moving import arranged, ramp_fire

FIRE = (0, 0, 0), (0.2, 0.005, 0), (0.9, 0.1, 0.005), (1, 0.6, 0.1), (1, 0.95, 0.7)
PINK = (0, 0, 0), (0.08, 0, 0.05), (0.5, 0.02, 0.2), (1, 0.2, 0.5), (1, 0.75, 0.85)
BLUE = (0, 0, 0), (0, 0.01, 0.08), (0.01, 0.08, 0.5), (0.1, 0.5, 1), (0.7, 0.95, 1)
RAMPS = {"fire": FIRE, "pink": PINK, "blue": BLUE}


def lab(pixels: Pixels) -> NDArray[np.float64]:
    """Return CIELAB (n, 3) of linear pixels over black, by its definition (D65)."""
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175],
         [0.0193339, 0.119192, 0.9503041]]
    )  # fmt: skip
    xyz = np.clip(pixels[..., :3], 0, 1).reshape(-1, 3) @ to_xyz.T / [0.95047, 1, 1.08883]
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    x, y, z = f.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def hue_distances(clip: Clip) -> NDArray[np.float32]:
    """Return how far each hue is from the clip's nearest one of about the same lightness.

    Entry (L, a + 128, b + 128), each rounded to whole numbers; inf where the clip has none.
    """
    is_shown = np.zeros((103, 256, 256), np.uint8)
    for i in range(clip.count):
        light, a, b = np.rint(lab(clip.read(i))).astype(int).T
        is_shown[light + 1, a + 128, b + 128] = 1
    near = is_shown[:-2] | is_shown[1:-1] | is_shown[2:]
    return np.stack([
        cv2.distanceTransform(1 - each, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        if each.any() else np.full(each.shape, np.inf, np.float32)
        for each in near
    ])  # fmt: skip


def hue_error(frame: Pixels, distances: NDArray[np.float32]) -> float:
    """Return the 99.5th percentile of the distances of a frame's hues, all that can be seen."""
    light, a, b = np.rint(lab(frame)).astype(int).T
    errors = distances[light, a + 128, b + 128][light > 3]
    return float(np.percentile(errors[np.isfinite(errors)], 99.5))


def palette_of(clip: Clip) -> Palette:
    with Workers(1) as workers:
        return Palette.of(clip, workers)


@pytest.mark.parametrize("ramp", RAMPS.values(), ids=RAMPS)
def test_the_mix_of_two_colours_of_a_ramp_is_the_one_between_them(
    ramp: tuple[tuple[float, float, float], ...],
) -> None:
    clip = ramp_fire(ramp, 12)
    palette = palette_of(clip)
    heat = np.linspace(0.05, 1, 200)
    known = np.stack([np.interp(heat, np.linspace(0, 1, 5), each) for each in np.array(ramp).T])
    row = np.dstack([*known[:, None], np.ones((1, 200))]).astype(np.float32)
    hot, cold = np.full((1, 200, 4), (*ramp[-1], 1), np.float32), np.zeros((1, 200, 4), np.float32)
    cold[..., 3] = 1
    plane = np.ones((1, 200), np.float32)
    mixed = palette.mix(hot, cold, plane * np.float32(0.5), luminance(row), plane)
    # Saturated colours lose a little light: no channel may exceed the coverage.
    assert luminance(mixed) == pytest.approx(luminance(row), rel=0.05)
    assert np.hypot(*(lab(mixed) - lab(row))[:, 1:].T).max() < 6


def test_what_both_frames_show_is_kept_though_the_clip_seldom_does() -> None:
    clip = ramp_fire(FIRE, 12)
    frame = clip.read(3)
    frame[40:44, 40:44, :3] = (0.05, 0.3, 0.1)
    frame[40:44, 40:44, 3] = 1
    plane = luminance(frame)
    for weight in (0.1, 0.5, 0.9):
        share = np.full_like(plane, weight)
        mixed = palette_of(clip).mix(frame, frame, share, plane, frame[..., 3])
        assert np.abs(mixed - frame).max() < 2e-3


def test_a_mix_begins_as_one_frame_and_ends_as_the_other() -> None:
    clip = open_clip("torch")
    one, other = clip.read(0), clip.read(9)
    for weight, frame in ((0.0, one), (1.0, other)):
        plane = luminance(frame)
        share = np.full_like(plane, weight)
        mixed = palette_of(clip).mix(one, other, share, plane, frame[..., 3])
        differences = np.abs(np.sqrt(np.maximum(mixed, 0)) - np.sqrt(frame))
        assert np.percentile(differences, 95) < 0.02


def test_light_above_white_and_frames_of_nothing_are_mixed_as_well() -> None:
    bright = [ramp_fire(FIRE, 4).read(i) * np.array([4, 4, 4, 1], np.float32) for i in range(4)]
    clip = clip_of([*bright, np.zeros_like(bright[0])])
    plane = 0.5 * luminance(bright[0])
    mixed = palette_of(clip).mix(
        bright[0], clip.read(4), np.full_like(plane, 0.5), plane, bright[0][..., 3]
    )
    assert (luminance(mixed) <= plane * 1.001).all() and mixed[..., :3].max() > 1
    dark = palette_of(clip_of([np.zeros((8, 8, 4), np.float32)] * 3))
    zero = np.zeros((8, 8), np.float32)
    assert not dark.mix(clip.read(4)[:8, :8], clip.read(4)[:8, :8], zero, zero, zero).any()


@pytest.mark.parametrize("ramp", ["pink", "blue"])
def test_no_frame_of_a_crossfade_has_a_hue_that_the_clip_has_not(ramp: str) -> None:
    clip = ramp_fire(RAMPS[ramp], 36)
    loop = arranged(clip, loop="crossfade")
    channels = 0.5 * (clip.read(2) + clip.read(32))
    distances = hue_distances(clip)
    assert hue_error(channels, distances) > 8, "a mix of channels has others"
    for i in range(loop.count - 7, loop.count):
        assert hue_error(loop.read(i), distances) < 6


@pytest.mark.parametrize(
    "name",
    ["campfire", *map(real, ("real_candle_red", "real_firewall_stock",
     "real_fireplace_gif", "sim_unity_flame02", "sim_unity_flame03", "cartoon_fluent_fire",
     "cartoon_tauran_flame_sheet"))],
)  # fmt: skip
def test_no_frame_of_a_crossfaded_clip_has_a_hue_that_the_clip_has_not(name: str) -> None:
    clip = open_clip(name)
    loop, distances = arranged(clip, loop="crossfade"), hue_distances(clip)
    for i in range(loop.count - (clip.count - loop.count), loop.count):
        assert hue_error(loop.read(i), distances) < 6
