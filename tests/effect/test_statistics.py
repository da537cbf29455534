"""Figures about embers, of tracks whose answer is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.effect.flakes.statistics import Figure, flake_figures
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks, fold_into_loop
from tests.support.effect import AGE, ID, LIFE, SIZE, STRETCH, VX, VY, Array, X, Y

FPS = 10.0
FRAMES = 12


def _flight(
    flake: int, start: tuple[float, float], velocity: tuple[float, float], rows: int, life: float,
    first: int = 0, size: float = 4.0, stretch: float = 1.0,
) -> list[tuple[int, Array]]:  # fmt: skip
    """Rows of a flake that flies straight, each with its frame."""
    rows_by_frame = []
    for n in range(rows):
        row = np.zeros(len(COLUMNS))
        row[[ID, SIZE, STRETCH, LIFE, VX, VY]] = flake, size, stretch, life, *velocity
        row[[X, Y]] = start[0] + velocity[0] * n / FPS, start[1] + velocity[1] * n / FPS
        row[AGE] = n / FPS + 0.01
        rows_by_frame.append((first + n, row))
    return rows_by_frame


def _birth(frame: int, row: Array) -> Array:
    columns = {"id": ID, "life": LIFE, "x": X, "y": Y, "vx": VX, "vy": VY, "size": SIZE}
    known = {name: row[column] for name, column in columns.items()} | {"t": frame / FPS, "wraps": 0}
    return np.array([known[name] for name in SPAWN_COLUMNS])


def _tracks(*flights: list[tuple[int, Array]], frames_seen: int = FRAMES) -> Tracks:
    frames: list[list[Array]] = [[] for _ in range(frames_seen)]
    for flight in flights:
        for frame, row in flight:
            frames[frame].append(row)
    tables: tuple[NDArray[np.float64], ...] = tuple(
        np.array(table).reshape(-1, len(COLUMNS)) for table in frames
    )
    spawns = np.array([_birth(*flight[0]) for flight in flights]).reshape(-1, len(SPAWN_COLUMNS))
    return Tracks.one_shot(FPS, (100, 200), 0, spawns, tables)


UP = _flight(0, (50, 30), (0, -100), 3, life=9.0)  # y 30, 20, 10; the next is 0
RIGHT = _flight(1, (70, 120), (130, -20), 3, life=9.0)  # x 70, 83, 96; the next is 109
DOWN = _flight(2, (20, 170), (0, 90), 4, life=9.0)  # y 170 .. 197; the next is 206
COLD = _flight(3, (40, 100), (0, -40), 5, life=0.5)  # the next would be older than its life
LASTING = _flight(4, (60, 100), (0, -10), 4, life=9.0, first=FRAMES - 4)  # alive in the last frame


def _figures(tracks: Tracks) -> dict[str, float]:
    return {figure.name: figure.value for figure in flake_figures(tracks)}


def test_every_end_of_life_has_its_figure() -> None:
    figures = _figures(_tracks(UP, RIGHT, DOWN, COLD))
    ends = "left by the top", "left by the sides", "fell out of the bottom", "burnt out"
    assert [figures[end] for end in ends] == [0.25] * 4


@pytest.mark.parametrize(
    ("flight", "end"),
    [
        (UP, "left by the top"), (RIGHT, "left by the sides"), (DOWN, "fell out of the bottom"),
        (COLD, "burnt out"),
    ],
)  # fmt: skip
def test_a_single_end_of_life_is_the_right_one(flight: list[tuple[int, Array]], end: str) -> None:
    assert _figures(_tracks(flight))[end] == 1.0


def test_flakes_alive_at_the_end_have_not_ended_yet() -> None:
    assert "burnt out" not in _figures(_tracks(LASTING))
    assert _figures(_tracks(LASTING, UP))["left by the top"] == 1.0


def test_counts_are_those_of_the_rows() -> None:
    figures = _figures(_tracks(UP, RIGHT, DOWN, COLD, LASTING))
    assert figures["born"] == 5
    assert figures["born, rate"] == pytest.approx(5 / (FRAMES / FPS))
    assert figures["seen for, mean"] == pytest.approx((3 + 3 + 4 + 5 + 4) / 5 / FPS)
    assert figures["alive, mean"] == pytest.approx(
        figures["born, rate"] * figures["seen for, mean"]
    )
    assert figures["alive, mean"] == pytest.approx((3 + 3 + 4 + 5 + 4) / FRAMES)
    assert figures["end higher than born"] == pytest.approx(4 / 5)
    assert figures["life, median"] == 9.0


def test_speed_is_in_heights_a_second() -> None:
    assert _figures(_tracks(UP))["speed, median"] == pytest.approx(100 / 200)


def test_size_spread_is_that_of_its_logarithm() -> None:
    sizes = (2.0, 4.0, 8.0)
    figures = _figures(
        _tracks(*(_flight(i, (50, 100), (0, -9), 2, 9.0, size=s) for i, s in enumerate(sizes)))
    )
    assert figures["size, median"] == 4.0
    assert figures["size, σ of its logarithm"] == pytest.approx(np.std(np.log(sizes)))


def test_the_spread_of_sizes_is_not_judged_where_most_are_as_small_as_can_be_shown() -> None:
    def judged(*sizes: float) -> bool:
        flights = [_flight(i, (50, 100), (0, -9), 2, 9.0, size=s) for i, s in enumerate(sizes)]
        [spread] = [f for f in flake_figures(_tracks(*flights)) if f.name.startswith("size, σ")]
        return not spread.is_in_range

    assert not judged(*[2.6] * 25, *[3.0] * 5)
    assert judged(*np.linspace(2.6, 2.8, 30))


def test_a_streak_is_measured_against_a_frames_way() -> None:
    # 100 px/s at 10 fps is 10 px a frame; 4 px stretched by 2.25 is a streak of 5 px
    figures = _figures(_tracks(_flight(0, (50, 150), (0, -100), 3, 9.0, stretch=2.25)))
    assert figures["streak, median"] == pytest.approx(5.0)
    assert figures["streak, of a frame's way"] == pytest.approx(0.5)


def test_flakes_seen_once_have_no_direction() -> None:
    one = _flight(0, (50, 100), (0, 50), 1, 9.0)
    assert _figures(_tracks(one, UP))["end higher than born"] == 1.0


def test_no_flakes_have_no_figures() -> None:
    assert flake_figures(_tracks()) == []


def test_a_flake_of_a_loop_has_one_end_even_where_its_id_is_split() -> None:
    """A flake seen longer than a short loop lasts changes its id: that is not its end."""
    long = _flight(0, (50, 190), (0, -60), 18, life=1.81)
    tracks = fold_into_loop(_tracks(long, frames_seen=2 * FRAMES), FRAMES)
    assert len(tracks.spawns) == 2
    figures = _figures(tracks)
    assert figures["burnt out"] == 1.0
    assert figures["born"] == 1


@pytest.mark.parametrize(
    ("value", "low", "high", "is_in"),
    [
        (1.0, None, None, True),
        (1.0, 1.0, None, True),
        (0.9, 1.0, None, False),
        (2.0, 1.0, 1.5, False),
    ],
)
def test_a_figure_knows_its_range(
    value: float, low: float | None, high: float | None, is_in: bool
) -> None:
    assert Figure("any", value, "", low, high).is_in_range == is_in
