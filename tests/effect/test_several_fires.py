"""Several fires in a frame: each has its own κ and candidates, and sheds by its area."""

from functools import lru_cache

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.fires import separate_fires
from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.recipe.effect import Features
from fire_atlas.vision.flow import resized
from tests.support.clips import SAMPLES, clip_of, open_clip
from tests.support.effect import EffectRun, Plane, run_effect

FRAMES = 16

SIDE_BY_SIDE, APART_IN_HEIGHT = (0.0, 0.0), (0.0, 0.6)
"""How much lower each of two fires stands, in heights of its clip."""


@lru_cache(maxsize=4)
def _fire(name: str, height: int) -> tuple[Pixels, ...]:
    """Return the first frames of a sample at this height."""
    clip = open_clip(name)
    width = round(clip.width * height / clip.height)
    return tuple(resized(clip.read(i), (width, height)) for i in range(FRAMES))


def _scene(fires: list[tuple[tuple[Pixels, ...], int]]) -> Clip:
    """Return a clip of fires side by side, each with its distance from the top, px."""
    bottom = max(down + len(frames[0]) for frames, down in fires)
    scene = []
    for i in range(FRAMES):
        columns = []
        for frames, down in fires:
            column = np.zeros((bottom, frames[i].shape[1], 4), np.float32)
            column[down : down + len(frames[i])] = frames[i]
            columns.append(column)
        scene.append(np.hstack(columns))
    return clip_of(scene)


def _two(name: str, lower: tuple[float, float], light: float = 1.0) -> Clip:
    """Return a clip of two copies of a sample, the second with this much of its light."""
    frames = _fire(name, 128)
    dim = tuple(frame * np.array([light, light, light, 1.0], np.float32) for frame in frames)
    return _scene([(frames, round(lower[0] * 128)), (dim, round(lower[1] * 128))])


def _shed(clip: Clip) -> EffectRun:
    return run_effect(clip, {"flakes": {"rate": 300}, "timeline": {"loop": "none"}})


def _born(effect: EffectRun, ends: list[int]) -> list[float]:
    """Return the share of births left of each of ``ends``, px, and right of that before it."""
    counts = np.histogram(effect.births[:, 0], [0, *ends])[0]
    return [float(each) for each in counts / counts.sum()]


@pytest.mark.parametrize("lower", [SIDE_BY_SIDE, APART_IN_HEIGHT])
@pytest.mark.parametrize("name", ["campfire", "cartoon"])  # rendered and painted
def test_two_equal_fires_shed_alike(name: str, lower: tuple[float, float]) -> None:
    effect = _shed(_two(name, lower))
    shares = _born(effect, [effect.clip.width // 2, effect.clip.width])
    assert len(effect.births) > 80 and min(shares) >= 0.4, shares


def test_a_dim_fire_sheds_as_much_as_a_bright_one() -> None:
    """It has an ε and an α of its own; its faint edges alone are too dark to count as flame."""
    effect = _shed(_two("campfire", SIDE_BY_SIDE, light=0.3))
    shares = _born(effect, [effect.clip.width // 2, effect.clip.width])
    assert min(shares) >= 0.35, shares


def test_five_fires_shed_by_their_areas() -> None:
    heights = np.array([160, 128, 104, 80, 64])
    fires = [_fire("campfire", int(height)) for height in heights]
    clip = _scene([(fire, 160 - len(fire[0])) for fire in fires])
    effect = _shed(clip)
    ends = np.cumsum([fire[0].shape[1] for fire in fires])
    assert len(effect.study.fires.by_number) == 5
    shares = _born(effect, [int(end) for end in ends])
    assert shares == pytest.approx(list(heights**2 / (heights**2).sum()), abs=0.04)


def test_kappa_runs_over_each_fire() -> None:
    clip = _two("campfire", APART_IN_HEIGHT)
    kappa = _study(clip).kappa
    left, right = (kappa[:, column] for column in (clip.width // 4, 3 * clip.width // 4))
    lower = round(0.6 * 128)
    assert np.abs(left[:-lower] - right[lower:]).max() < 0.05
    assert left.max() == right.max() == 1 and left.min() == right.min() == 0


@pytest.mark.parametrize("name", [*SAMPLES])
def test_a_clip_of_one_fire_has_one(name: str) -> None:
    assert len(_study(open_clip(name)).fires.by_number) == 1


def test_the_paper_knows_one_fire() -> None:
    features = Features.model_validate({"preset": "paper"})
    assert len(_study(_two("campfire", SIDE_BY_SIDE), features).fires.by_number) == 1


def _study(clip: Clip, features: Features | None = None) -> FlameStudy:
    with Workers(1) as workers:
        return study_flame(clip, features or Features(), None, workers, is_sampled=False)


def _masks(bridged: range) -> list[Plane]:
    """Return twelve masks of two blocks of flame, joined in the frames of ``bridged``."""
    masks = []
    for i in range(12):
        mask = np.zeros((100, 120), np.float32)
        mask[30:90, 10:50] = mask[30:90, 70:110] = 1
        if i in bridged:
            mask[60:90, 50:70] = 1
        masks.append(mask)
    return masks


def test_a_flame_that_tears_for_a_few_frames_is_one_fire() -> None:
    assert not separate_fires(_masks(range(2, 12))).any()


def test_fires_that_touch_for_a_few_frames_are_two() -> None:
    labels = separate_fires(_masks(range(2)))
    assert (labels[:, :55] == 0).all() and (labels[:, 65:] == 1).all()


def test_a_tongue_that_comes_off_is_no_fire() -> None:
    masks = []
    for i in range(12):
        mask = np.zeros((120, 60), np.float32)
        mask[80:110, 10:50] = 1
        top = 70 - 20 * (i % 4)
        mask[top : top + 8, 24:36] = 1
        masks.append(mask)
    assert not separate_fires(masks).any()


def test_a_fire_that_crosses_the_frame_is_one() -> None:
    masks = []
    for i in range(12):
        mask = np.zeros((60, 240), np.float32)
        mask[20:40, 20 * i : 20 * i + 15] = 1
        masks.append(mask)
    assert not separate_fires(masks).any()
