"""Every form an OpenEXR file can have, and what comes of files that are not whole."""

import struct
import sys
from pathlib import Path
from typing import Any

import av
import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.clip import Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.sources import exr
from fire_atlas.sources.exr_header import Part
from fire_atlas.sources.images import decode, read_header
from tests.support import exr_files
from tests.support import synthetic_fire as fire

LIGHT = np.random.default_rng(7).random((9, 7, 4)).astype(np.float16)
TILED = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}


def decoded(path: Path) -> Picture:
    return decode(path, read_header(path))


def written(path: Path, channels: dict[str, Any], header: dict[str, Any] | None = None) -> Path:
    OpenEXR.File({**(header or {})}, channels).write(str(path))
    return path


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("header", [{}, TILED, {"compression": OpenEXR.PIZ_COMPRESSION}])
def test_lines_and_tiles_of_half_or_full_floats_are_read(
    kind: Any, header: dict[str, Any], tmp_path: Path
) -> None:
    path = written(tmp_path / "a.exr", {"RGBA": LIGHT.astype(kind)}, header)
    np.testing.assert_array_equal(decoded(path), LIGHT)


def smooth(height: int = 40, width: int = 36) -> Any:
    y, x = np.mgrid[:height, :width] / 40
    return np.dstack([0.5 + 0.5 * x, y, x * y, 1 - 0.5 * x]).astype(np.float16)


@pytest.mark.parametrize("name", ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24"])
def test_every_lossless_compression_is_read_as_ffmpeg_reads_it(name: str, tmp_path: Path) -> None:
    compression = getattr(OpenEXR, f"{name}_COMPRESSION")
    path = written(tmp_path / "a.exr", {"RGBA": smooth()}, {"compression": compression})
    np.testing.assert_array_equal(decoded(path), smooth())
    with av.open(str(path)) as container:
        frame: Any = next(container.decode(video=0))
    planes = {}
    for letter, plane in zip("GBRA", frame.planes, strict=True):
        rows = np.frombuffer(plane, np.float16 if "f16" in frame.format.name else np.float32)
        planes[letter] = rows.reshape(plane.height, -1)[:, : plane.width]
    np.testing.assert_array_equal(np.dstack([planes[letter] for letter in "RGBA"]), decoded(path))


@pytest.mark.parametrize("name", ["B44", "B44A", "DWAA", "DWAB"])
def test_every_lossy_compression_is_read_within_a_hundredth(name: str, tmp_path: Path) -> None:
    compression = getattr(OpenEXR, f"{name}_COMPRESSION")
    path = written(tmp_path / "a.exr", {"RGBA": smooth()}, {"compression": compression})
    np.testing.assert_allclose(decoded(path), smooth(), atol=0.01)


def test_of_tiles_in_several_sizes_the_full_one_is_read(tmp_path: Path) -> None:
    planes = {name: LIGHT[..., i].astype(np.float32) for i, name in enumerate("RGBA")}
    (tmp_path / "a.exr").write_bytes(exr_files.mipmap(planes, 4))
    np.testing.assert_array_equal(decoded(tmp_path / "a.exr"), LIGHT)


REC709 = (0.2126, 0.7152, 0.0722)


def luma_chroma(light: Any, weights: tuple[float, ...] = REC709) -> dict[str, Any]:
    """Y, and how much more red and blue there is: (R - Y) / Y and (B - Y) / Y."""
    luma = light[..., :3] @ np.array(weights)
    return {"Y": luma, "RY": light[..., 0] / luma - 1, "BY": light[..., 2] / luma - 1}


def test_luminance_and_chroma_become_colours(tmp_path: Path) -> None:
    light = (0.1 + LIGHT).astype(np.float64)
    channels = {name: plane.astype(np.float32) for name, plane in luma_chroma(light).items()}
    path = written(tmp_path / "a.exr", channels)
    np.testing.assert_allclose(decoded(path), light[..., :3], atol=1e-4)
    with_alpha = {**channels, "A": LIGHT[..., 3].copy()}
    np.testing.assert_array_equal(
        decoded(written(tmp_path / "b.exr", with_alpha))[..., 3], LIGHT[..., 3]
    )


@pytest.mark.parametrize(("left", "top"), [(0, 0), (-4, 2), (6, -8)])
def test_chroma_at_every_second_pixel_is_interpolated(left: int, top: int, tmp_path: Path) -> None:
    y, x = np.mgrid[top : top + 8, left : left + 10].astype(np.float32)
    luma, red, blue = 2 + x / 20, x / 40 - y / 50, y / 40
    planes = {"Y": (luma, 1), "RY": (red[::2, ::2], 2), "BY": (blue[::2, ::2], 2)}
    window = left, top, left + 9, top + 7
    (tmp_path / "a.exr").write_bytes(exr_files.lines(planes, window))
    wanted_red, wanted_blue = (red + 1) * luma, (blue + 1) * luma
    green = (luma - 0.2126 * wanted_red - 0.0722 * wanted_blue) / 0.7152
    # The last row and column have no sample behind them.
    np.testing.assert_allclose(
        decoded(tmp_path / "a.exr")[:-1, :-1],
        np.dstack([wanted_red, green, wanted_blue])[:-1, :-1],
        atol=2e-4,
    )


P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290)
P3_TO_REC709 = np.array([[1.2249, -0.2249, 0], [-0.0420, 1.0420, 0], [-0.0197, -0.0786, 1.0979]])
P3_LUMINANCE = (0.22897, 0.69174, 0.07929)


