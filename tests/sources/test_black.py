"""The black level of footage: found, taken off, and nothing else with it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import linear_to_srgb
from fire_atlas.sources.black import TRUE_BLACK, BlackLevel, find_black
from fire_atlas.sources.matte import apply
from tests.generators.profile.colour_difference import delta_e, lab_of
from tests.support import synthetic_fire as fire

Shown = NDArray[np.float64]
"""(H, W, 3), sRGB 0..255."""

SIZE = 120, 160


def flames(count: int = 6) -> list[Shown]:
    """Flames on true black that move, from dim to white, and leave most of the frame black."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    frames = []
    for i in range(count):
        far = np.hypot((x - 70 - 4 * i) / 30, (y - 70 + 3 * i) / 42)
        heat = np.clip(1.25 * (1 - far), 0, 1)
        frames.append(255 * np.dstack([heat, heat**1.8, heat**4]))
    return frames


def raised(frame: Shown, black: tuple[float, float, float]) -> Shown:
    """The frame as footage whose black is at ``black``, of 255, and whose white is white."""
    return np.asarray(np.array(black) + frame * (255 - np.array(black)) / 255)


def as_files(path: Path, frames: list[Shown]) -> Path:
    return fire.write_folder(path, _bytes(frames))


def as_video(path: Path, frames: list[Shown]) -> Path:
    options = {"crf": "4", "preset": "fast"}
    return fire.write_video(
        path.with_suffix(".mp4"), _bytes(frames), "libx264", "yuv420p", options, rate=24
    )


def _bytes(frames: list[Shown]) -> list[fire.Rgba]:
    opaque = np.full((*SIZE, 1), 255)
    return [np.dstack([np.rint(np.clip(f, 0, 255)), opaque]).astype(np.uint8) for f in frames]


def over_black(clip: Clip, i: int) -> Shown:
    return np.asarray(linear_to_srgb(clip.read(i)[..., :3]) * 255, np.float64)


@pytest.mark.parametrize("write", [as_files, as_video])
@pytest.mark.parametrize("black", [8, 16, 24])
def test_the_same_fire_comes_out_whatever_the_black(
    write: Callable[[Path, list[Shown]], Path], black: int, tmp_path: Path
) -> None:
    wanted = fire.open_clip(write(tmp_path / "clean", flames()), blend_space="linear")
    footage = [raised(frame, (black, black, black)) for frame in flames()]
    got = fire.open_clip(write(tmp_path / "raised", footage), blend_space="linear")
    assert (wanted.matte, got.matte) == ("luminance", "luminance")
    assert "taken off" in got.matte_reason and "taken off" not in wanted.matte_reason
    for i in range(wanted.count):
        flame = flames()[i].max(axis=2) > 0
        away = cv2.dilate(flame.astype(np.uint8), np.ones((17, 17))) == 0
        far = delta_e(lab_of(over_black(wanted, i)), lab_of(over_black(got, i)))
        # Two encodings of different pixels differ by themselves; files must agree everywhere.
        assert np.percentile(far[flame], 95 if write is as_video else 100) < 2
        assert far[flame].mean() < 1
        assert not got.read(i)[away].any()


def noisy(frame: Shown, sigma: float, seed: int) -> Shown:
    return np.asarray(frame + np.random.default_rng(seed).normal(0, sigma, frame.shape))


@pytest.mark.parametrize("sigma", [0.5, 1, 2])
@pytest.mark.parametrize("black", [(8, 8, 8), (24, 24, 24), (14, 18, 26)])
def test_black_is_found_for_each_channel_and_its_noise_shows_nothing(
    black: tuple[float, float, float], sigma: float, tmp_path: Path
) -> None:
    footage = [noisy(raised(f, black), sigma, i) for i, f in enumerate(flames())]
    found = find_black([each[..., :3] for each in _bytes(footage)])
    np.testing.assert_allclose(255 * np.array(found.level), black, atol=0.5)
    clip = fire.open_clip(as_files(tmp_path / "f", footage))
    for i in range(clip.count):
        away = flames()[i].max(axis=2) == 0
        assert (clip.read(i)[away][:, 3] > 0).mean() < 0.005
        bright = flames()[i].max(axis=2) > 16
        assert (clip.read(i)[bright][:, 3] > 0).all()


def test_dim_flame_of_four_levels_above_black_is_kept(tmp_path: Path) -> None:
    frames = [np.full((*SIZE, 3), 16.0) for _ in range(3)]
    for frame in frames:
        frame[40:60, 50:80, 0] = 20
    clip = fire.open_clip(as_files(tmp_path / "f", frames), blend_space="srgb")
    assert clip.read(0)[40:60, 50:80, 3] == pytest.approx(4 / (255 - 16), abs=1e-6)
    assert np.count_nonzero(clip.read(0)[..., 3]) == 20 * 30


