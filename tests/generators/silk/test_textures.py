"""The images on the sheets: painted, cut from clips, and synthesised without end."""

import math
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.blackbody import blackbody
from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.noise import BlurredCurlNoise
from fire_atlas.generators.silk.clip_texture import cut_texture, synthesise_from_clip
from fire_atlas.generators.silk.colour import ColourMap
from fire_atlas.generators.silk.fuel import FUELS, Burner
from fire_atlas.generators.silk.motion_synthesis import (
    SeedImages,
    most_probable_motion,
    synthesise_images,
)
from fire_atlas.generators.silk.procedural_texture import synthesise_texture
from fire_atlas.generators.silk.renderer import SilkRenderer, generate_silk
from fire_atlas.generators.silk.texture_loop import TextureLoop
from fire_atlas.recipe.silk import FuelName, SilkSource
from tests.generators.silk.small_fires import COARSE, camera, settings
from tests.support.clips import open_clip, real, real_clip

Array = NDArray[np.float32]
BURNER = Burner(
    gas_speed=0.07, eddy_strength=0.5, flame_height=0.8, width=0.75, flicker=0.5,
    tongue_width=0.14, entrainment=0.6, grain=0.5, ragged=0.035, mixing=4.0,
    foot_heat=0.3,
)  # fmt: skip


def painted(images: int = 24, index: int = 0) -> TextureLoop:
    return synthesise_texture(BURNER, images, (96, 48), 0.5, seed=5, index=index)


def step(one: Array, other: Array) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def detail(image: Array) -> float:
    return float(np.mean(np.diff(image, axis=0) ** 2) + np.mean(np.diff(image, axis=1) ** 2))


def test_painted_images_close_into_a_circle() -> None:
    images = painted().images
    steps = [step(images[n], images[(n + 1) % 24]) for n in range(24)]
    assert 0.6 < steps[-1] / np.median(steps) < 1.5


@pytest.mark.parametrize("fuel", ["wood", "candle", "gas"])
def test_time_steps_half_as_long_paint_flames_as_high(fuel: FuelName) -> None:
    heights, areas = [], []
    for fineness in (1, 2):
        tops = []
        for seed in range(4):
            burner = FUELS[fuel].burner
            images = synthesise_texture(burner, 24, (128, 64), 0.5, seed, 0, fineness).images[
                ..., 0
            ]
            lit = ((images > 0.2).sum(axis=2) >= 2).argmax(axis=1)
            tops.append(1 - lit.mean() / 128)
            areas.append(float((images > 0.2).mean()))
        heights.append(float(np.mean(tops)))
    assert heights[1] == pytest.approx(heights[0], rel=0.05)
    assert sum(areas[4:]) == pytest.approx(sum(areas[:4]), rel=0.05)


def test_painted_fire_is_hot_below_and_gone_at_every_edge() -> None:
    images = painted().images[..., 0]
    assert not images[:, [0, -1]].any() and not images[:, :, [0, -1]].any()
    rows = images.mean(axis=(0, 2))
    assert rows[60:88].mean() > 4 * rows[8:36].mean() > 0
    assert 0.9 < images.max() <= 1.25


def test_painted_fire_has_tongues_and_no_two_sequences_are_alike() -> None:
    one, other = (painted(index=k).images[..., 0] for k in (0, 1))
    # A row is cut into bright and dark several times over.
    lit = (one[:, 56] > 0.3).astype(int)
    tongues = (np.diff(lit, axis=1) == 1).sum(axis=1)
    assert tongues.mean() > 1.3
    assert abs(np.corrcoef(one.ravel() - one.mean(0).repeat(1).mean(), other.ravel())[0, 1]) < 0.9
    assert step(one, other) > 0.1


def test_fire_closes_the_gaps_that_its_flow_draws_out_to_threads() -> None:
    reach, threads, fire = round(0.03 * 192), 0, 0
    for index in range(3):
        burner = FUELS["wood"].burner
        images = synthesise_texture(burner, 16, (192, 96), 0.5, 5, index).images[..., 0]
        beside = np.pad(images, ((0, 0), (0, 0), (reach, reach)))
        less = np.minimum(beside[..., : -2 * reach], beside[..., 2 * reach :])
        fire += int((less > 0.25).sum())
        threads += int(((images < 0.5 * less) & (less > 0.25)).sum())
    assert threads / fire < 0.035, "twice as many where gaps stay open"


