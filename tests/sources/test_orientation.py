"""Pictures that are stored on their side: every format, all eight ways, as Pillow turns them."""

import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

from fire_atlas.sources.images import decode, read_header
from fire_atlas.sources.orientation import IN_WORDS, marked_upright, orientation_of, turned
from tests.support import synthetic_fire as fire

NOISE = np.random.default_rng(5).integers(0, 256, (9, 7, 4), np.uint8)
WAYS = range(1, 9)


def exif(orientation: int, order: str = "<", kind: int = 3) -> bytes:
    """EXIF data with two tags."""
    head = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HI", 42, 8)
    value = struct.pack(f"{order}H2x" if kind == 3 else f"{order}I", orientation)
    return (
        head + struct.pack(f"{order}H", 2) + struct.pack(f"{order}HHI4x", 0x010F, 2, 1)
        + struct.pack(f"{order}HHI", 0x0112, kind, 1) + value + bytes(4)
    )  # fmt: skip


def upright(stored: Any, orientation: int) -> Any:
    """The picture as Pillow turns it."""
    image = Image.fromarray(stored)
    image.getexif()[0x0112] = orientation
    return np.asarray(ImageOps.exif_transpose(image))


def shown(path: Path) -> Any:
    """The picture, whose size its header knows."""
    return decode(path, read_header(path))


@pytest.mark.parametrize("orientation", WAYS)
@pytest.mark.parametrize("ending", ["png", "webp", "tif", "jpg"])
def test_every_format_is_turned_as_pillow_turns_it(
    ending: str, orientation: int, tmp_path: Path
) -> None:
    image = Image.fromarray(NOISE if ending != "jpg" else NOISE[..., :3].copy())
    tags = Image.Exif()
    tags[0x0112] = orientation
    options: dict[str, Any] = {"lossless": True, "exact": True} if ending == "webp" else {}
    image.save(tmp_path / f"plain.{ending}", **options)
    image.save(tmp_path / f"a.{ending}", exif=tags, **options)
    wanted = upright(shown(tmp_path / f"plain.{ending}"), orientation)
    np.testing.assert_array_equal(shown(tmp_path / f"a.{ending}"), wanted)
    said = read_header(tmp_path / f"a.{ending}").notes
    turn = IN_WORDS.get(orientation)
    assert said == ((f"it is shown {turn}, as it states",) if turn else ())
    clip = fire.open_clip(tmp_path / f"a.{ending}", matte="none")
    assert clip.read(0).shape[:2] == (clip.height, clip.width) == wanted.shape[:2]


def tiff_with(path: Path, orientation: int) -> Path:
    """The TIFF with a new directory, which states an orientation."""
    data = bytearray(path.read_bytes())
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, at)
    entries = [bytes(data[at + 2 + 12 * i :][:12]) for i in range(count)]
    entries = [e for e in entries if struct.unpack_from(f"{order}H", e)[0] != 0x0112]
    entries.append(struct.pack(f"{order}HHIHH", 0x0112, 3, 1, orientation, 0))
    entries.sort(key=lambda entry: struct.unpack_from(f"{order}H", entry))
    directory = struct.pack(f"{order}H", len(entries)) + b"".join(entries) + bytes(4)
    data[4:8] = struct.pack(f"{order}I", len(data))
    path.write_bytes(bytes(data) + directory)
    return path


@pytest.mark.parametrize("orientation", WAYS)
@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_deep_tiffs_are_turned_too(dtype: Any, orientation: int, tmp_path: Path) -> None:
    deep = np.random.default_rng(2).integers(0, 256, (6, 5, 3)).astype(dtype)
    assert cv2.imwrite(str(tmp_path / "a.tif"), deep[..., ::-1])
    path = tiff_with(tmp_path / "a.tif", orientation)
    wanted = upright(deep.astype(np.uint8), orientation).astype(dtype)
    np.testing.assert_array_equal(shown(path), wanted)


@pytest.mark.parametrize("orientation", WAYS)
@pytest.mark.parametrize("ending", ["png", "webp"])
def test_all_frames_of_an_animation_are_turned(
    ending: str, orientation: int, tmp_path: Path
) -> None:
    tags = Image.Exif()
    tags[0x0112] = orientation
    options: dict[str, Any] = {"duration": 50}
    options |= {"lossless": True, "exact": True} if ending == "webp" else {}
    frames = fire.fires(3, 30, 24)
    plain = fire.write_animation(tmp_path / f"plain.{ending}", frames, **options)
    path = fire.write_animation(tmp_path / f"a.{ending}", frames, exif=tags, **options)
    assert path.stat().st_size > plain.stat().st_size
    for before, after in zip(
        fire.all_frames(fire.open_clip(plain)), fire.all_frames(fire.open_clip(path)), strict=True
    ):
        np.testing.assert_array_equal(after, turned(before, orientation))


def test_exif_after_the_pixels_of_a_png_counts(tmp_path: Path) -> None:
    Image.fromarray(NOISE).save(tmp_path / "a.png", exif=exif(6))
    data = (tmp_path / "a.png").read_bytes()
    chunk = data[data.index(b"eXIf") - 4 :]
    chunk = chunk[: 12 + struct.unpack(">I", chunk[:4])[0]]
    moved = data.replace(chunk, b"").replace(data[-12:], chunk + data[-12:])
    (tmp_path / "a.png").write_bytes(moved)
    assert moved.index(b"IDAT") < moved.index(b"eXIf")
    np.testing.assert_array_equal(shown(tmp_path / "a.png"), upright(NOISE, 6))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [3, 4])
@pytest.mark.parametrize("prefix", [b"", b"Exif\0\0"])
def test_the_tag_is_found_in_every_spelling(order: str, kind: int, prefix: bytes) -> None:
    for orientation in WAYS:
        data = exif(orientation, order, kind)
        assert orientation_of(prefix + data) == orientation
        assert orientation_of(marked_upright(data)) == 1


def test_damaged_exif_states_nothing(tmp_path: Path) -> None:
    whole = exif(6)
    for stop in range(len(whole) - 14):
        assert orientation_of(whole[:stop]) == 1
        assert marked_upright(whole[:stop]) == whole[:stop]
    assert orientation_of(b"no EXIF at all, but text") == 1
    assert [orientation_of(exif(wrong)) for wrong in (0, 9, 65535)] == [1, 1, 1]
    Image.fromarray(NOISE).save(tmp_path / "a.png", exif=whole[:20])
    np.testing.assert_array_equal(shown(tmp_path / "a.png"), NOISE)
