"""GIF, APNG and WebP: delays, disposal, blending, and files that are not whole."""

import struct
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from fire_atlas.core.errors import SourceError
from fire_atlas.sources import animated
from tests.support import synthetic_fire as fire

CLEAR = (0, 0, 0, 0)
RED, GREEN, BLUE = (255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255)


def shown(path: Path, **settings: Any) -> list[list[tuple[int, ...]]]:
    """The first row of every frame, as bytes (colours here are 0 or 255, so light is too)."""
    clip = fire.open_clip(path, **{"matte": "alpha", **settings})
    return [[tuple(int(v) for v in px * 255) for px in frame[0]] for frame in fire.all_frames(clip)]


def gif_bytes(frames: list[tuple[int, int, list[int], int]], width: int = 4) -> bytes:
    """A GIF of one row; a frame is x, disposal, colour indices (3 is transparent), hundredths."""
    palette = bytes([255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9])
    parts = [b"GIF89a" + struct.pack("<HHBBB", width, 1, 0xF1, 2, 0) + palette]
    for x, disposal, indices, delay in frames:
        parts.append(b"\x21\xf9\x04" + struct.pack("<BHBB", disposal << 2 | 1, delay, 3, 0))
        parts.append(b"\x2c" + struct.pack("<HHHHB", x, 0, len(indices), 1, 0))
        parts.append(b"\x02" + lzw(indices) + b"\0")
    return b"".join(parts) + b"\x3b"


