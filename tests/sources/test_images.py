"""Every kind of pixel a PNG or TIFF can hold, and broken files of every sort."""

import os
import struct
import subprocess
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.images import decode, read_header
from tests.support import synthetic_fire as fire

NOISE = np.random.default_rng(5).integers(0, 256, (9, 7, 4), np.uint8)


def decoded(path: Path) -> Any:
    return decode(path, read_header(path))


def png(
    depth: int, colour: int, rows: list[bytes], size: tuple[int, int], extra: bytes = b""
) -> bytes:
    def chunk(name: bytes, body: bytes) -> bytes:
        return (
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        )

    head = struct.pack(">IIBBBBB", *size, depth, colour, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + (chunk(b"tRNS", extra) if extra else b"")
        + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    )  # fmt: skip


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA"])
def test_every_png_mode_decodes_as_pillow_does(mode: str, tmp_path: Path) -> None:
    image = Image.fromarray(NOISE)
    image = (image.convert("RGB") if mode == "P" else image).convert(mode)
    image.save(tmp_path / "a.png")
    wanted = np.asarray(image.convert("RGBA" if "A" in mode else "RGB"))
    np.testing.assert_array_equal(decoded(tmp_path / "a.png"), wanted)


def test_pixels_that_are_too_many_to_inflate_at_once_are_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "noise.png"
    Image.fromarray(NOISE).save(path)
    monkeypatch.setattr("fire_atlas.sources.png._MOST_INFLATED", 100)
    assert np.array_equal(decoded(path), NOISE)


@pytest.mark.parametrize("mode", ["L", "RGB", "P"])
def test_a_colour_marked_transparent_is_transparent(mode: str, tmp_path: Path) -> None:
    image = Image.fromarray(NOISE).convert(mode)
    image.save(tmp_path / "a.png", transparency=image.getpixel((3, 3)))
    wanted = np.asarray(Image.open(tmp_path / "a.png").convert("RGBA"))
    np.testing.assert_array_equal(decoded(tmp_path / "a.png"), wanted)
    assert decoded(tmp_path / "a.png")[3, 3, 3] == 0


def test_two_bit_grey_with_a_transparent_grey(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(2, 0, [b"\x1b"], (4, 1), b"\0\x02"))
    got = decoded(tmp_path / "a.png")
    assert got[0, :, 0].tolist() == [0, 85, 170, 255]
    assert got[0, :, 3].tolist() == [255, 255, 0, 255]


def test_sixteen_bit_png_keeps_its_precision(tmp_path: Path) -> None:
    deep = np.random.default_rng(2).integers(0, 65536, (6, 5, 4), np.uint16)
    cv2.imwrite(str(tmp_path / "a.png"), deep)
    np.testing.assert_array_equal(decoded(tmp_path / "a.png"), deep[..., [2, 1, 0, 3]])
    clip = fire.open_clip(tmp_path / "a.png")
    np.testing.assert_allclose(clip.read(0), fire.light(deep[..., [2, 1, 0, 3]]), atol=2e-6)


@pytest.mark.parametrize("channels", [3, 4])
def test_sixteen_bit_tiff_keeps_its_precision(channels: int, tmp_path: Path) -> None:
    deep = np.random.default_rng(2).integers(0, 65536, (6, 5, channels), np.uint16)
    cv2.imwrite(str(tmp_path / "a.tif"), deep)
    order = [2, 1, 0, 3][:channels]
    np.testing.assert_array_equal(decoded(tmp_path / "a.tif"), deep[..., order])


def test_exr_light_is_taken_as_it_is_and_may_exceed_one(tmp_path: Path) -> None:
    pixels = np.full((8, 8, 4), 0.25, np.float32)
    pixels[2, 2] = (7, 5, 1, 0.5)
    (tmp_path / "a.exr").write_bytes(fire.exr_bytes(pixels))
    clip = fire.open_clip(tmp_path / "a.exr")
    np.testing.assert_allclose(clip.read(0), pixels)


def test_a_bad_colour_profile_prints_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    Image.fromarray(NOISE).save(tmp_path / "a.png", icc_profile=b"not a profile" * 20)
    np.testing.assert_array_equal(decoded(tmp_path / "a.png"), NOISE)
    assert capfd.readouterr().err == ""


def broken(path: Path, data: bytes) -> str:
    """The message that opening ``data`` gives."""
    path.write_bytes(data)
    with pytest.raises(SourceError) as caught:
        fire.all_frames(fire.open_clip(path))
    assert path.name in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("ending", ["png", "jpg", "webp", "bmp", "tga", "tiff", "gif"])
