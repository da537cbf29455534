"""Pages are sound PNG files, whoever reads them and however many workers wrote them."""

import io
import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png

SIZES = [(1, 1), (7, 1), (1, 131), (33, 63), (33, 64), (33, 65), (50, 300)]
"""(width, height): odd ones, and around the height of a band."""


def noisy_flame(width: int, height: int) -> Bytes:
    """A picture with flat, smooth and noisy parts."""
    rng = np.random.default_rng(width * 1000 + height)
    image = np.cumsum(rng.integers(-2, 3, (height, width, 4)), axis=0).astype(np.uint8)
    image[:, : width // 2] = 0
    return image


def png_of(image: Bytes, jobs: int = 1) -> bytes:
    file = io.BytesIO()
    with Workers(jobs) as workers:
        write_png(file, image, workers)
    return file.getvalue()


def chunks_of(png: bytes) -> list[tuple[bytes, bytes]]:
    """Walk the file as strictly as the specification allows."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, []
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        kind, data = png[at + 4 : at + 8], png[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", png, at + 8 + length) == (zlib.crc32(kind + data),)
        chunks.append((kind, data))
        at += 12 + length
    assert at == len(png)
    return chunks


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_pillow_and_opencv_read_back_every_byte(width: int, height: int) -> None:
    image = noisy_flame(width, height)
    png = png_of(image)
    with Image.open(io.BytesIO(png)) as opened:
        np.testing.assert_array_equal(np.asarray(opened), image)
    decoded = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    np.testing.assert_array_equal(decoded[..., [2, 1, 0, 3]], image)


@given(width=st.integers(1, 20), height=st.integers(1, 200), jobs=st.integers(2, 3))
def test_the_number_of_workers_changes_no_byte(width: int, height: int, jobs: int) -> None:
    image = noisy_flame(width, height)
    assert png_of(image, 1) == png_of(image, jobs)


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_every_chunk_and_checksum_is_right(width: int, height: int) -> None:
    chunks = chunks_of(png_of(noisy_flame(width, height)))
    kinds = [kind for kind, _ in chunks]
    assert kinds[:2] == [b"IHDR", b"sRGB"]
    assert set(kinds[2:-1]) == {b"IDAT"}
    assert kinds[-1] == b"IEND"
    stream = b"".join(data for kind, data in chunks if kind == b"IDAT")
    inflate = zlib.decompressobj()
    assert len(inflate.decompress(stream)) == height * (1 + 4 * width)
    assert inflate.eof
    assert not inflate.unused_data


def test_a_flame_deflates_about_as_well_as_by_the_slowest_of_opencv() -> None:
    across, down = np.meshgrid(np.linspace(-1, 1, 256), np.linspace(-1, 1, 256))
    glow = np.clip(1 - np.hypot(across, down), 0, 1)
    image = np.dstack([np.rint(255 * glow**power).astype(np.uint8) for power in (0.5, 1, 2, 0.3)])
    _, slow = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    assert len(png_of(image)) <= 1.5 * len(slow)
