"""Frames are decoded once, as far as there is room."""

from pathlib import Path

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.sources import memory


def _counting_clip(count: int) -> tuple[Clip, list[int]]:
    reads: list[int] = []

    def read(i: int) -> Pixels:
        reads.append(i)
        return np.full((4, 5, 4), i, np.float32)

    return Clip(5, 4, 24.0, count, read, (Path("fire.gif"),), "srgb", "alpha", ""), reads


def test_a_short_clip_is_decoded_once() -> None:
    clip, reads = _counting_clip(6)
    remembered = memory.remembering(clip)
    for _ in range(3):
        assert [remembered.read(i)[0, 0, 0] for i in range(6)] == list(range(6))
    assert reads == list(range(6))


def test_memory_does_not_grow_past_its_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "ROOM", 3 * 4 * 5 * 16)
    clip, reads = _counting_clip(10)
    remembered = memory.remembering(clip)
    for _ in range(2):
        assert [remembered.read(i)[0, 0, 0] for i in range(10)] == list(range(10))
    assert reads == [*range(10), *range(3, 10)]