def test_the_foot_of_a_flame_is_as_cool_as_its_fuel_states() -> None:
    cool, hot = (
        synthesise_texture(replace(BURNER, foot_heat=heat), 8, (96, 48), 0.5, 5, 0).images
        for heat in (0.3, 1.0)
    )
    rows = cool.sum(axis=(0, 2, 3)) / np.maximum(hot.sum(axis=(0, 2, 3)), 1e-9)
    up = 1 - (np.arange(96) + 0.5) / 96
    lit = hot.sum(axis=(0, 2, 3)) > 1
    assert rows[lit][up[lit] < 0.03].max() < 0.36
    assert np.allclose(rows[lit][up[lit] > 0.22], 1)
    assert (np.diff(rows[lit]) <= 1e-6).all()


def test_the_motion_of_painted_fire_tells_where_it_goes() -> None:
    sequence = painted()
    rows, columns = np.mgrid[:96, :48].astype(np.float32)
    plain = followed = 0.0
    for n in range(0, 24, 4):
        now, after = sequence.images[n, ..., 0], sequence.images[(n + 1) % 24, ..., 0]
        motion = sequence.motion_from(n)
        found = cv2.remap(after, columns + motion[..., 0], rows + motion[..., 1], cv2.INTER_LINEAR)
        plain, followed = plain + step(now, after), followed + step(now, np.asarray(found))
    assert followed < 0.75 * plain


def test_between_two_images_a_tongue_moves_on() -> None:
    images = np.zeros((4, 40, 20, 1), np.float32)
    blob = np.exp(-(((np.mgrid[:40, :20][0] - 30) / 3.0) ** 2)).astype(np.float32)
    for n in range(4):
        images[n, ..., 0] = np.roll(blob, -4 * n, axis=0)
    motion = np.zeros((4, 10, 5, 2), np.float32)
    motion[..., 1] = -4.0
    sequence = TextureLoop(images, motion)
    assert np.array_equal(sequence.image_at(1.0), images[1])
    assert np.array_equal(sequence.image_at(5.0), images[1])
    between = sequence.image_at(0.5)[..., 0]
    assert np.argmax(between[:, 10]) == 28
    assert between.max() > 0.97, "a cross-fade would show two dim ones"


# Appendix B


