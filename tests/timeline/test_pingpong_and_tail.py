"""Forwards and backwards; and what comes after a clip that plays once."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.errors import RecipeError
from tests.support.clips import campfire, clip_of
from tests.support.effect import VY, run_effect
from tests.timeline.moving import arranged, blob, moving, steps


def test_a_pingpong_shows_neither_end_twice() -> None:
    clip = moving(lambda i: (20 + 3.0 * i, 48), 9)
    made = arranged(clip, loop="pingpong")
    assert made.loop and made.count == 16
    order = [0, 1, 2, 3, 4, 5, 6, 7, 8, 7, 6, 5, 4, 3, 2, 1]
    assert all(np.array_equal(made.read(i), clip.read(n)) for i, n in enumerate(order))
    assert steps(made).min() > 0.5 * np.median(steps(made))


def test_a_pingpong_of_fewer_frames_turns_earlier() -> None:
    clip = moving(lambda i: (20 + 3.0 * i, 48), 9)
    made = arranged(clip, loop="pingpong", frames=6)
    assert [int(np.argmax(made.read(i)[48, :, 3])) for i in (0, 3, 5)] == [
        int(np.argmax(clip.read(n)[48, :, 3])) for n in (0, 3, 1)
    ]


def test_a_pingpong_longer_than_there_and_back_is_refused() -> None:
    with pytest.raises(RecipeError, match="at most 16"):
        arranged(moving(lambda i: (20 + 3.0 * i, 48), 9), loop="pingpong", frames=18)


@pytest.mark.parametrize("fps", [None, 60.0])
def test_sparks_of_a_pingpong_rise_while_the_flame_runs_backwards(fps: float | None) -> None:
    timeline: dict[str, Any] = {"loop": "pingpong", **({"fps": fps} if fps else {})}
    keys = {"timeline": timeline, "flakes": {"rate": 300, "bursts": 0}}
    effect = run_effect(replace(campfire(160, 24), loop=False), keys)
    half = effect.clip.count // 2
    there, back = (np.concatenate(effect.tracks.frames[part])[:, VY]
                   for part in (slice(0, half), slice(half, None)))  # fmt: skip
    assert np.median(back) < 0.6 * np.median(there) < 0


def test_the_last_frame_fades_in_the_tail_and_then_nothing_is_left() -> None:
    clip = clip_of([blob(48, 48, light=1 - 0.05 * i) for i in range(12)])
    made = arranged(clip, loop="none", tail=True)
    light = [float(made.read(i).sum()) for i in range(made.count)]
    assert made.count == 12 + 25 and made.tail == 25, "a flake lives up to 1 s"
    assert all(np.array_equal(made.read(i), clip.read(i)) for i in range(12))
    assert all(a >= b for a, b in pairwise(light))
    assert light[12] > 0.5 * light[11] and light[20] == 0


def test_a_tail_is_no_longer_than_the_recipe_allows() -> None:
    assert arranged(clip_of([blob(48, 48)] * 12), loop="none", tail=0.5).count == 24


def test_an_opaque_scene_stays_in_the_tail() -> None:
    frames = [np.full((32, 32, 4), [0.2, 0.1, 0.1, 1], np.float32)] * 12
    made = arranged(clip_of(frames, matte="none"), loop="none", tail=True)
    assert np.array_equal(made.read(made.count - 1), frames[0])


def test_a_tail_after_a_loop_is_refused_with_advice() -> None:
    clip = moving(lambda i: (48, 48), 12)
    with pytest.raises(RecipeError, match=r"use timeline\.loop: none"):
        arranged(clip, tail=True)
