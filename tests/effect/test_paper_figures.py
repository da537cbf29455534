"""What the paper's Figures 5, 8, 22 and 23 show, on our own clips."""

from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import brightness, decode_bytes
from fire_atlas.effect.flame.features import feature_vectors, refine
from tests.support.clips import RISING, campfire, clip_of, open_clip, real
from tests.support.effect import VY, EffectRun, Plane, run_effect

RISING_ALL = ("campfire", "torch", "candle", "cartoon", "pixel_art", *(real(n) for n in RISING))


def _alive(effect: EffectRun) -> float:
    return float(np.mean([len(rows) for rows in effect.tracks.frames]))


@pytest.mark.parametrize("seed", [0, 7])
def test_figure_22_a_lower_alpha_gives_more_flakes(seed: int) -> None:
    clip = campfire(160)
    automatic = run_effect(clip).study.fires.each[0].alpha
    counts = [
        _alive(run_effect(clip, {"seed": seed, "flakes": {"alpha": share * automatic}}))
        for share in (0.5, 1.0, 2.0)
    ]
    assert counts[0] > counts[1] > counts[2] > 0


def _fire_and_drum() -> Clip:
    """Return a lively fire on the left; on the right a drum whose weak glow comes and goes."""
    fire = campfire(120, 16)
    frames = []
    for i in range(fire.count):
        left = fire.read(i)
        right = np.zeros_like(left)
        glow = np.uint8(70 + 60 * (i % 2))
        shown = np.zeros((*left.shape[:2], 3), np.uint8)
        cv2.circle(shown, (left.shape[1] // 2, 60), 25, (int(glow), int(glow) // 2, 0), -1)
        soft = cv2.GaussianBlur(shown, (0, 0), 2.0)
        right[..., :3] = decode_bytes(np.asarray(soft, np.uint8))
        right[..., 3] = soft.max(axis=2) > 0
        frames.append(np.hstack([left, right]))
    return clip_of(frames)


def _share_on_the_drum(effect: EffectRun) -> float:
    return float(np.mean(effect.births[:, 0] > effect.clip.width / 2))


def _strength(effect: EffectRun, i: int) -> Plane:
    """‖Fv*‖ of frame ``i`` without a clamp."""
    bright = brightness(effect.clip.read(i), "srgb")
    features, study = effect.recipe.features, effect.study
    vectors = feature_vectors(
        bright, features.sigma, features.kernel, study.fires.epsilon(), study.kappa
    )
    return np.hypot(*refine(*vectors, study.buoyancy, features.beta))


def test_figure_23_the_clamp_empties_weak_regions() -> None:
    clip = _fire_and_drum()
    # The paper's own births: by default a still drum bears none to begin with.
    features = {"preset": "paper", "epsilon": 0.5, "n": 0}
    flakes = {"alpha": 0.01, "rate": 600}
    free = run_effect(clip, {"features": features, "flakes": flakes})
    assert _share_on_the_drum(free) > 0.02, "the drum should be a nuisance before the clamp"
    strongest = max(_strength(free, i)[:, clip.width // 2 :].max() for i in range(free.clip.count))
    clamp = float(strongest) * 1.01
    clamped = run_effect(clip, {"features": {**features, "clamp": clamp}, "flakes": flakes})
    assert len(clamped.births) > 50
    assert _share_on_the_drum(clamped) == 0


def _field(name: str, **features: Any) -> tuple[float, float]:
    """Return the share of the flame's cells whose air sinks, and their median speed, heights/s."""
    effect = run_effect(open_clip(name), {"features": {"preset": "paper", **features}})
    field, height = effect.analysis.field, effect.clip.height
    in_flame = field.lit > 128
    u, v = field.u[in_flame] / height, field.v[in_flame] / height
    return float(np.mean(v > 0.02)), float(np.median(np.hypot(u, v)))


@pytest.mark.parametrize("name", RISING_ALL)
def test_figure_8_without_kappa_the_field_flows_down(name: str) -> None:
    without, weighted = _field(name, n=0)[0], _field(name)[0]
    assert without > 0.07
    # The campfire of Wesnoth burns from the frame's foot to its top: half of it sinks either way.
    assert without > (1.0 if "wesnoth" in name else 1.2) * weighted


@pytest.mark.parametrize("name", ["campfire", "cartoon", "torch", real("real_fireplace_gif")])
def test_figure_5_a_larger_n_weakens_the_field(name: str) -> None:
    speeds = [_field(name, n=n)[1] for n in (0, 1, 5, 10)]
    assert all(weaker < 0.8 * stronger for stronger, weaker in pairwise(speeds)), speeds


def test_figure_8_without_kappa_flakes_go_down() -> None:
    def downward(**features: Any) -> float:
        keys = {"features": {"preset": "paper", **features}, "flakes": {"rate": 800}}
        return float(np.mean(run_effect(campfire(), keys).rows[:, VY] > 0))

    assert downward(n=0) > 0.1
    assert downward() < 0.03