def test_a_truncated_image_is_refused_wherever_it_ends(
    ending: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"whole.{ending}"
    noise = np.random.default_rng(1).integers(0, 256, (40, 30, 3), np.uint8)
    options: dict[str, Any] = {"lossless": True} if ending == "webp" else {}
    Image.fromarray(noise).save(path, **options)
    data = path.read_bytes()
    # A TGA ends with a footer, a BMP with padding and a GIF with a trailer that no pixel needs.
    end = len(data) - {"tga": 30, "bmp": 3, "gif": 2}.get(ending, 1)
    for stop in [*range(0, end, max(1, end // 40)), end]:
        broken(tmp_path / f"cut.{ending}", data[:stop])
    assert capfd.readouterr().err == ""


def test_a_truncated_exr_is_refused_wherever_it_ends(tmp_path: Path) -> None:
    data = fire.exr_bytes(np.random.default_rng(1).random((40, 30, 4)).astype(np.float32))
    for stop in [*range(0, len(data), len(data) // 40), len(data) - 1]:
        broken(tmp_path / "cut.exr", data[:stop])


def test_a_png_without_its_end_is_refused(tmp_path: Path) -> None:
    Image.fromarray(NOISE).save(tmp_path / "a.png")
    data = (tmp_path / "a.png").read_bytes()
    assert "truncated" in broken(tmp_path / "b.png", data[:-12])
    assert "without IEND" in broken(tmp_path / "b.png", data[:-12])


def test_a_damaged_png_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    Image.fromarray(NOISE).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[data.index(b"IDAT") + 20] ^= 0xFF
    assert "IDAT chunk" in broken(tmp_path / "b.png", bytes(data))
    assert capfd.readouterr().err == ""


def test_text_named_png_is_refused(tmp_path: Path) -> None:
    message = broken(tmp_path / "notes.png", b"this is a shopping list")
    assert "not an image" in message
    assert "PNG" in message


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    assert "empty" in broken(tmp_path / "a.png", b"")


@pytest.mark.parametrize("size", [(30000, 30000), (20000, 10), (16000, 16000), (0, 5)])
def test_sizes_beyond_the_limits_are_refused_by_the_header_alone(
    size: tuple[int, int], tmp_path: Path
) -> None:
    message = broken(tmp_path / "huge.png", png(8, 6, [b""], size))
    assert f"{size[0]}x{size[1]}" in message
    if 0 not in size:
        assert "16384 px" in message
        assert "67.1 megapixels" in message


def test_a_huge_gif_and_webp_are_refused(tmp_path: Path) -> None:
    gif = b"GIF89a" + struct.pack("<HH", 60000, 60000) + bytes(3) + b"\x3b"
    assert "60000x60000" in broken(tmp_path / "a.gif", gif)
    side = (16_000_000).to_bytes(3, "little")
    webp = b"RIFF" + struct.pack("<I", 22) + b"WEBPVP8X" + struct.pack("<II", 10, 0) + side * 2
    assert "16000001x16000001" in broken(tmp_path / "a.webp", webp)


def test_a_folder_named_png_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "a.png").mkdir()
    with pytest.raises(SourceError, match="folder is empty"):
        fire.open_clip(tmp_path / "a.png")
    with pytest.raises(SourceError, match=r"a\.png: is a folder where an image was expected"):
        fire.open_clip(tmp_path)


def test_an_unreadable_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fire.write_folder(tmp_path / "f", fire.fires(2))

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(SourceError, match=r"fire0\.png: cannot be read \(Permission denied\)"):
        fire.open_clip(tmp_path / "f")


def test_an_animation_among_stills_is_refused(tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires(2))
    fire.write_animation(folder / "fire9.png", fire.fires(3), duration=40)
    with pytest.raises(SourceError, match=r"fire9\.png: is an animation where one still"):
        fire.all_frames(fire.open_clip(folder))


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_a_float_tiff_is_light_as_it_stands(tmp_path: Path, channels: int) -> None:
    light = np.random.default_rng(3).random((9, 7, channels)).astype(np.float32)
    light[0, 0, 0] = np.nan
    light[0, 1, 0] = 3.5  # brighter than white
    cv2.imwrite(str(tmp_path / "a.tiff"), light)
    picture = decoded(tmp_path / "a.tiff")
    shown = np.nan_to_num(light)
    shown = shown[..., [2, 1, 0, 3][:channels]] if channels > 1 else np.repeat(shown, 3, 2)
    if channels == 4:
        shown[..., 3] = np.minimum(shown[..., 3], 1)
    assert picture.dtype == np.float32
    np.testing.assert_array_equal(picture, shown)


def test_postscript_that_is_called_a_picture_starts_no_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pillow hands it to Ghostscript, if it is not told what it may be."""
    text = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 32 32\n%%EndComments\n%%EOF\n"
    head = b"\xc5\xd0\xd3\xc6" + struct.pack("<IIIIII", 30, len(text), 0, 0, 0, 0) + b"\xff\xff"
    path = tmp_path / "a.tga"
    path.write_bytes(head + text)
    started = list[object]()
    monkeypatch.setattr(subprocess, "Popen", lambda *line, **_: started.append(line))
    monkeypatch.setattr("PIL.EpsImagePlugin.gs_binary", "gs", raising=False)
    with pytest.raises(SourceError, match=r"a\.tga: broken TGA file"):
        decoded(path)
    assert not started


def test_a_tiff_whose_tiles_are_far_larger_than_its_picture_is_refused(tmp_path: Path) -> None:
    tags = {256: 32, 257: 32, 258: 8, 259: 8, 262: 1, 322: 40000, 323: 40000, 324: 8, 325: 1}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    (tmp_path / "a.tiff").write_bytes(
        b"II*\0\x08\0\0\0" + struct.pack("<H", len(tags)) + entries + bytes(4)
    )
    with pytest.raises(SourceError, match="its tiles are 40000x40000 for 32x32 pixels"):
        read_header(tmp_path / "a.tiff")
