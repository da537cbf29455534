"""Frames are decoded once, as far as there is room."""

import numpy as np
import pytest

from fire_atlas.sources import memory
from fire_atlas.sources.picture import Picture
from fire_atlas.sources.reel import Reel


def _counting_reel(count: int) -> tuple[Reel, list[int]]:
    reads: list[int] = []

    def read(i: int) -> Picture:
        reads.append(i)
        return np.full((4, 5, 4), i, np.uint8)

    return Reel(5, 4, 24.0, count, read, ()), reads


def test_a_short_reel_is_decoded_once() -> None:
    reel, reads = _counting_reel(6)
    remembered = memory.remembering(reel)
    for _ in range(3):
        assert [remembered.read(i)[0, 0, 0] for i in range(6)] == list(range(6))
    assert reads == list(range(6))


def test_memory_does_not_grow_past_its_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "ROOM", 3 * 4 * 5 * 4)
    reel, reads = _counting_reel(10)
    remembered = memory.remembering(reel)
    for _ in range(2):
        assert [remembered.read(i)[0, 0, 0] for i in range(10)] == list(range(10))
    assert reads == [*range(10), *range(3, 10)]


def test_nobody_can_spoil_what_is_remembered() -> None:
    picture = memory.remembering(_counting_reel(2)[0]).read(1)
    with pytest.raises(ValueError, match="read-only"):
        picture[...] = 7
