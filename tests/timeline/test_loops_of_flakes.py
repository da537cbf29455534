"""Flakes of a loop: as if the clip had always been playing, and would for ever."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.effect.flakes import appearance
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.pipeline.animation.layers import draw
from fire_atlas.recipe.effect import Flakes
from tests.support.clips import SAMPLES, campfire, open_clip, piece, real
from tests.support.effect import run_effect

KEYS: dict[str, Any] = {"flakes": {"rate": 150, "life": [0.3, 2.6]}}


def _unfolded(clip: Clip, monkeypatch: pytest.MonkeyPatch) -> tuple[Tracks, list[Any]]:
    """Return the tracks of a loop, and the rows of every frame of one long flight."""
    flown: list[Any] = []
    fold = appearance.track_rows

    def remembering(*args: Any) -> Any:
        flown.extend(fold(*args))
        return list(flown)

    monkeypatch.setattr("fire_atlas.pipeline.animation.simulate.track_rows", remembering)
    effect = run_effect(clip, KEYS)
    return effect.tracks, flown


def _playing_for_ever(flown: list[Any], count: int, n: int) -> Any:
    """Rows of frame ``n`` where births have been repeated every ``count`` frames for ever.

    A flake born k periods ago is where one flight, begun at 0, has it k periods later.
    """
    parts = [flown[later] for later in range(n % count, len(flown), count)]
    return np.concatenate(parts)


def _sorted(rows: Any) -> Any:
    body = rows[:, 1:]
    return body[np.lexsort(body.T)]


@pytest.mark.parametrize("count", [48, 13])
def test_frame_0_is_frame_n_of_a_fire_that_has_always_been_playing(
    monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    clip = replace(campfire(120), count=count, loop=True)
    tracks, flown = _unfolded(clip, monkeypatch)
    for n in (0, 1, count // 2, count - 1):
        steady = _playing_for_ever(flown, count, n + count)
        assert _sorted(steady).tobytes() == _sorted(tracks.frames[n]).tobytes()
    flakes = Flakes(**KEYS["flakes"])
    again = _playing_for_ever(flown, count, count)
    order = np.lexsort(again[:, 1:].T)
    mine = tracks.frames[0][np.lexsort(tracks.frames[0][:, 1:].T)]
    one, other = (draw(flakes, rows, clip.height, clip.width) for rows in (again[order], mine))
    assert one.planes.tobytes() == other.planes.tobytes()


@pytest.mark.parametrize("name", ["candle", "campfire", real("real_candle_red")])
def test_the_velocity_field_at_the_seam_changes_as_it_does_elsewhere(name: str) -> None:
    clip = open_clip(name)
    if name in SAMPLES:  # they close, but for a piece of them
        clip = piece(clip, 0, 2 * clip.count // 3)
    field = run_effect(clip).analysis.field
    planes = np.stack([field.u, field.v])
    changes = [np.sqrt(np.mean((a - b) ** 2)) for a, b in pairwise(planes.swapaxes(0, 1))]
    seam = np.sqrt(np.mean((planes[:, -1] - planes[:, 0]) ** 2))
    assert seam <= 1.5 * np.percentile(changes, 95)
