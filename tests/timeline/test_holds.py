"""Held frames, of art on twos or of footage with doubled frames, are found and kept as a rhythm."""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.holds import Holds
from fire_atlas.vision.loop_figures import loop_figures
from tests.support.clips import clip_of
from tests.timeline.moving import Notes, arranged, circling, turbulent

ON_TWOS = [2] * 20
ON_THREES = [3] * 20
RHYTHMS = {
    "on twos": ON_TWOS,
    "on twos from an odd frame": [1, *ON_TWOS],
    "on threes": ON_THREES,
    "on threes, one frame late": [2, *ON_THREES],
    "every fourth frame doubled": [1, 1, 1, 2] * 8,
    "every fourth frame doubled, at the other parity": [1, 1, 2, 1] * 8,
    "every fifth frame doubled, at both parities": [1, 1, 1, 2] * 8 + [1] + [1, 1, 1, 2] * 4,
    "on ones, then on twos": [1] * 15 + [2] * 10,
    "on twos, then on ones": [2] * 9 + [1] * 14,
}


def held(rhythm: Sequence[int], noise: float = 0.01, fps: float = 24.0) -> Clip:
    """Return a clip that shows its k-th drawing for ``rhythm[k]`` frames, all with some noise."""
    drawings, chance = turbulent(len(rhythm)), np.random.default_rng(3)
    frames = []
    for k, length in enumerate(rhythm):
        for _ in range(length):
            frame = drawings.read(k)
            grain = chance.normal(0, noise, frame.shape[:2])
            frames.append(np.clip(frame + grain[..., None], 0, 1).astype(np.float32))
    return clip_of(frames, fps)


def runs(clip: Clip) -> list[int]:
    """Return for how many frames each drawing of ``clip`` is shown, by its holds."""
    with Workers(2) as workers:
        holds = Holds.of(clip, workers)
    return [len(list(same)) for _, same in groupby(holds.first.tolist())]


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.02])
@pytest.mark.parametrize("name", RHYTHMS)
def test_the_rhythm_of_a_clip_is_found(name: str, noise: float) -> None:
    rhythm = RHYTHMS[name]
    assert runs(held(rhythm, noise)) == rhythm


def test_a_pause_and_a_still_clip_are_not_held() -> None:
    pause = [1] * 8 + [20] + [1] * 8
    assert runs(held(pause)) == [1] * sum(pause)
    assert runs(held([12])) == [1] * 12


def test_a_fire_that_slows_down_is_not_held() -> None:
    """Its steps become 20 times as short, one after the other."""
    drawings = turbulent(2)
    one, other = drawings.read(0), drawings.read(1)
    share = np.cumsum(np.concatenate([np.geomspace(1, 0.05, 12), np.geomspace(0.05, 1, 12)]))
    share /= share[-1]
    clip = clip_of([np.asarray(one + (other - one) * np.float32(each)) for each in share])
    assert runs(clip) == [1] * 24


@pytest.mark.parametrize("rhythm", [ON_TWOS, ON_THREES])
@pytest.mark.parametrize("ratio", [2, 3])
def test_at_a_higher_rate_drawings_stay_for_as_long(rhythm: list[int], ratio: int) -> None:
    clip, notes = held(rhythm, 0.0, fps=12.0), Notes()
    made = arranged(clip, notes, loop="none", fps=12.0 * ratio)
    shown = [made.read(i).tobytes() for i in range(made.count)]
    lengths = [len(list(same)) for _, same in groupby(shown)]
    assert lengths[1:-1] == [ratio * n for n in rhythm[1:-1]]
    assert set(shown) == {clip.read(i).tobytes() for i in range(clip.count)}
    assert any("holds each drawing" in note for note in notes.notes)


@pytest.mark.parametrize("rhythm", [[1, 1, 1, 2] * 8, [1, 1, 2, 1] * 8])
def test_doubled_frames_stay_a_pair_and_others_get_frames_in_between(rhythm: list[int]) -> None:
    clip = held(rhythm, 0.0)
    made = arranged(clip, loop="none", fps=48)
    shown = [made.read(i).tobytes() for i in range(made.count)]
    lengths = [len(list(same)) for _, same in groupby(shown)]
    # A pair stays for four frames; of the others, each is followed by one in between.
    wanted = [n for length in rhythm for n in ([4] if length == 2 else [1, 1])]
    assert lengths[:-2] == wanted[: len(lengths) - 2]


KEPT = ["on twos", "on twos from an odd frame", "on threes", "on threes, one frame late"]


def shown_runs(made: Clip) -> list[int]:
    """Return for how many frames each picture of a loop is shown, beginning with a whole one."""
    shown = [made.read(i).tobytes() for i in range(made.count)]
    begin = next(i for i in range(made.count) if shown[i] != shown[i - 1])
    return [len(list(same)) for _, same in groupby(shown[begin:] + shown[:begin])]


@pytest.mark.parametrize("name", KEPT)
@pytest.mark.parametrize("keys", [{}, {"overlap": 6}, {"frames": 30}])
def test_a_cut_tears_no_hold(name: str, keys: dict[str, Any]) -> None:
    rhythm = RHYTHMS[name]
    made = arranged(held(rhythm, 0.0), **keys)
    assert made.loop and set(shown_runs(made)) == {rhythm[3]}


@pytest.mark.parametrize("rhythm", [ON_TWOS, ON_THREES])
def test_a_cross_fade_of_a_clip_that_begins_with_a_whole_hold_tears_none(rhythm: list[int]) -> None:
    assert set(shown_runs(arranged(held(rhythm, 0.0), loop="crossfade"))) == {rhythm[0]}


@pytest.mark.parametrize("name", [name for name in RHYTHMS if "doubled" in name])
def test_a_cut_leaves_doubled_frames_a_pair(name: str) -> None:
    made = arranged(held(RHYTHMS[name], 0.0))
    lengths = shown_runs(made)
    assert made.loop and set(lengths) == {1, 2}
    assert lengths.count(2) == pytest.approx(made.count / 5, abs=2)


@pytest.mark.parametrize("name", KEPT)
def test_the_seam_of_a_clip_that_holds_frames_is_not_seen(name: str) -> None:
    made = arranged(held(RHYTHMS[name], 0.0))
    figures = loop_figures(made.read(i) for i in range(made.count))
    assert 0.8 <= figures.seam_ratio <= 1.25


@pytest.mark.parametrize("late", [0, 1])
def test_a_loop_on_twos_loops_as_it_is(late: int) -> None:
    """Whatever the parity of the steps that are looked at first."""
    drawings = circling(16, 16)
    clip = clip_of([drawings.read((i + late) // 2 % 16) for i in range(32)])
    notes = Notes()
    made = arranged(clip, notes)
    assert made.loop and made.count == 32, notes.notes
    assert any("loops as it is" in note for note in notes.notes)


@pytest.mark.parametrize("name", KEPT)
def test_there_and_back_every_drawing_is_held_for_as_long(name: str) -> None:
    rhythm = RHYTHMS[name]
    made = arranged(held(rhythm, 0.0), loop="pingpong")
    shown = [made.read(i).tobytes() for i in range(made.count)]
    lengths = [len(list(same)) for _, same in groupby(shown)]
    assert lengths == rhythm + rhythm[-2:0:-1]


@pytest.mark.parametrize("frames", [21, 33, 60, 61])
def test_any_length_can_still_be_had(frames: int) -> None:
    made = arranged(held(ON_TWOS, 0.0), frames=frames)
    assert made.loop and made.count == frames
