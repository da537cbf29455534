"""One contract for every reader: the same frames in any format are the same clip."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.clip import Clip
from tests.support import synthetic_fire as fire

HALF_BYTE = 0.5 / 255
VIDEO = 0.06


def folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_folder(where / "f", fire.fires()), fps=12)


def pattern(where: Path) -> Clip:
    fire.write_folder(where / "f", fire.fires())
    return fire.open_clip(where / "f" / "fire*.png", fps=12)


def deep_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_deep_folder(where / "f", fire.fires()), fps=12)


def tga_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_folder(where / "f", fire.fires(), "tga"), fps=12)


def tiff_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_folder(where / "f", fire.fires(), "tiff"), fps=12)


def webp_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_folder(where / "f", fire.fires(), "webp"), fps=12)


def exr_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_exr_folder(where / "f", fire.fires()), fps=12)


def half_exr_folder(where: Path) -> Clip:
    return fire.open_clip(fire.write_exr_folder(where / "f", fire.fires(), half=True), fps=12)


def sheet(where: Path) -> Clip:
    path = fire.write_sheet(where / "s.png", fire.fires(), columns=3)
    return fire.open_clip(path, fps=12, grid={"columns": 3, "rows": 2})


def apng(where: Path) -> Clip:
    # 1000 / 12 ms is no whole number: let the rate be asked for.
    path = fire.write_animation(where / "a.png", fire.fires(), duration=83)
    return fire.open_clip(path, fps=12)


def webp(where: Path) -> Clip:
    path = fire.write_animation(
        where / "a.webp", fire.fires(), duration=83, lossless=True, exact=True
    )
    return fire.open_clip(path, fps=12)


def gif(where: Path) -> Clip:
    path = fire.write_animation(where / "a.gif", fire.fires(hard=True), duration=80, disposal=2)
    return fire.open_clip(path, fps=12.5)


def webm(where: Path) -> Clip:
    options = {"crf": "10", "b:v": "0"}
    frames = fire.fires()
    return fire.open_clip(
        fire.write_video(where / "a.webm", frames, "libvpx-vp9", "yuva420p", options)
    )


def vp8_webm(where: Path) -> Clip:
    options = {"crf": "4", "auto-alt-ref": "0", "b:v": "2M"}
    frames = fire.fires()
    return fire.open_clip(fire.write_video(where / "a.webm", frames, "libvpx", "yuva420p", options))


SOFT = {
    folder: 1e-6, pattern: 1e-6, deep_folder: 1e-6, tga_folder: 1e-6, tiff_folder: 1e-6,
    webp_folder: 1e-6, exr_folder: 1e-6, half_exr_folder: 1e-3, sheet: 1e-6, apng: 1e-6,
    webp: 1e-6, webm: VIDEO, vp8_webm: VIDEO,
}  # fmt: skip
Writer = Callable[[Path], Clip]


@pytest.mark.parametrize(("write", "off"), SOFT.items(), ids=lambda v: getattr(v, "__name__", ""))
def test_every_format_gives_the_frames_that_were_written(
    write: Writer, off: float, tmp_path: Path
) -> None:
    clip = write(tmp_path)
    expected = [fire.light(frame) for frame in fire.fires()]
    assert (clip.width, clip.height, clip.count) == (48, 40, 6)
    assert clip.fps == 12
    assert clip.matte == "alpha"
    for i, wanted in enumerate(expected):
        got = clip.read(i)
        assert got.dtype == np.float32
        assert got.shape == (40, 48, 4)
        assert np.abs(got - wanted).mean() <= off / 4
        assert np.abs(got - wanted).max() <= (off if off < VIDEO else 0.35)


def test_a_gif_gives_the_frames_that_were_written(tmp_path: Path) -> None:
    clip = gif(tmp_path)
    expected = [fire.light(frame) for frame in fire.fires(hard=True)]
    assert (clip.count, clip.fps, clip.matte) == (6, 12.5, "alpha")
    for got, wanted in zip(fire.all_frames(clip), expected, strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-6)


def test_an_mp4_gives_the_frames_that_were_written(tmp_path: Path) -> None:
    frames = fire.fires(12)
    opaque = [frame // 255 * 255 * (frame[..., 3:] > 127) for frame in frames]
    path = fire.write_video(tmp_path / "a.mp4", opaque, "libx264", "yuv444p", {"crf": "1"})
    clip = fire.open_clip(path, matte="none")
    assert (clip.width, clip.height, clip.count, clip.fps) == (48, 40, 12, 12)
    for got, frame in zip(fire.all_frames(clip), opaque, strict=True):
        frame[..., 3] = 255
        assert np.abs(got - fire.light(frame)).mean() < 0.03


@pytest.mark.parametrize("write", [folder, sheet, apng, webp, gif, webm], ids=lambda w: w.__name__)
def test_frames_are_the_same_in_any_order_and_from_any_thread(
    write: Writer, tmp_path: Path
) -> None:
    clip = write(tmp_path)
    in_order = fire.all_frames(clip)
    order = np.random.default_rng(3).integers(0, clip.count, 60).tolist()
    with ThreadPoolExecutor(4) as pool:
        for i, got in zip(order, pool.map(clip.read, order), strict=True):
            np.testing.assert_array_equal(got, in_order[i])


@pytest.mark.parametrize("write", [*SOFT, gif], ids=lambda w: w.__name__)
def test_every_frame_is_fresh(write: Writer, tmp_path: Path) -> None:
    clip = write(tmp_path)
    clip.read(1)[...] = 7
    assert clip.read(1).max() <= 1


@pytest.mark.parametrize("write", [folder, sheet, apng, webp, gif, webm], ids=lambda w: w.__name__)
def test_start_and_count_choose_frames_in_every_format(write: Writer, tmp_path: Path) -> None:
    whole = write(tmp_path)
    path = whole.inputs[0].parent if write is folder else whole.inputs[0]
    grid = {"columns": 3, "rows": 2} if write is sheet else None
    part = fire.open_clip(path, start=2, count=3, fps=whole.fps, grid=grid)
    assert part.count == 3
    for i in range(3):
        np.testing.assert_array_equal(part.read(i), whole.read(i + 2))


def test_one_image_is_a_clip_of_one_frame(tmp_path: Path) -> None:
    for ending in ("png", "gif", "webp", "tga", "bmp", "tiff"):
        path = tmp_path / f"still.{ending}"
        Image.fromarray(fire.fires(hard=True)[0]).save(path)
        assert fire.open_clip(path, matte="none").count == 1


def test_a_jpeg_is_read_upright(tmp_path: Path) -> None:
    frame = np.zeros((40, 64, 3), np.uint8)
    frame[:, :32] = 250
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(frame).save(tmp_path / "photo.jpg", exif=exif, quality=95)
    clip = fire.open_clip(tmp_path / "photo.jpg", matte="none")
    assert (clip.width, clip.height) == (40, 64)
    assert clip.read(0)[:24, :, :3].min() > 0.8
    assert clip.read(0)[40:, :, :3].max() < 0.05
