"""What the paper's Figures 8, 22 and 23 show, on our own clips."""

from typing import Any

import cv2
import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import brightness, decode_bytes
from fire_atlas.effect.flame.features import feature_vectors, refine
from tests.support.clips import campfire, clip_of, open_clip, real
from tests.support.effect import VY, EffectRun, Plane, run_effect

MANY = 800
"""Births a second, for statistics."""

AS_THE_PAPER = {"feature_force": 0.3, "lift": 0.3, "turbulence": 0}
"""A field of feature vectors, with little lift and without eddies."""

FIGURE_8 = [
    ("cartoon", {}, 1.5),
    ("cartoon", AS_THE_PAPER, 1.5),
    ("pixel_art", AS_THE_PAPER, 1.2),
    real("cartoon_fluent_fire", {}, 1.2),
    real("real_candle_red", {}, 1.5),
    real("cartoon_fluent_fire", AS_THE_PAPER, 1.2),
    real("cartoon_freedoom_fire", AS_THE_PAPER, 1.1),  # eight frames of tongues that come apart
    real("cartoon_tauran_flame_sheet", AS_THE_PAPER, 1.5),
    real("cartoon_wesnoth_campfire", AS_THE_PAPER, 1.2),
    real("real_candle_red", AS_THE_PAPER, 1.5),
    real("real_fireplace_gif", AS_THE_PAPER, 1.2),
]
"""Rising flames that have features by the paper's ε (softer fire has next to none; of the fine
tongues of the campfire and the torch next to no flake goes down either way), the field's settings,
and how many times as many steps go down without κ at least. What embers do on their own outside
the flame adds as many to both."""


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
    vectors = feature_vectors(bright, features.sigma, study.fires.epsilon(), study.kappa)
    return np.hypot(*refine(*vectors, study.buoyancy, features.beta))


def test_figure_23_the_clamp_empties_weak_regions() -> None:
    clip = _fire_and_drum()
    # The paper's own births: by default a still drum bears none to begin with.
    features = {"preset": "paper", "epsilon": 0.5, "n": 0}
    flakes = {"alpha": 0.01, "rate": 300}
    free = run_effect(clip, {"features": features, "flakes": flakes})
    assert _share_on_the_drum(free) > 0.02, "the drum should be a nuisance before the clamp"
    strongest = max(_strength(free, i)[:, clip.width // 2 :].max() for i in range(free.clip.count))
    clamp = float(strongest) * 1.01
    clamped = run_effect(clip, {"features": {**features, "clamp": clamp}, "flakes": flakes})
    assert len(clamped.births) > 50
    assert _share_on_the_drum(clamped) == 0


@pytest.mark.parametrize(("name", "buoyancy", "least"), FIGURE_8)
def test_figure_8_without_kappa_more_flakes_go_down(
    name: str, buoyancy: dict[str, float], least: float
) -> None:
    clip = open_clip(name)

    def downward(**features: Any) -> float:
        keys = {
            "features": {"preset": "paper", **features},
            "buoyancy": {"motion": "features", **buoyancy},
            "flakes": {"rate": MANY, "scatter": 1, "bursts": 0},
        }
        return float(np.mean(run_effect(clip, keys).rows[:, VY] > 0))

    without, weighted = downward(n=0), downward()
    assert without > least * weighted, f"{without:.3f} without κ, {weighted:.3f} with it"
