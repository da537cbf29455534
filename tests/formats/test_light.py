"""The lamp of a fire: known light gives known figures, and a build writes those of its frames."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.formats.tracks.light import write_light

WIDTH, HEIGHT = 40, 30


def spot(
    x: int, y: int, side: int, rgb: tuple[float, float, float], cover: float = 1
) -> NDArray[np.float32]:
    """A square of light, its top-left corner at (x, y)."""
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pixels[y : y + side, x : x + side] = (*rgb, cover)
    return pixels


def stated(*frames: NDArray[np.float32]) -> Any:
    light = ClipLight(24, WIDTH, HEIGHT, True, tuple(map(FrameLight.of, frames)))
    file = write_light("fire", light)
    assert (file.name, file.role) == ("fire.light.json", "light")
    return json.loads(file.data)


def test_the_file_tells_what_it_is() -> None:
    document = stated(spot(0, 0, 2, (1, 0, 0)), spot(0, 0, 2, (1, 0, 0)))
    frames, mean = document.pop("frames"), document.pop("mean")
    assert document == {
        "format": "fire-atlas/light",
        "version": 1,
        "name": "fire",
        "fps": 24,
        "frame_count": 2,
        "loop": True,
        "size": [WIDTH, HEIGHT],
        "space": "source pixels, x right, y down, (0,0) top-left corner",
        "units": "px, s; linear rgb, brightest channel 1; intensity 1 is the mean",
    }
    assert list(frames[1]) == ["i", "t", "intensity", "r", "g", "b", "x", "y", "radius"]
    assert [(frame["i"], frame["t"]) for frame in frames] == [(0, 0.0), (1, 0.041667)]
    assert mean["light"] == pytest.approx(4 / (WIDTH * HEIGHT), abs=1e-6)


def test_a_square_of_light_has_its_centre_colour_and_spread() -> None:
    (frame,) = stated(spot(10, 6, 8, (0.5, 0.25, 0.1), 0.7))["frames"]
    assert (frame["x"], frame["y"]) == (14, 10)
    assert (frame["r"], frame["g"], frame["b"]) == (1, 0.5, 0.2)
    assert frame["intensity"] == 1
    # Pixel centres of an 8 px square spread by (8² − 1)/12 along each axis.
    assert frame["radius"] == pytest.approx((2 * 63 / 12) ** 0.5, abs=0.01)


def test_intensity_times_colour_is_in_proportion_to_the_light() -> None:
    colours = [(4.0, 2.0, 0.5), (0.3, 0.6, 0.1), (1.0, 1.0, 1.0)]
    frames = stated(*(spot(3 * i, 2, 5, rgb) for i, rgb in enumerate(colours)))["frames"]
    lamp = np.array([[f["intensity"] * f[c] for c in "rgb"] for f in frames])
    assert lamp / lamp[0, 0] == pytest.approx(np.array(colours) / 4, abs=1e-3)
    # 1 is the brightest channel of the mean frame: red, (4 + 0.3 + 1) / 3.
    assert lamp[0, 0] == pytest.approx(4 / (5.3 / 3), abs=1e-3)


spots = st.builds(
    spot,
    st.integers(0, WIDTH - 9),
    st.integers(0, HEIGHT - 9),
    st.integers(3, 9),
    st.tuples(st.floats(0.5, 9), st.floats(0, 9), st.floats(0, 9)),
)


@given(frames=st.lists(spots, min_size=1, max_size=5))
def test_the_light_of_every_frame_can_be_read_from_the_file(
    frames: list[NDArray[np.float32]],
) -> None:
    document = stated(*frames)
    brightest = document["mean"]["light"] * WIDTH * HEIGHT
    for frame, pixels in zip(document["frames"], frames, strict=True):
        light = np.array([frame[c] for c in "rgb"]) * frame["intensity"] * brightest
        assert light == pytest.approx(pixels[..., :3].sum(axis=(0, 1)), rel=1e-2, abs=0.1)
        y, x = np.nonzero(pixels[..., 0])
        assert (frame["x"], frame["y"]) == pytest.approx((x.mean() + 0.5, y.mean() + 0.5), abs=6e-3)


def test_light_of_frames_adds_up() -> None:
    flame, flakes = spot(0, 0, 9, (0.5, 0.2, 0.1)), spot(20, 8, 3, (9, 5, 0))
    both, sums = FrameLight.of(flame + flakes), FrameLight.of(flame) + FrameLight.of(flakes)
    assert sums.rgb == pytest.approx(both.rgb)
    assert (sums.x, sums.y, sums.square) == pytest.approx((both.x, both.y, both.square))


def test_a_dark_frame_is_like_the_mean_without_its_light() -> None:
    document = stated(spot(4, 6, 4, (1, 0.5, 0)), np.zeros((HEIGHT, WIDTH, 4), np.float32))
    bright, dark = document["frames"]
    assert (bright["intensity"], dark["intensity"]) == (2, 0)
    keys = ("r", "g", "b", "x", "y", "radius")
    assert [dark[key] for key in keys] == [bright[key] for key in keys]


def test_a_clip_without_light_has_a_lamp_that_is_off() -> None:
    (frame,) = stated(np.zeros((HEIGHT, WIDTH, 4), np.float32))["frames"]
    assert frame["intensity"] == 0
    assert (frame["x"], frame["y"], frame["radius"]) == (WIDTH / 2, HEIGHT / 2, 0)


def built(folder: Path, **keys: Any) -> Path:
    recipe = folder / "fire.yaml"
    recipe.write_text(json.dumps({"source": {"path": "clip"}, "tracks": ["light"], **keys}))
    assert main(["build", str(recipe), "-q"]) == 0
    return folder / "build"


@pytest.fixture
def images(tmp_path: Path) -> list[NDArray[np.uint8]]:
    """A small flame that sways, as straight RGBA in ``clip``."""
    (tmp_path / "clip").mkdir()
    y, x = np.mgrid[0:32, 0:24]
    made = []
    for i in range(6):
        heat = np.clip(1 - np.hypot((x - 10 - i % 3) / 7, (y - 24) / (14 + i)), 0, 1)
        rgba = np.stack([255 * heat**0.3, 255 * heat, 120 * heat**2, 255 * heat**0.5], axis=-1)
        made.append(rgba.astype(np.uint8))
        Image.fromarray(made[-1]).save(tmp_path / "clip" / f"{i:04}.png")
    return made


def test_a_recipe_that_only_packs_tells_the_light_of_its_images(
    tmp_path: Path, images: list[NDArray[np.uint8]]
) -> None:
    build = built(tmp_path, flakes="none", motion_blur="none")
    frames = json.loads((build / "fire.light.json").read_bytes())["frames"]
    light = [srgb_to_linear(im[..., :3] / 255) * (im[..., 3:] / 255) for im in images]
    sums = np.array([each.sum(axis=(0, 1)) for each in light])
    lamp = np.array([[f["intensity"] * f[c] for c in "rgb"] for f in frames])
    assert lamp == pytest.approx(sums / sums.mean(axis=0).max(), rel=2e-3)


def test_flakes_add_the_light_that_film_shows_of_them(
    tmp_path: Path, images: list[NDArray[np.uint8]]
) -> None:
    def light_of(**flakes: Any) -> float:
        build = built(tmp_path, flakes={"rate": 900, "bursts": 0, "alpha": 0.01, **flakes})
        return float(json.loads((build / "fire.light.json").read_bytes())["mean"]["light"])

    without, dark = light_of(bake=False), light_of(intensity=0)
    dim, bright = light_of(intensity=12), light_of(intensity=120)
    assert dark == without
    assert without < 0.99 * dim < dim < bright < without + 10 * (dim - without)
