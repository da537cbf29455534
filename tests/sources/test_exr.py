"""Every form an OpenEXR file can have, and what comes of files that are not whole."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.sources.images import decode, read_header
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
    with pytest.raises(SourceError, match=r"a\.exr.*no channels R, G and B, nor Y.*'Z'"):
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
