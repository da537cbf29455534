"""Loops: what flies past the end is seen at the beginning, once, under one id."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.tracks import (
    COLUMNS,
    SPAWN_COLUMNS,
    Tracks,
    first_frames,
    fold_into_loop,
)

FPS = 10.0
LOOP = 6

Table = NDArray[np.float64]


def _flight(flake: int, first: int, frames: int) -> dict[int, list[float]]:
    """Rows of a flake that moves one px a frame, by frame."""
    rows = {}
    for n in range(first, first + frames):
        row = dict.fromkeys(COLUMNS, 0.0) | {"id": flake, "x": float(n), "vx": FPS}
        rows[n] = [row[name] for name in COLUMNS]
    return rows


def _folded(births: list[dict[str, float]], tables: list[Table], count: int = LOOP) -> Tracks:
    spawns = np.array([[born[name] for name in SPAWN_COLUMNS] for born in births])
    return fold_into_loop(Tracks.one_shot(FPS, (100, 100), 0, spawns, tables), count)


def _fold(*flights: tuple[int, int, int]) -> Tracks:
    """Fold flights (id, first frame, frames seen) onto a loop of ``LOOP`` frames."""
    tables: list[list[list[float]]] = [[] for _ in range(5 * LOOP)]
    births = []
    for flake, first, frames in flights:
        for n, row in _flight(flake, first, frames).items():
            tables[n].append(row)
        born = dict.fromkeys(SPAWN_COLUMNS, 0.0) | {
            "id": flake,
            "t": first / FPS,
            "life": frames / FPS,
        }
        births.append(born)
    return _folded(births, [np.array(table).reshape(-1, len(COLUMNS)) for table in tables])


def test_a_flake_that_outlives_the_end_goes_on_at_the_beginning_under_its_id() -> None:
    tracks = _fold((3, 4, 4))
    assert [[row[0] for row in frame] for frame in tracks.frames] == [[3], [3], [], [], [3], [3]]
    assert tracks.spawns[0, SPAWN_COLUMNS.index("wraps")] == 1


def test_a_flake_that_dies_in_time_does_not_wrap() -> None:
    tracks = _fold((0, 1, 4))
    assert [len(frame) for frame in tracks.frames] == [0, 1, 1, 1, 1, 0]
    assert tracks.spawns[0, SPAWN_COLUMNS.index("wraps")] == 0


def test_a_flake_that_leaves_in_time_does_not_wrap_though_it_could_live_longer() -> None:
    born = dict.fromkeys(SPAWN_COLUMNS, 0.0) | {"id": 0, "t": 0.1, "life": 9.0}
    tables = [np.array([_flight(0, 0, 3)[n]] if n < 3 else []).reshape(-1, len(COLUMNS))
              for n in range(3 * LOOP)]  # fmt: skip
    tracks = _folded([born], tables)
    assert tracks.spawns[0, SPAWN_COLUMNS.index("wraps")] == 0


def test_in_a_loop_of_one_frame_every_row_has_an_id_of_its_own() -> None:
    born = dict.fromkeys(SPAWN_COLUMNS, 0.0) | {"life": 1.0}
    tables = [np.array([_flight(0, 0, 4)[n]]) for n in range(4)]
    tracks = _folded([born], tables, 1)
    (frame,) = tracks.frames
    assert len(np.unique(frame[:, 0])) == len(frame) == len(tracks.spawns) == 4


@pytest.mark.parametrize("seen", [5, 6, 7, 11, 12, 13, 17])
def test_no_id_is_in_a_frame_twice_and_every_row_is_kept(seen: int) -> None:
    frames = _fold((0, 0, seen), (1, 3, seen)).frames
    assert sum(map(len, frames)) == 2 * seen
    for frame in frames:
        assert len(set(frame[:, 0])) == len(frame)


@pytest.mark.parametrize("seen", [6, 7, 13, 17])
def test_the_same_id_in_neighbouring_frames_is_the_same_flake(seen: int) -> None:
    frames = _fold((0, 0, seen), (1, 5, seen)).frames
    for here, there in zip(frames, [*frames[1:], frames[0]], strict=True):
        for row in here:
            for following in there[there[:, 0] == row[0]]:
                assert following[1] == row[1] + 1


def test_every_id_has_a_spawn() -> None:
    tracks = _fold((0, 0, 14), (1, 2, 3))
    assert set(tracks.spawns[:, 0]) == set(np.concatenate(tracks.frames)[:, 0])


@pytest.mark.parametrize("seen", [5, 6, 7, 13, 17])
@pytest.mark.parametrize("count", [1, 2, LOOP])
def test_every_row_knows_its_flight_and_its_moment_there(count: int, seen: int) -> None:
    """Whatever its id: the flakes are recognised by their place, which moves by one px a frame."""
    tables, births = [list[list[float]]() for _ in range(24)], []
    for flake, first in ((0, 0), (1, 5)):
        for n, row in _flight(flake, first, seen).items():
            row[COLUMNS.index("y")] = flake
            tables[n].append(row)
        births.append(dict.fromkeys(SPAWN_COLUMNS, 0.0) | {"id": flake})
    tracks = _folded(births, [np.array(t).reshape(-1, len(COLUMNS)) for t in tables], count)
    rows = zip(tracks.frames, tracks.flights, tracks.flight_frames, strict=True)
    for frame, flights, moments in rows:
        column = dict(zip(COLUMNS, frame.T, strict=True))
        assert flights.tolist() == column["y"].tolist()
        assert moments.tolist() == (column["x"] - 5 * column["y"]).tolist()


def test_what_is_cut_off_leaves_flights_as_they_began() -> None:
    tables = [list[list[float]]() for _ in range(9)]
    for flake, first, frames in ((0, 1, 5), (1, 3, 4), (2, 6, 2)):
        for n, row in _flight(flake, first, frames).items():
            tables[n].append(row)
    spawns = np.zeros((3, len(SPAWN_COLUMNS)))
    spawns[:, 0] = range(3)
    whole = Tracks.one_shot(
        FPS, (9, 9), 0, spawns, [np.array(t).reshape(-1, len(COLUMNS)) for t in tables]
    )
    cut = first_frames(whole, 5)
    assert [each.tolist() for each in cut.flights] == [[], [0], [0], [0, 1], [0, 1]]
    assert [each.tolist() for each in cut.flight_frames] == [[], [0], [1], [2, 0], [3, 1]]
    assert cut.spawns[:, 0].tolist() == [0, 1]


def test_a_looping_field_is_continuous_across_its_end() -> None:
    field = FieldRecord.empty(4, (2, 2), 4, FPS, loop=True)
    for i in range(4):
        field.u[i] = float(i)
    assert field.interpolated(0.05)[0, 0, 0] == 0.0  # half a frame later: flow leads onwards
    assert field.interpolated(0.40)[0, 0, 0] == pytest.approx(1.5)  # between 3 and 0
    assert field.interpolated(0.45)[0, 0, 0] == pytest.approx(0.0)
    for t in (0.0, 0.13, 0.37):
        assert np.allclose(field.interpolated(t), field.interpolated(t + 0.4), atol=1e-5)


def test_eddies_with_a_period_repeat() -> None:
    eddies = Eddies.random(4, 30, 10.0, period=1.7)
    for a, b in zip(eddies.velocity(0.4, (9, 9)), eddies.velocity(2.1, (9, 9)), strict=True):
        assert np.allclose(a, b, atol=1e-3)
