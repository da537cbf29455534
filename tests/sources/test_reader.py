"""Formats that only play forwards: they are decoded once, and little is kept in memory."""

import tracemalloc
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from fire_atlas.core.picture import Picture
from fire_atlas.sources.reader import SequentialDecoder
from tests.support import synthetic_fire as fire

FILE = Path("fire.gif")


class Counter:
    """Frames that hold their own number, and how often each was decoded."""

    def __init__(self, count: int) -> None:
        self.decoded = [0] * count

    def play(self) -> Generator[Picture]:
        for i in range(len(self.decoded)):
            self.decoded[i] += 1
            yield np.full((1, 1, 3), i, np.uint8)


def test_each_frame_is_decoded_once_and_only_when_it_is_needed() -> None:
    counter = Counter(200)
    frames = SequentialDecoder(FILE, counter.play)
    assert frames.read(99)[0, 0, 0] == 99
    assert counter.decoded == [1] * 100 + [0] * 100
    for i in [0, 199, *range(200), *reversed(range(200))]:
        assert frames.read(i)[0, 0, 0] == i
    assert counter.decoded == [1] * 200


def test_a_decoder_that_failed_starts_afresh() -> None:
    counter = Counter(3)
    frames = SequentialDecoder(FILE, counter.play)
    with pytest.raises(StopIteration):
        frames.read(3)
    assert frames.read(2)[0, 0, 0] == 2


@pytest.mark.parametrize("ending", ["gif", "webp"])
def test_memory_does_not_grow_with_the_clip(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Of these little frames there would be room for hundreds.
    monkeypatch.setattr("fire_atlas.sources.frame_store.MEMORY_BYTES", 2 << 20)

    def peak(count: int) -> int:
        frames = fire.fires(count, 160, 160, hard=True)
        for i, frame in enumerate(frames):
            frame[i // 160, i % 160] = 255  # no two are alike, so none is left out
        path = fire.write_animation(tmp_path / f"{count}.{ending}", frames, duration=40)
        tracemalloc.start()
        clip = fire.open_clip(path)
        assert clip.count == count
        for i in range(clip.count):
            clip.read(i)
        highest = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return highest

    peak(3)  # modules and tables of the first clip stay in memory
    assert peak(240) < 1.2 * peak(60)