def noise_free_seeds(shift: tuple[int, int]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Two colour images, the second moved; and where there is texture."""
    chance = np.random.default_rng(3)
    large = cv2.GaussianBlur(chance.random((120, 100, 3)).astype(np.float32), (0, 0), 2.0)
    large = (large - large.min()) / np.ptp(large)
    dx, dy = shift
    one = large[20:100, 20:80]
    other = large[20 - dy : 100 - dy, 20 - dx : 80 - dx]
    gray = np.asarray(other.mean(axis=-1), np.float32)
    slope = np.hypot(cv2.Sobel(gray, cv2.CV_32F, 1, 0), cv2.Sobel(gray, cv2.CV_32F, 0, 1))
    return np.ascontiguousarray(one), np.ascontiguousarray(other), slope > np.median(slope) / 2


@pytest.mark.parametrize("shift", [(0, 0), (2, -3), (-4, 1), (5, 5)])
def test_a_known_translation_is_the_most_probable_motion(shift: tuple[int, int]) -> None:
    one, other, textured = noise_free_seeds(shift)
    motion = most_probable_motion(one, other, 6)
    right = np.abs(motion - shift).max(axis=-1) < 0.5
    assert right[textured].mean() >= 0.8


@pytest.mark.slow
def test_two_hundred_synthesised_images_neither_freeze_nor_blur_away() -> None:
    images = painted().images
    seeds = SeedImages(images[7], images[8], 7)
    usual = step(seeds.one, seeds.other)
    sharp = (detail(seeds.one) + detail(seeds.other)) / 2
    made = [seeds.other, *islice(synthesise_images(seeds, seed=1, period=200), 200)]
    steps = np.array([step(a, b) for a, b in pairwise(made)]) / usual
    assert steps.min() >= 0.5
    assert min(detail(image) for image in made) >= 0.7 * sharp
    assert max(float(image.max()) for image in made) <= float(images[7:9].max())


@pytest.mark.parametrize("seed", range(12))
def test_eddies_do_not_come_back_before_their_period_ends(seed: int) -> None:
    """Images driven by the same eddies twice are alike, though they are six or eight apart."""
    eddies = BlurredCurlNoise(generator(seed, RandomStream.EXCITEMENT), (48, 48), 1.5, 48)
    first = eddies.at(0)
    apart = [np.sqrt(((eddies.at(n) - first) ** 2).sum(axis=-1).mean()) for n in range(2, 47)]
    assert min(apart) > 0.7, "of an rms length of 1"


def test_synthesised_fire_moves_as_far_from_image_to_image_as_its_seeds() -> None:
    """Whatever the energy of the sheets: that sets how fast the images are played."""
    images = painted().images
    seeds = SeedImages(images[7], images[8], 7)
    made = list(islice(synthesise_images(seeds, 1, 16), 16))
    pace = float(np.mean([step(a, b) for a, b in pairwise(made)]))
    assert pace == pytest.approx(step(seeds.one, seeds.other), rel=0.2)


# Clips


def test_fire_is_cut_out_of_a_real_scene_and_set_upright(clips: Path) -> None:
    sequence = cut_texture(real_clip(clips, "real_fireplace_gif"), 8, (96, 64), "fireplace")
    images = sequence.images
    assert images.shape == (8, 96, 64, 3)
    light = images.mean(axis=(0, 3))
    assert images.max() > 1, "as bright as before a film exposed it"
    assert not light[[0, -1]].any() and not light[:, [0, -1]].any()
    columns = light.sum(axis=0)
    middle = float((columns * np.arange(64)).sum() / columns.sum())
    assert middle == pytest.approx(31.5, abs=5)
    red, blue = images[..., 0].sum(), images[..., 2].sum()
    assert red > 2 * blue, "the fire, not the bricks"


def test_seeds_from_a_clip_give_as_many_images_as_are_asked_for(clips: Path) -> None:
    clip = real_clip(clips, "sim_unity_flame03")
    sequence = synthesise_from_clip(clip, (20, 21), 12, (80, 40), "flame", seed=1)
    assert sequence.images.shape == (12, 80, 40, 3)
    steps = [step(sequence.images[n], sequence.images[(n + 1) % 12]) for n in range(12)]
    assert min(steps) > 0.01 and steps[-1] < 2 * np.median(steps)


# One clip with two seeds, as chance decides what is synthesised; others, filmed and simulated, with
# one.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seeds", "seed"),
    [
        real("sim_unity_flame02", (20, 21), 1),
        real("sim_unity_flame02", (20, 21), 2),
        real("sim_unity_flame03", (20, 21), 2),
        real("real_firewall_stock", (10, 11), 1),
    ],
)
def test_a_synthesised_loop_has_as_many_distinct_images_as_it_is_long(
    name: str, seeds: tuple[int, int], seed: int
) -> None:
    clip = open_clip(name)
    images = synthesise_from_clip(clip, seeds, 48, (96, 48), name, seed).images
    steps = [step(images[n], images[(n + 1) % 48]) for n in range(48)]
    pairs = [step(images[a], images[b]) for a in range(48) for b in range(a)]
    assert min(pairs) >= 0.5 * np.median(steps), "no two are alike"
    assert steps[-1] < 1.2 * max(steps[:-1]), "it closes"
    assert images[-1].std() == pytest.approx(images[0].std(), rel=0.1), "it does not fade"


def still_clip(value: tuple[float, float, float], count: int = 20, matte: str = "none") -> Clip:
    frame = np.ones((40, 30, 4), np.float32)
    frame[..., :3] = value
    return Clip(30, 40, 24.0, count, lambda _: frame.copy(), (), "linear", matte, "")


@pytest.mark.parametrize(
    "clip",
    [
        still_clip((0, 0, 0)),
        still_clip((0.5, 0.4, 0.3)),
        still_clip((0.05, 0.1, 0.9), matte="luminance"),
    ],
    ids=["black", "a still wall", "a blue screen"],
)
def test_a_clip_without_fire_is_refused(clip: Clip) -> None:
    with pytest.raises(SourceError, match=r"dark\.gif: shows no fire"):
        cut_texture(clip, 8, (64, 32), "dark.gif")


def test_pressure_lowers_and_oxygen_brightens_a_clip_on_the_sheets(clips: Path) -> None:
    clip = real_clip(clips, "sim_unity_flame03")
    keys = {"kind": "silk", **COARSE, "sheets": {"count": 3}, "texture": {"path": "fire.gif"}}

    def made(**more: float) -> SilkRenderer:
        return generate_silk(SilkSource.model_validate({**keys, **more}), settings(4, True), clip)

    heights = []
    for pressure in (0.3, 1.0):
        image = made(pressure=pressure).textures.image(0, 0).max(axis=-1)
        heights.append(1 - np.flatnonzero((image > 0.3).any(axis=1))[0] / len(image))
    assert heights[0] < 0.85 * heights[1]
    light = [made(oxygen=o).draw(1, camera()).light.sum() for o in (0.4, 1.0, 2.5)]
    assert light[0] < 0.8 * light[1] < 0.64 * light[2]


def test_black_bodies_need_painted_fire() -> None:
    with pytest.raises(ValueError, match="has colours of its own"):
        SilkSource.model_validate(
            {"kind": "silk", "grading": "blackbody", "texture": {"path": "fire.gif"}}
        )


def test_a_clip_with_too_few_frames_says_how_many_there_are() -> None:
    with pytest.raises(SourceError, match="has 5 frames"):
        cut_texture(still_clip((1, 0.5, 0), 5), 8, (64, 32), "short.gif")
    with pytest.raises(SourceError, match=r"seeds: \[3, 9\].*0 to 4"):
        synthesise_from_clip(still_clip((1, 0.5, 0), 5), (3, 9), 8, (64, 32), "short.gif", 0)


# Colour

_WIEN_RED = 1.438777e7 / 620
"""hc/λk, K, of the red of sRGB."""


def test_black_bodies_have_the_colours_known_for_them() -> None:
    """Linear sRGB of Planck's law, from the published tables for the 2° observer."""
    found = blackbody(np.array([1500.0, 2000.0, 3000.0, 6500.0]))
    assert np.allclose(found[0], [1, 0.15, 0], atol=0.03)
    assert np.allclose(found[1], [1, 0.26, 0.007], atol=0.03)
    assert np.allclose(found[2], [1, 0.47, 0.16], atol=0.04)
    assert np.allclose(found[3], [1, 0.94, 0.98], atol=0.05)


def test_black_bodies_are_brighter_by_plancks_law_up_to_a_limit() -> None:
    image = np.ones((8, 8, 1), np.float32)
    colours = ColourMap.of(FUELS["wood"], "blackbody", 1.0, 1.0, 0.0)
    slow, usual, faster, fastest = (
        colours.light(image, speed * colours.reference_speed)[0, 0, :3] for speed in (0, 1, 1.2, 50)
    )
    hot = FUELS["wood"].temperature
    light = FUELS["wood"].brightness
    found = [float(each.max()) for each in (slow, usual, fastest)]
    assert found == pytest.approx([light / 4, light, 4 * light], rel=0.06)
    assert np.allclose(fastest / fastest.max(), blackbody(np.array([1.15 * hot]))[0], atol=0.01)
    # Wien: an energy of 1.44 is 1 + .15 (2 * 1.44 / 2.44 - 1) times as hot.
    kelvin = hot * (1 + 0.15 * (2 * 1.44 / 2.44 - 1))
    brighter = math.exp(_WIEN_RED * (1 / hot - 1 / kelvin))
    assert faster[0] / usual[0] == pytest.approx(brighter, rel=0.1)


def test_black_bodies_are_hotter_on_faster_sheets_and_fuels_are_not() -> None:
    """Eq. 18-23: heat goes with v_rms²."""
    image = np.full((8, 8, 1), 0.9, np.float32)
    for grading, is_hotter in (("blackbody", True), ("fuel", False)):
        colours = ColourMap.of(FUELS["wood"], grading, 1.0, 1.0, 0.0)
        speeds = [share * colours.reference_speed for share in (0.2, 1.0, 5.0)]
        greens = [
            float(light[0, 0, 1] / light[0, 0, 0])
            for light in (colours.light(image, speed) for speed in speeds)
        ]
        assert (greens[0] < 0.9 * greens[1] < 0.81 * greens[2]) == is_hotter, grading
        assert (len(set(greens)) == 1) != is_hotter


def test_every_fuel_is_sound() -> None:
    for fuel in FUELS.values():
        assert 0 < fuel.burner.width < 1
        assert fuel.lift > fuel.gravity, "flames rise"