def test_stated_primaries_are_converted_with_a_note(tmp_path: Path) -> None:
    light = (0.4 + LIGHT / 2).astype(np.float32)
    path = written(tmp_path / "a.exr", {"RGBA": light}, {"chromaticities": P3})
    wanted = light.copy()
    wanted[..., :3] = np.maximum(light[..., :3] @ P3_TO_REC709.T, 0)
    np.testing.assert_allclose(decoded(path), wanted, atol=2e-3)
    assert "converted from the primaries that it states" in read_header(path).notes[0]


def test_chroma_has_the_weights_of_the_stated_primaries(tmp_path: Path) -> None:
    light = (0.4 + LIGHT / 2).astype(np.float64)
    channels = {k: v.astype(np.float32) for k, v in luma_chroma(light, P3_LUMINANCE).items()}
    path = written(tmp_path / "a.exr", channels, {"chromaticities": P3})
    np.testing.assert_allclose(decoded(path), light[..., :3] @ P3_TO_REC709.T, atol=2e-3)


def test_the_primaries_of_srgb_change_nothing(tmp_path: Path) -> None:
    srgb = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
    path = written(tmp_path / "a.exr", {"RGBA": LIGHT}, {"chromaticities": srgb})
    np.testing.assert_array_equal(decoded(path), LIGHT)
    assert read_header(path).notes == ()


def test_primaries_without_sense_are_named(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", {"RGBA": LIGHT}, {"chromaticities": (0.3,) * 8})
    np.testing.assert_array_equal(decoded(path), LIGHT)
    assert "its chromaticities make no sense" in read_header(path).notes[0]


@given(st.tuples(*4 * [st.integers(-20, 20)]), st.tuples(*4 * [st.integers(1, 9)]), st.booleans())
def test_windows_may_lie_anywhere(
    corners: tuple[int, ...], sizes: tuple[int, ...], far: bool
) -> None:
    left, top, from_x, from_y = (place * (9 if far else 1) for place in corners)
    width, height, shown_width, shown_height = sizes
    data = Window(left, top, left + width, top + height)
    display = Window(from_x, from_y, from_x + shown_width, from_y + shown_height)
    part = Part("", "", False, (), data, display, None)
    stored = np.random.default_rng(1).random((height, width, 3)).astype(np.float32)
    shown = exr._in_display(stored, part)
    for y, x in np.ndindex(shown_height, shown_width):
        row, column = from_y + y - top, from_x + x - left
        inside = 0 <= row < height and 0 <= column < width
        np.testing.assert_array_equal(shown[y, x], stored[row, column] if inside else 0)


def test_a_long_header_is_read_whole(tmp_path: Path) -> None:
    planes = {name: (LIGHT[..., i].astype(np.float32), 1) for i, name in enumerate("RGB")}
    manifest = {"a_manifest": ("string", b"x" * 300_000)}
    (tmp_path / "a.exr").write_bytes(exr_files.lines(planes, (0, 0, 6, 8), attributes=manifest))
    np.testing.assert_array_equal(decoded(tmp_path / "a.exr"), LIGHT[..., :3])


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"data": (0, 0, 99, 99)}, "data window is far larger"),
        ({"data": (0, 0, -1, 8)}, "dataWindow is empty"),
        ({"display": (5, 5, 4, 4)}, "displayWindow is empty"),
        ({"display": (0, 0, 20000, 20000), "data": (0, 0, 6, 8)}, "20001x20001 is too large"),
        ({"steps": {"R": 0, "G": 1, "B": 1}}, "list of channels is damaged"),
        ({"display": (0, 0, 8000, 8000), "data": (0, 0, 8000, 8000),
          "steps": dict.fromkeys([*"RGB", *(f"glow.{i}" for i in range(27))], 1)},
         r"all its channels are 7\.2 GiB, and at most 4 are decoded"),
    ],
)  # fmt: skip
def test_impossible_sizes_are_refused_by_the_header_alone(
    header: dict[str, Any], message: str, tmp_path: Path
) -> None:
    whole = {"steps": dict.fromkeys("RGB", 1), "data": (0, 0, 6, 8), "display": (0, 0, 6, 8)}
    (tmp_path / "a.exr").write_bytes(exr_files.header(**{**whole, **header}, attributes={}))
    with pytest.raises(SourceError, match=rf"a\.exr.*{message}"):
        read_header(tmp_path / "a.exr")


