"""Frames are decoded once, as far as there is room."""

import numpy as np
import pytest

from fire_atlas.core.picture import Picture
from fire_atlas.sources import reader
from fire_atlas.sources.reader import FrameReader


def _counting_reader(count: int, border: int = 0) -> tuple[FrameReader, list[int]]:
    reads: list[int] = []

    def read(i: int) -> Picture:
        reads.append(i)
        picture = np.zeros((12, 15, 4), np.uint8)
        picture[border : 12 - border, border : 15 - border] = i + 1
        return picture

    return FrameReader(15, 12, 24.0, count, read, ()), reads


@pytest.mark.parametrize("border", [0, 4])
def test_a_short_clip_is_decoded_once(border: int) -> None:
    frames, reads = _counting_reader(6, border)
    remembered = reader.cached(frames)
    for _ in range(3):
        for i in range(6):
            assert np.array_equal(remembered.read(i), _counting_reader(6, border)[0].read(i))
    assert reads == list(range(6))


def test_memory_does_not_grow_past_its_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "CACHE_BYTES", 3 * 12 * 15 * 4)
    frames, reads = _counting_reader(10)
    remembered = reader.cached(frames)
    for _ in range(2):
        assert [remembered.read(i)[0, 0, 0] for i in range(10)] == list(range(1, 11))
    assert reads == [*range(10), *range(3, 10)]


def test_transparent_borders_take_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "CACHE_BYTES", 10 * 4 * 7 * 4)
    frames, reads = _counting_reader(10, border=4)
    remembered = reader.cached(frames)
    for _ in range(2):
        assert [remembered.read(i)[5, 5, 3] for i in range(10)] == list(range(1, 11))
    assert reads == list(range(10))


def test_an_empty_picture_is_remembered_as_empty() -> None:
    frames = FrameReader(5, 4, None, 1, lambda _: np.zeros((4, 5, 4), np.uint8), ())
    remembered = reader.cached(frames)
    for _ in range(2):
        assert remembered.read(0).shape == (4, 5, 4)


def test_light_without_coverage_is_remembered_as_it_is() -> None:
    light = np.zeros((4, 5, 4), np.float32)
    light[1, 2, :3] = 0.5, 0.25, 0.125
    remembered = reader.cached(FrameReader(5, 4, None, 1, lambda _: light.copy(), ()))
    for _ in range(2):
        assert np.array_equal(remembered.read(0), light)
