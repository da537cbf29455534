"""A fire in a lit scene: sparks are born in the flame, not on what it lights.

The scene is our own: the sample campfire in a metal bowl with a bright rim, before a brick wall.
Bowl and wall stand still, but their brightness flickers by 15 % with the fire.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, decode_bytes, encode_unit, srgb_to_linear
from fire_atlas.effect.flakes.emission import TICK
from tests.support.clips import campfire, clip_of
from tests.support.effect import Array, EffectRun, Plane, run_effect

FLICKER = 0.15
FRAMES = 24


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene in sRGB bytes: wall, mortar, bowl, and the highlights on its rim."""

    brick: tuple[int, int, int]
    mortar: tuple[int, int, int]
    bowl: tuple[int, int, int]
    highlight: tuple[int, int, int]


DARK = Scene((58, 30, 20), (34, 26, 22), (40, 36, 34), (255, 226, 180))
DAYLIGHT = Scene((176, 104, 78), (190, 180, 168), (92, 94, 98), (255, 250, 240))


def _still(scene: Scene, height: int, width: int) -> Plane:
    """Wall and bowl, (H, W, 3) sRGB in 0..1, without the fire."""
    image = np.empty((height, width, 3), np.uint8)
    image[:] = scene.mortar
    tall, wide = round(height / 14), round(width / 8)
    chance = np.random.default_rng(4)
    for course in range(15):
        for brick in range(-1, 9):
            left = brick * wide + (course % 2) * wide // 2
            shade = chance.uniform(0.85, 1.15)
            colour = tuple(min(round(c * shade), 255) for c in scene.brick)
            corner = left + wide - 3, course * tall + tall - 3
            cv2.rectangle(image, (left, course * tall), corner, colour, -1)
    middle, rim = width // 2, round(height * 0.9)
    axes = round(width * 0.36), round(height * 0.05)
    cv2.ellipse(image, (middle, rim), (axes[0], round(height * 0.2)), 0, 0, 180, scene.bowl, -1)
    cv2.ellipse(image, (middle, rim), axes, 0, 0, 360, scene.bowl, -1)
    for start in (20, 110, 200, 300):  # where the polished rim mirrors the fire
        cv2.ellipse(
            image, (middle, rim), axes, 0, start, start + 40, scene.highlight, 2, cv2.LINE_AA
        )
    return np.asarray(image / 255, np.float32)


def _brazier(scene: Scene, hides: float = 1.0) -> tuple[Clip, list[Plane]]:
    """Return the clip, an opaque scene, and the mask (H, W) of the flame alone in every frame.

    Painted fire ``hides`` what is behind it as far as it covers it (1); before a camera it adds its
    light (0).
    """
    source = campfire()
    fire = [source.read(i) for i in range(FRAMES)]
    light = np.array([f[..., :3].sum() for f in fire])
    swing = (light - light.mean()) / np.abs(light - light.mean()).max()
    still = _still(scene, *fire[0].shape[:2])
    frames: list[Pixels] = []
    for flame, turn in zip(fire, swing, strict=True):
        lit = srgb_to_linear(np.clip(still * (1 + FLICKER * turn), 0, 1))
        rgb = np.clip(flame[..., :3] + lit * (1 - hides * flame[..., 3:]), 0, 1)
        shown = np.rint(encode_unit(rgb) * 255).astype(np.uint8)
        frames.append(np.dstack([decode_bytes(shown), np.ones_like(rgb[..., :1])]))
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    masks = [
        np.asarray(cv2.dilate((f[..., 3] > 0).astype(np.float32), around), np.float32) for f in fire
    ]
    return clip_of(frames, matte="none"), masks


def _born_in(effect: EffectRun, masks: list[Plane]) -> Array:
    """Whether each flake was born in its frame's mask."""
    spawns = effect.analysis.spawns
    starts = [round(i / effect.clip.fps / TICK) for i in range(effect.clip.count)]
    frame = np.searchsorted(starts, spawns.tick, side="right") - 1
    at = frame, spawns.y.astype(np.intp), spawns.x.astype(np.intp)
    return np.stack(masks)[at].astype(np.float64)


@pytest.mark.parametrize(
    ("scene", "hides", "least"),
    # By day the tips of painted fire are darker than the pale mortar behind them, and the mortar
    # seems to light up where they leave it.
    [(DARK, 1, 0.98), (DARK, 0, 0.98), (DAYLIGHT, 0, 0.98), (DAYLIGHT, 1, 0.8)],
    ids=["dark, painted", "dark", "daylight", "daylight, painted"],
)
def test_sparks_are_born_in_the_flame_not_on_what_it_lights(
    scene: Scene, hides: float, least: float
) -> None:
    clip, masks = _brazier(scene, hides)
    inside = _born_in(
        run_effect(clip, {"flakes": {"rate": 1000}, "timeline": {"loop": "none"}}), masks
    )
    assert len(inside) > 400
    assert inside.mean() >= least


def test_the_scene_is_a_fair_one() -> None:
    """The flame is a small part of it, and the prop flickers as much as it says."""
    clip, masks = _brazier(DARK)
    assert np.mean(masks) < 0.5
    away = np.all([mask == 0 for mask in masks], axis=0)
    shown = np.stack([encode_unit(clip.read(i)[..., 0])[away] for i in range(clip.count)])
    swing = shown.max(axis=0) / np.maximum(shown.min(axis=0), 1 / 255)
    assert math.isclose(np.median(swing), (1 + FLICKER) / (1 - FLICKER), rel_tol=0.12)