def test_a_damaged_header_is_refused(tmp_path: Path) -> None:
    good = exr_files.header(dict.fromkeys("RGB", 1), (0, 0, 6, 8), (0, 0, 6, 8), {})
    size = good.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0")
    cases = {
        "negative": good[:size] + struct.pack("<i", -5) + good[size + 4 :],
        "dataWindow is damaged": good[:size] + struct.pack("<i", 15) + good[size + 5 :],
        "does not begin as an EXR of version 2": good[:4] + b"\x03" + good[5:],
        "lacks channels": good.replace(b"channels\0chlist", b"chandels\0chlist"),
        "a name in its header does not end": good[:8] + b"x" * 300,
    }
    for message, data in cases.items():
        (tmp_path / "a.exr").write_bytes(data)
        with pytest.raises(SourceError, match=rf"a\.exr.*{message}"):
            read_header(tmp_path / "a.exr")


def test_whole_numbers_are_light_too(tmp_path: Path) -> None:
    numbers = np.arange(24, dtype=np.uint32).reshape(2, 4, 3)
    np.testing.assert_array_equal(
        decoded(written(tmp_path / "a.exr", {"RGB": numbers})), numbers.astype(np.float32)
    )


def test_channels_of_different_numbers_are_one_picture(tmp_path: Path) -> None:
    channels = {"RGB": LIGHT[..., :3].copy(), "A": LIGHT[..., 3].astype(np.float32)}
    np.testing.assert_array_equal(decoded(written(tmp_path / "a.exr", channels)), LIGHT)


def test_grey_is_read_with_and_without_alpha(tmp_path: Path) -> None:
    grey, alpha = LIGHT[..., 0].copy(), LIGHT[..., 3].copy()
    plain = decoded(written(tmp_path / "a.exr", {"Y": grey}))
    np.testing.assert_array_equal(plain, np.dstack([grey] * 3))
    clear = decoded(written(tmp_path / "b.exr", {"Y": grey, "A": alpha}))
    np.testing.assert_array_equal(clear, np.dstack([grey] * 3 + [alpha]))


def test_the_first_part_that_holds_colour_is_read(tmp_path: Path) -> None:
    depth = OpenEXR.Part({}, {"Z": np.ones(LIGHT.shape[:2], np.float32)}, "depth")
    beauty = OpenEXR.Part({}, {"RGBA": LIGHT}, "beauty")
    OpenEXR.File([depth, beauty]).write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(decoded(tmp_path / "a.exr"), LIGHT)


def test_a_file_without_colour_names_what_it_holds(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", {"Z": LIGHT[..., 0].copy()})
    with pytest.raises(SourceError, match=r"a\.exr.*no channels R, G and B, nor Y, but Z;"):
        read_header(path)


@pytest.mark.parametrize("left", [-3, 2])
def test_the_frame_is_the_display_window_wherever_data_lie(left: int, tmp_path: Path) -> None:
    data = np.array([left, 1], np.int32), np.array([left + 6, 9], np.int32)
    display = np.array([0, 0], np.int32), np.array([10, 7], np.int32)
    header = {"dataWindow": data, "displayWindow": display}
    picture = decoded(written(tmp_path / "a.exr", {"RGBA": LIGHT}, header))
    wide = np.zeros((20, 30, 4), np.float32)
    wide[6:15, 10 + left : 17 + left] = LIGHT
    np.testing.assert_array_equal(picture, wide[5:13, 10:21])


@pytest.mark.parametrize("header", [{}, TILED], ids=["lines", "tiles"])
def test_a_truncated_file_is_refused_wherever_it_ends(
    header: dict[str, Any], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    noise = np.random.default_rng(1).random((40, 30, 4)).astype(np.float16)
    data = written(tmp_path / "whole.exr", {"RGBA": noise}, header).read_bytes()
    for stop in [*range(0, len(data), len(data) // 40), len(data) - 1]:
        (tmp_path / "cut.exr").write_bytes(data[:stop])
        with pytest.raises(SourceError, match=r"cut\.exr"):
            decoded(tmp_path / "cut.exr")
    assert capfd.readouterr() == ("", "")


def test_without_the_wheel_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "a.exr", {"RGBA": LIGHT})
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(SourceError, match=r"a\.exr.*pip install 'fire-atlas\[exr\]'"):
        fire.open_clip(path)
