"""What the paper's own motion does to be seen: flakes driven by features, and a blurred flame."""

from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Pixels, as_plane, encode_bytes
from fire_atlas.pipeline.animation.layers import flame_of
from tests.support.clip_motion import FLAME, MOVES, dis_flow
from tests.support.clips import open_clip, piece, real
from tests.support.effect import ID, Array, EffectRun, X, Y, run_effect

ONCE = {"timeline": {"loop": "none"}}


def _clip(name: str) -> Clip:
    clip = open_clip(name)
    return piece(clip, 0, min(48, clip.count))


def _shed(name: str, force: float | str) -> EffectRun:
    keys: dict[str, Any] = {
        "buoyancy": {"motion": "features", "feature_force": force},
        "flakes": {"rate": 100, "bursts": 0, "class": "campfire"},
    }
    return run_effect(_clip(name), {**keys, **ONCE})


@pytest.mark.parametrize(
    "name", ["campfire", "cartoon", "torch", real("real_fireplace_gif"), real("sim_unity_flame03")]
)
def test_the_force_of_features_moves_flakes(name: str) -> None:
    driven, free = _shed(name, "auto"), _shed(name, 0.0)
    moved: dict[float, float] = {}  # how far each flake is where it was seen last
    for one, other in zip(driven.tracks.frames, free.tracks.frames, strict=True):
        flakes, i, j = np.intersect1d(one[:, ID], other[:, ID], return_indices=True)
        apart = np.hypot(*(one[i][:, [X, Y]] - other[j][:, [X, Y]]).T)
        moved.update(zip(flakes.tolist(), apart.tolist(), strict=True))
    assert np.mean(list(moved.values())) >= 0.04 * driven.clip.height


@pytest.mark.parametrize("name", ["campfire", "fireball", real("real_fireplace_gif")])
def test_the_default_blur_of_the_flame_is_visible_where_it_moves(name: str) -> None:
    effect = run_effect(
        _clip(name), {"motion_blur": {"flame": True}, "flakes": {"rate": 0}, **ONCE}
    )
    changes: list[Array] = []
    for i in range(2, effect.clip.count - 1, 6):
        sharp = effect.clip.picture(i)
        blurred = flame_of(i, sharp, effect.simulated, effect.recipe)
        moves = np.hypot(*np.moveaxis(dis_flow(effect.clip, i), -1, 0)) > MOVES
        moves &= effect.clip.brightness(i) > FLAME
        changes.append(np.abs(_shown(as_light(sharp)) - _shown(as_light(blurred)))[moves])
    assert np.concatenate(changes).mean() >= 3


def _shown(pixels: Pixels) -> Array:
    """Return pixels as they are shown on black, 0..255."""
    return encode_bytes(as_plane(pixels[..., :3])).astype(np.float64)
