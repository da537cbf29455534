"""A fire of one, two or three images: as many frames as wanted, of a flame that sways."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, encode_bytes
from fire_atlas.core.progress import SilentProgress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.arrange import arrange
from fire_atlas.vision.flow import resized
from tests.support.clips import clip_of, open_clip, real
from tests.support.effect import run_effect

FRAMES = 48


@lru_cache(maxsize=8)
def _images(name: str, *numbers: int) -> tuple[Pixels, ...]:
    clip = open_clip(name)
    size = round(clip.width * 160 / clip.height), 160
    # A small drawing keeps its own few colours.
    fits = clip.height <= size[1]
    return tuple(clip.read(i) if fits else resized(clip.read(i), size) for i in numbers)


def _arranged(
    images: Sequence[Pixels], matte: str = "alpha", seed: int = 0, frames: int = FRAMES
) -> Clip:
    timeline = Timeline(frames=frames)
    with Workers(1) as workers:
        clip = clip_of(images, matte=matte)
        return arrange(clip, timeline, 2.6, workers, SilentProgress(), seed=seed)


def _shown(clip: Clip) -> NDArray[np.float64]:
    """Return all frames as they are shown on black, (frames, H, W, 3), 0..255."""
    shown = [encode_bytes(np.ascontiguousarray(clip.read(i)[..., :3])) for i in range(clip.count)]
    return np.stack(shown).astype(np.float64)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("campfire", (4,)),
        ("campfire", (4, 20)),
        ("campfire", (4, 20, 40)),
        ("cartoon", (0,)),
        ("cartoon", (0, 8)),
        real("cartoon_fluent_fire", (3,)),
        real("sim_unity_flame03", (10, 30, 50)),
    ],
)
def test_few_images_give_a_loop_of_distinct_frames_with_flakes(
    name: str, numbers: tuple[int, ...]
) -> None:
    effect = run_effect(clip_of(_images(name, *numbers)), {"timeline": {"frames": FRAMES}})
    assert effect.clip.count == FRAMES and effect.clip.loop
    assert sum(len(rows) > 0 for rows in effect.tracks.frames) >= 44
    frames = _shown(effect.clip)
    assert len({frame.tobytes() for frame in frames}) == FRAMES
    steps = np.abs(frames - np.roll(frames, -1, axis=0)).mean(axis=(1, 2, 3))
    assert steps[-1] <= 1.25 * np.median(steps)


@pytest.mark.parametrize(("count", "frames"), [(1, 2), (1, 3), (2, 3), (3, 4)])
def test_few_images_give_any_larger_number_of_frames(count: int, frames: int) -> None:
    clip = _arranged(_images("candle", 3, 6, 9)[:count], frames=frames)
    assert clip.count == frames and clip.loop
    assert len({frame.tobytes() for frame in _shown(clip)}) == frames


def test_the_flame_breathes_on_a_foot_that_stays() -> None:
    frames = _shown(_arranged(_images("candle", 3))).max(axis=-1)
    lit = (frames > 100).any(axis=2)
    tops, feet = lit.argmax(axis=1), lit.shape[1] - lit[:, ::-1].argmax(axis=1)
    height = float(np.median(feet - tops))
    assert np.ptp(tops) >= 0.04 * height
    assert np.ptp(feet) <= 0.02 * height + 1


def test_the_scene_behind_a_flame_keeps_still() -> None:
    chance = np.random.default_rng(1)
    (fire,) = _images("campfire", 4)
    scene = np.ones((160, 300, 4), np.float32)
    scene[..., :3] = chance.uniform(0, 0.02, (160, 300, 3))
    left = scene[:, : fire.shape[1]]
    left[..., :3] = fire[..., :3] + left[..., :3] * (1 - fire[..., 3:])
    frames = _shown(_arranged([scene], matte="none"))
    changes = np.ptp(frames, axis=0).max(axis=-1)
    assert changes[:, 200:].max() == 0
    assert changes[:, : fire.shape[1]].max() > 100


def test_flat_art_gets_no_new_colours() -> None:
    images = _images("pixel_art", 0, 4)
    given = {tuple(colour) for image in images for colour in image.reshape(-1, 4)}
    clip = _arranged(images)
    for i in range(0, FRAMES, 7):
        assert {tuple(colour) for colour in clip.read(i).reshape(-1, 4)} <= given


def test_each_image_is_seen_at_its_turn() -> None:
    """Frame 16 of 48 is nearest to the second of three images, and 32 to the third."""
    images = _images("campfire", 4, 20, 40)
    clip = _arranged(images)
    for i, nearest in ((0, 0), (16, 1), (32, 2)):
        distances = [float(np.abs(clip.read(i) - image).mean()) for image in images]
        assert int(np.argmin(distances)) == nearest


def test_the_seed_decides_how_it_sways() -> None:
    one, other, again = (_arranged(_images("candle", 3), seed=s).read(9) for s in (1, 2, 1))
    assert not np.array_equal(one, other) and np.array_equal(one, again)