def glow() -> Shown:
    """Dim flame all over the frame, brighter to the middle: nothing in it is black."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    heat = 90 - 0.8 * np.hypot(x - 80, y - 60)
    return np.asarray(np.dstack([heat, 0.5 * heat, 0.1 * heat]))


def test_a_glow_over_the_whole_frame_is_no_black(tmp_path: Path) -> None:
    assert find_black([frame[..., :3] for frame in _bytes([glow()] * 3)]) == TRUE_BLACK
    clip = fire.open_clip(as_files(tmp_path / "f", [glow()] * 3), "linear", matte="luminance")
    np.testing.assert_allclose(over_black(clip, 0), _bytes([glow()])[0][..., :3], atol=0.1)


def test_a_flash_leaves_the_black_of_the_other_frames() -> None:
    footage = [raised(frame, (16, 16, 16)) for frame in flames(4)]
    frames = [*footage, np.full((*SIZE, 3), 240.0)]
    found = find_black([frame[..., :3] for frame in _bytes(frames)])
    np.testing.assert_allclose(255 * np.array(found.level), 16)


def test_white_stays_white_and_other_light_is_stretched(tmp_path: Path) -> None:
    frames = [np.full((*SIZE, 3), 20.0) for _ in range(3)]
    for frame in frames:
        frame[10:20, 10:20], frame[30:40, 10:20] = 255, 137.5
    clip = fire.open_clip(as_files(tmp_path / "f", frames), black=20)
    shown = over_black(clip, 0)
    assert shown[15, 15] == pytest.approx(255)
    # 137.5 is stored as 138, and 118 of the 235 levels above black are left of it.
    seen = clip.read(0)[35, 15]
    assert seen[3] * 255 == pytest.approx(118 / 235 * 255, abs=0.01)


def test_a_stated_black_acts_by_its_amount_and_0_keeps_all(tmp_path: Path) -> None:
    path = as_files(tmp_path / "f", [raised(f, (16, 16, 16)) for f in flames()])
    kept = fire.open_clip(path, matte="luminance", black=0)
    assert kept.read(0)[..., 3].min() == pytest.approx(16 / 255, abs=1e-6)
    half = fire.open_clip(path, matte="luminance", black=8)
    assert half.read(0)[..., 3].min() == pytest.approx(8 / 247, abs=1e-6)


def test_light_above_white_is_kept() -> None:
    """EXR frames hold light beyond 1, which no level of black scales."""
    frame = np.zeros((4, 4, 4), np.float32)
    frame[..., 3], frame[1, 1, :3] = 1, (6, 2, 0.5)
    pixels = apply("luminance", frame, "linear", BlackLevel.grey(16))
    assert pixels[1, 1, :2] == pytest.approx([6, 2])
    assert pixels[1, 1, 2] < 0.5
    assert np.count_nonzero(pixels[..., 3]) == 1


@pytest.mark.parametrize("matte", ["none", "auto"])
def test_a_black_without_fire_on_black_is_refused(matte: str, tmp_path: Path) -> None:
    scene = np.broadcast_to(np.linspace(60, 240, SIZE[1])[:, None], (*SIZE, 3))
    path = as_files(tmp_path / "f", [np.array(scene)] * 3)
    with pytest.raises(SourceError, match=r"remove black, or set matte: luminance"):
        fire.open_clip(path, matte=matte, black=16)


def cuts(count: int) -> list[dict[str, Any]]:
    """Ten cuts of a clip: its single frames, ends and middles."""
    starts = [0, 1, count // 4, count // 3, count // 2, 2 * count // 3, count - 1]
    parts = [{"start": start, "count": 1} for start in starts]
    half = count // 2
    return [*parts, {"count": half}, {"start": half}, {"start": half // 2, "count": half}]


def lit_later(count: int = 12) -> list[Shown]:
    """Fire in the dark, whose first third could be fire on black; then the wall behind is lit."""
    rng = np.random.default_rng(5)
    wall = np.kron(rng.uniform(40, 150, (SIZE[0] // 10, SIZE[1] // 10)), np.ones((10, 10)))
    scene = wall[..., None] * np.array([1, 0.8, 0.6])
    return [np.maximum(f, scene * (3 * i >= count)) for i, f in enumerate(flames(count))]


@pytest.mark.parametrize("write", [as_files, as_video])
def test_every_cut_of_a_clip_gets_the_matte_of_the_whole(
    write: Callable[[Path, list[Shown]], Path], tmp_path: Path
) -> None:
    path = write(tmp_path / "clip", lit_later())
    whole = fire.open_clip(path)
    assert whole.matte == "none"
    for cut in cuts(12):
        clip = fire.open_clip(path, **cut)
        assert (clip.matte, clip.matte_reason) == (whole.matte, whole.matte_reason), cut


FOOTAGE = (
    "real_candle_red/clip.mp4", "real_firewall_stock/clip.mp4", "real_fireplace_gif/frames",
    "cartoon_fluent_fire/frames", "sim_unity_flame02/frames",
)  # fmt: skip


@pytest.mark.parametrize("name", FOOTAGE)
def test_every_cut_of_real_footage_gets_the_matte_of_the_whole(name: str, clips: Path) -> None:
    whole = fire.open_clip(clips / name)
    for cut in cuts(whole.count):
        clip = fire.open_clip(clips / name, **cut)
        assert (clip.matte, clip.matte_reason) == (whole.matte, whole.matte_reason), cut