def lzw(indices: list[int]) -> bytes:
    """One data block of 3-bit codes, each preceded by a clear code (4) so that none grows."""
    codes = [code for index in indices for code in (4, index)] + [5]
    bits = sum(code << 3 * i for i, code in enumerate(codes))
    body = bits.to_bytes(-(-3 * len(codes) // 8), "little")
    return bytes([len(body)]) + body


def test_gif_disposals(tmp_path: Path) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(
        gif_bytes([
            (0, 1, [0, 0, 0, 3], 10),  # red, kept
            (1, 3, [1, 1], 10),  # green, then what was there comes back
            (0, 2, [2, 2], 10),  # blue, then its place is cleared
            (3, 0, [1], 10),  # green at the end
        ])
    )  # fmt: skip
    assert shown(path) == [
        [RED, RED, RED, CLEAR],
        [RED, GREEN, GREEN, CLEAR],
        [BLUE, BLUE, RED, CLEAR],
        [CLEAR, CLEAR, RED, GREEN],
    ]


def test_a_gif_patch_that_leaves_the_canvas_is_cut(tmp_path: Path) -> None:
    (tmp_path / "a.gif").write_bytes(gif_bytes([(2, 1, [0, 1, 2, 0], 10)]))
    assert shown(tmp_path / "a.gif") == [[CLEAR, CLEAR, RED, GREEN]]


def overlapping_patches() -> list[fire.Rgba]:
    """Frames of half-transparent noise in a window that moves."""
    rng = np.random.default_rng(4)
    frames = []
    for i in range(5):
        frame = np.zeros((24, 32, 4), np.uint8)
        frame[i : i + 12, 2 * i : 2 * i + 14] = rng.integers(0, 256, (12, 14, 4))
        frames.append(frame)
    return frames


@pytest.mark.parametrize("disposal", list(PngImagePlugin.Disposal))
@pytest.mark.parametrize("blend", list(PngImagePlugin.Blend))
def test_apng_frames_are_those_that_ffmpeg_shows(disposal: int, blend: int, tmp_path: Path) -> None:
    # Pillow, which writes them, mixes transparent patches differently from the specification.
    path = fire.write_animation(
        tmp_path / "a.png", overlapping_patches(), duration=50, disposal=disposal, blend=blend
    )
    clip = fire.open_clip(path)
    with av.open(str(path)) as container:
        for i, frame in enumerate(container.decode(video=0)):
            wanted = fire.light(frame.to_ndarray(format="rgba"))
            assert np.abs(clip.read(i) - wanted).max() < 0.02
    assert i + 1 == clip.count == 5


@pytest.mark.parametrize("lossless", [True, False])
def test_webp_frames_are_those_that_libwebp_shows(lossless: bool, tmp_path: Path) -> None:
    path = fire.write_animation(
        tmp_path / "a.webp", overlapping_patches(), duration=50, lossless=lossless
    )
    clip = fire.open_clip(path)
    with Image.open(path) as image:
        for i in range(clip.count):
            image.seek(i)
            wanted = fire.light(np.asarray(image.convert("RGBA")))
            assert np.abs(clip.read(i) - wanted).max() < 0.02
    assert clip.count == 5


def test_apng_blends_straight_alpha_over(tmp_path: Path) -> None:
    under = np.full((2, 2, 4), (200, 0, 0, 255), np.uint8)
    over = np.full((2, 2, 4), (0, 100, 0, 128), np.uint8)
    fire.write_animation(
        tmp_path / "a.png", [under, over], duration=50, blend=PngImagePlugin.Blend.OP_OVER
    )
    clip = fire.open_clip(tmp_path / "a.png", matte="none")
    wanted = fire.light(np.array([[[100, 50, 0, 255]]], np.uint8))
    np.testing.assert_allclose(clip.read(1)[0, 0], wanted[0, 0], atol=0.005)


def test_delays_of_their_own_are_shown_at_a_constant_rate(tmp_path: Path) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(
        gif_bytes([(0, 1, [0] * 4, 10), (0, 1, [1] * 4, 30), (0, 1, [2] * 4, 20)])
    )  # fmt: skip
    rows = shown(path, fps=10, matte="none")
    assert [row[0] for row in rows] == [RED, GREEN, GREEN, GREEN, BLUE, BLUE]


@pytest.mark.parametrize("ending", ["gif", "png", "webp"])
def test_a_truncated_animation_is_refused_wherever_it_ends(
    ending: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = fire.write_animation(tmp_path / f"a.{ending}", fire.fires(), duration=50)
    data = whole.read_bytes()
    cut = tmp_path / f"cut.{ending}"
    end = len(data) - (2 if ending == "gif" else 1)  # a GIF plays without its trailer
    for stop in [*range(1, end, end // 50), end]:
        cut.write_bytes(data[:stop])
        with pytest.raises(SourceError, match=rf"cut\.{ending}"):
            fire.all_frames(fire.open_clip(cut))
    assert capfd.readouterr().err == ""


def test_damaged_pixels_name_the_frame(tmp_path: Path) -> None:
    data = bytearray(gif_bytes([(0, 1, [0] * 4, 10), (0, 1, [1] * 4, 30)]))
    block = lzw([1] * 4)
    at = data.rindex(block)
    data[at : at + len(block)] = b"\x01\x07"
    (tmp_path / "a.gif").write_bytes(data)
    with pytest.raises(SourceError, match=r"a\.gif: frame 1 is broken"):
        fire.all_frames(fire.open_clip(tmp_path / "a.gif"))


def test_a_gif_without_frames_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.gif").write_bytes(gif_bytes([]))
    with pytest.raises(SourceError, match="holds no frames"):
        fire.open_clip(tmp_path / "a.gif")


def test_too_many_frames_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(gif_bytes([(0, 1, [0], 65535), (0, 1, [1], 65535)], width=1))
    with pytest.raises(SourceError, match="frames; at most 10000 are allowed: give a lower fps"):
        fire.open_clip(path, fps=240)
    monkeypatch.setattr(animated, "MAX_FRAMES", 1)
    with pytest.raises(SourceError, match="2 frames; at most 1 are allowed"):
        fire.open_clip(path)


def test_a_grid_on_an_animation_is_refused(tmp_path: Path) -> None:
    grid = {"columns": 2, "rows": 2}
    for ending in ("gif", "png", "webp"):
        path = fire.write_animation(tmp_path / f"a.{ending}", fire.fires(), duration=50)
        with pytest.raises(SourceError, match=r"grid: cuts one still image|without grid"):
            fire.open_clip(path, grid=grid)
