"""Held frames, of art on twos or of footage with doubled frames, are found and kept as a rhythm."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.holds import Holds
from tests.support.clips import clip_of
from tests.timeline.moving import Notes, arranged, turbulent

ON_TWOS = [2] * 20
ON_THREES = [3] * 16
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
