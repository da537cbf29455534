"""The matte: which one is chosen, and that fire on black comes back exactly."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import to_light, with_alpha
from fire_atlas.core.pixels import Pixels, linear_to_srgb, srgb_to_linear, unpremultiply
from fire_atlas.sources import matte
from tests.support import synthetic_fire as fire

BYTES = arrays.arrays(np.uint8, (3, 4, 3), elements=st.integers(0, 255))


def over_black(pixels: Pixels, blend_space: str) -> NDArray[Any]:
    """What a client shows, sRGB 0..255, that blends straight colours in ``blend_space``."""
    alpha = pixels[..., 3:]
    if blend_space == "srgb":
        return linear_to_srgb(unpremultiply(pixels)) * alpha * 255
    return linear_to_srgb(unpremultiply(pixels) * alpha) * 255


@given(BYTES)
@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_fire_on_black_comes_back_over_black(
    depth: type, blend_space: str, picture: NDArray[Any]
) -> None:
    stored: NDArray[Any] = picture.astype(depth) * (257 if depth is np.uint16 else 1)
    pixels = matte.apply("luminance", stored, blend_space)
    assert np.abs(over_black(pixels, blend_space) - picture).max() <= 2.01
    kept = picture.max(axis=2) > 2
    assert np.abs(over_black(pixels, blend_space) - picture)[kept].max(initial=0) < 0.1


@given(BYTES)
@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
def test_noise_near_black_covers_nothing(blend_space: str, picture: NDArray[Any]) -> None:
    noise = picture.max(axis=2) <= 2
    for pixels in (
        matte.apply("luminance", picture, blend_space),
        matte.apply("luminance", with_alpha(picture), blend_space),
        matte.luminance_of_light(to_light(picture), blend_space),
    ):
        assert (pixels[noise] == 0).all()
        assert (pixels[~noise][..., 3] > 0).all()


@given(BYTES)
def test_coverage_is_the_brightest_channel(picture: NDArray[Any]) -> None:
    strong = np.maximum(picture, 3)
    coded = matte.apply("luminance", strong, "srgb")
    np.testing.assert_allclose(coded[..., 3], strong.max(axis=2) / 255, atol=1e-6)
    light = matte.apply("luminance", strong, "linear")
    np.testing.assert_allclose(
        light[..., 3], srgb_to_linear(strong / 255).max(axis=2), rtol=1e-3, atol=1e-6
    )


def write(folder: Path, frames: list[NDArray[Any]]) -> Path:
    folder.mkdir()
    for i, frame in enumerate(frames):
        Image.fromarray(frame.astype(np.uint8)).save(folder / f"{i}.png")
    return folder


def on_black(frames: list[fire.Rgba]) -> list[NDArray[Any]]:
    return [frame[..., :3] * (frame[..., 3:] / 255.0) for frame in frames]


def bricks(size: tuple[int, int] = (120, 160)) -> NDArray[Any]:
    """A dim wall: grey-brown stones of 16x10 px, each of its own brightness, with dark joints."""
    rng = np.random.default_rng(8)
    stones = rng.uniform(14, 70, (size[0] // 10, size[1] // 16))
    wall = np.kron(stones, np.ones((10, 16)))
    wall[::10] = wall[:, ::16] = 4
    lit: NDArray[Any] = wall[..., None] * np.array([1, 0.7, 0.5])
    return lit


def test_transparent_frames_keep_their_alpha(tmp_path: Path) -> None:
    clip = fire.open_clip(fire.write_folder(tmp_path / "f", fire.fires()))
    assert clip.matte == "alpha"
    assert "transparent" in clip.matte_reason


def test_fire_on_black_becomes_a_luminance_matte(tmp_path: Path) -> None:
    clip = fire.open_clip(write(tmp_path / "f", on_black(fire.fires())))
    assert clip.matte == "luminance"
    assert "% of the border is darker than 16/255: fire on black" in clip.matte_reason


def test_an_opaque_alpha_channel_is_no_matte(tmp_path: Path) -> None:
    frames = [np.dstack([f, np.full(f.shape[:2], 255)]) for f in on_black(fire.fires())]
    assert fire.open_clip(write(tmp_path / "f", frames)).matte == "luminance"


def test_a_black_clip_is_empty(tmp_path: Path) -> None:
    clip = fire.open_clip(write(tmp_path / "f", [np.zeros((9, 9, 3))] * 3))
    assert clip.matte == "luminance"
    assert not clip.read(0).any()


def test_a_white_clip_is_a_scene(tmp_path: Path) -> None:
    clip = fire.open_clip(write(tmp_path / "f", [np.full((9, 9, 3), 255)] * 3))
    assert clip.matte == "none"
    assert (clip.read(2) == 1).all()


def test_a_daylight_scene_stays_a_scene(tmp_path: Path) -> None:
    y = np.linspace(0, 1, 120)[:, None, None]
    sky = np.broadcast_to((1 - y) * [120, 170, 240] + y * [70, 110, 50], (120, 160, 3))
    clip = fire.open_clip(write(tmp_path / "f", [sky] * 3))
    assert clip.matte == "none"
    assert "opaque scene" in clip.matte_reason


def test_a_letterboxed_daylight_scene_stays_a_scene(tmp_path: Path) -> None:
    sky = np.full((120, 160, 3), (120.0, 170.0, 240.0))
    sky[:20] = sky[-20:] = 0
    assert fire.open_clip(write(tmp_path / "f", [sky] * 3)).matte == "none"


def test_a_dark_brick_wall_stays_a_scene(tmp_path: Path) -> None:
    wall = bricks()
    wall[:30] = 3
    frames = [wall.copy() for _ in range(4)]
    for i, frame in enumerate(frames):
        frame[40:90, 50 + 5 * i : 90 + 5 * i] = (255, 160, 30)
    assert fire.open_clip(write(tmp_path / "f", frames)).matte == "none"


def test_fire_that_fills_the_bottom_edge_is_still_fire_on_black(tmp_path: Path) -> None:
    y, x = np.mgrid[:120, :160]
    frames = []
    for i in range(5):
        top = 70 + 25 * np.sin(x / 9 + 2 * i) + 10 * np.sin(x / 4 - 3 * i)
        glow = np.clip((y - top) / 40, 0, 1)
        frames.append(np.dstack([255 * glow, 190 * glow**2, 60 * glow**4]))
    assert fire.open_clip(write(tmp_path / "f", frames)).matte == "luminance"


@pytest.mark.parametrize("forced", ["luminance", "none"])
def test_a_forced_matte_is_used(forced: str, tmp_path: Path) -> None:
    clip = fire.open_clip(fire.write_folder(tmp_path / "f", fire.fires()), matte=forced)
    assert (clip.matte, clip.matte_reason) == (forced, "the recipe asks for it")
    wanted = fire.light(fire.fires()[3])
    got = clip.read(3)
    if forced == "none":
        assert (got[..., 3] == 1).all()
        np.testing.assert_allclose(got[..., :3], wanted[..., :3], atol=1e-6)
    else:
        shown = over_black(got, "srgb")
        assert np.abs(shown - linear_to_srgb(wanted[..., :3]) * 255).max() <= 2.1


def test_asking_for_alpha_where_there_is_none_is_refused(tmp_path: Path) -> None:
    folder = write(tmp_path / "f", on_black(fire.fires()))
    with pytest.raises(SourceError, match=r"no transparent pixel; use matte: luminance"):
        fire.open_clip(folder, matte="alpha")


def test_a_resized_luminance_matte_is_exact_for_the_new_pixels(tmp_path: Path) -> None:
    folder = write(tmp_path / "f", on_black(fire.fires()))
    opaque = fire.open_clip(folder, matte="none", height=20).read(2)
    matted = fire.open_clip(folder, height=20).read(2)
    wanted = linear_to_srgb(opaque[..., :3]) * 255
    assert np.abs(over_black(matted, "srgb") - wanted).max() <= 2.1
