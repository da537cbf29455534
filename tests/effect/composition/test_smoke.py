"""Smoke as a layer of its own: it and the fire over it show what the picture shows."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Pixels, as_plane, linear_to_srgb
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.composition.smoke import Cover, Smoke
from fire_atlas.sources.images import decode_bytes
from tests.support.clips import open_clip, real

SPACES = ("srgb", "linear")
WALLS = (0.0, 0.4, 1.0)


def shown(pixels: Pixels, wall: NDArray[np.float64], space: str) -> NDArray[np.float64]:
    """What a client shows of pixels over a wall, by its blend formula in ``space``."""
    cover = pixels[..., 3:].astype(np.float64)
    light = pixels[..., :3].astype(np.float64)
    if space == "srgb":
        light = linear_to_srgb(light / np.maximum(cover, 1e-9)) * cover
    return np.asarray(light + (1 - cover) * wall)


def parted(pixels: Pixels, space: str, cover: Cover = "full") -> tuple[Pixels, Pixels]:
    smoke = Smoke.of(pixels, space)
    return smoke.taken_from(pixels, cover, space), smoke.pixels(space)


def off(pixels: Pixels, space: str) -> float:
    """The largest error of fire over smoke over walls."""
    fire, smoke = parted(pixels, space)
    assert (fire[..., :3].max(axis=2) <= fire[..., 3] + 1e-5).all(), "a page can hold the fire"
    assert np.ptp(smoke[..., :3], axis=2).max() < 1e-6, "smoke is grey"
    return max(
        float(np.abs(
            shown(pixels, np.array(wall), space)
            - shown(fire, shown(smoke, np.array(wall), space), space)
        ).max())
        for wall in WALLS
    )  # fmt: skip


def frame(path: Path) -> Pixels:
    return as_light(decode_bytes(path.read_bytes(), "png"))


@pytest.mark.parametrize("space", SPACES)
def test_an_explosion_is_its_fire_over_its_smoke(space: str) -> None:
    frames = sorted((shipped("samples") / "explosion").glob("*.png"))
    assert max(off(frame(path), space) for path in frames[2::6]) < 1 / 255


@pytest.mark.parametrize(
    "clip", [real("cartoon_wesnoth_fireball_impact"), real("sim_unity_flame02")]
)
def test_real_clips_are_their_fire_over_their_smoke(clip: str) -> None:
    seen = open_clip(clip)
    assert max(off(seen.read(i), "srgb") for i in range(2, seen.count, 5)) < 1 / 255


@given(
    arrays(np.float32, (8, 3), elements=st.floats(0, 1, width=32)),
    arrays(np.float32, 8, elements=st.floats(0, 1, width=32)),
    st.sampled_from(SPACES),
)
def test_any_picture_is_its_fire_over_its_smoke(
    colour: NDArray[np.float32], cover: NDArray[np.float32], space: str
) -> None:
    pixels = as_plane(np.dstack([colour[None] * cover[None, :, None], cover[None]]))
    assert off(pixels, space) < 1.5 / 255


@pytest.mark.parametrize("space", SPACES)
def test_dull_grey_is_smoke_and_saturated_light_is_fire(space: str) -> None:
    cover = np.linspace(0.1, 0.9, 9, dtype=np.float32)[None]
    grey, orange = (
        as_plane(np.dstack([np.multiply.outer(cover, np.array(c, np.float32)), cover]))
        for c in ((0.1, 0.1, 0.1), (1.0, 0.25, 0.0))
    )
    fire, smoke = parted(grey, space)
    assert np.allclose(smoke, grey, atol=1e-4) and fire.max() < 1e-4
    fire, smoke = parted(orange, space)
    assert np.allclose(fire, orange, atol=1e-4) and smoke.max() < 1e-3


@pytest.mark.parametrize("colour", [(0, 0, 0), (0.010, 0.004, 0.001), (0.014, 0.0, 0.0)], ids=str)
def test_smoke_that_a_flame_lights_hides_whatever_its_hue(
    colour: tuple[float, float, float],
) -> None:
    smoke = np.zeros((64, 64, 4), np.float32)
    smoke[..., :3] = np.array(colour, np.float32) * 0.4
    smoke[..., 3] = 0.4
    hidden = Smoke.of(smoke, "srgb").coverage[8:-8, 8:-8]
    assert hidden.min() > 0.32, "some of it is its own light"
    flame = smoke.copy()
    flame[..., :3] = np.array([0.5, 0.05, 0.0], np.float32) * 0.4
    assert Smoke.of(flame, "srgb").coverage[8:-8, 8:-8].max() < 0.01, "red that glows is a flame"


def test_black_smoke_keeps_back_what_its_optical_depth_states() -> None:
    depth = np.linspace(0, 5, 50, dtype=np.float32)[None]
    black = np.zeros((1, 50, 4), np.float32)
    black[..., 3] = 1 - np.exp(-depth)
    fire, smoke = parted(black, "srgb")
    assert fire.max() < 1e-6
    assert np.allclose(smoke[..., 3], 1 - np.exp(-depth), atol=1e-6)


def test_fire_that_is_added_shows_the_picture_over_black() -> None:
    """And over brighter walls at least as much: light is added to what the smoke lets through."""
    pixels = frame(shipped("samples") / "explosion" / "0010.png")
    fire, smoke = parted(pixels, "srgb", "none")
    light = shown(fire, np.array(0.0), "srgb")
    for wall in WALLS:
        found = light + shown(smoke, np.array(wall), "srgb")
        wanted = shown(pixels, np.array(wall), "srgb")
        assert (found > wanted - 1 / 255).all()
        if wall == 0:
            assert np.abs(found - wanted).max() < 1 / 255


def test_light_smoke_stays_with_the_smoke_and_white_heat_with_the_fire() -> None:
    heat = np.array([[[0.9, 0.9, 0.9, 0.9]]], np.float32)
    fire, smoke = parted(heat, "srgb")
    assert fire[0, 0, 3] > 0.89 and smoke[0, 0, 3] < 0.05
