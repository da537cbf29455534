"""Track files say what the tracks hold, rounded, in strict JSON and plain CSV."""

import csv
import io
import json
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from fire_atlas.core.decimals import plain, table_text
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.tables import TRACKS
from fire_atlas.formats.tracks.columns import DECIMALS
from fire_atlas.recipe.output import FlakeTrackName
from tests.support.any_tracks import any_tracks


def some_tracks(flakes: int = 5, frames: int = 3) -> Tracks:
    """Random flakes; one fewer in every next frame, so that the last may be empty."""
    rng = np.random.default_rng(7)
    spawns = rng.normal(0, 50, (flakes, len(SPAWN_COLUMNS)))
    spawns[:, 0], spawns[:, -1] = np.arange(flakes), np.arange(flakes) % 2
    tables = [rng.normal(0, 50, (max(flakes - i, 0), len(COLUMNS))) for i in range(frames)]
    for table in tables:
        table[:, 0] = np.arange(len(table))
    return replace(Tracks.one_shot(24.0, (640, 480), 7, spawns, tables), loop=True)


def strict_json(data: bytes) -> Any:
    def refuse(constant: str) -> NoReturn:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(data, parse_constant=refuse)


def written_json(tracks: Tracks) -> Any:
    return strict_json(TRACKS["json"].write("campfire", tracks).data)


def rounding_of(columns: tuple[str, ...]) -> NDArray[np.float64]:
    """Half a step of each column's last decimal, and a hair for the sum."""
    return np.array([0.5001 * 10.0 ** -DECIMALS[column] for column in columns])


def test_the_json_tells_what_it_is() -> None:
    written = written_json(some_tracks())
    frames, spawns = written.pop("frames"), written.pop("spawns")
    assert (len(frames), len(spawns)) == (3, 5)
    assert written == {
        "format": "fire-atlas/tracks",
        "version": 2,
        "name": "campfire",
        "fps": 24,
        "frame_count": 3,
        "loop": True,
        "rounds": 1,
        "seed": 7,
        "size": [640, 480],
        "space": "source pixels, x right, y down, (0,0) top-left corner",
        "units": "px, px/s, s, rad",
        "light": {"sum": "linear", "curve": "x/(1+x)", "halo": [0.004, 2.5]},
        "columns": list(COLUMNS),
    }


def test_json_rows_are_the_flakes_of_each_frame() -> None:
    tracks = some_tracks()
    for index, frame in enumerate(written_json(tracks)["frames"]):
        assert frame["i"] == index
        assert frame["t"] == pytest.approx(index / 24, abs=1e-6)
        error = np.abs(np.array(frame["rows"]) - tracks.frames[index])
        assert (error <= rounding_of(COLUMNS)).all()
        assert all(type(row[0]) is int for row in frame["rows"])


def test_json_spawns_are_objects() -> None:
    tracks = some_tracks()
    spawns = written_json(tracks)["spawns"]
    assert [tuple(spawn) for spawn in spawns] == [SPAWN_COLUMNS] * 5
    assert [spawn["wraps"] for spawn in spawns] == [False, True, False, True, False]
    assert [type(spawn["id"]) for spawn in spawns] == [int] * 5
    error = np.abs(np.array([list(spawn.values()) for spawn in spawns]) - tracks.spawns)
    assert (error <= rounding_of(SPAWN_COLUMNS)).all()


def test_the_csv_holds_the_numbers_of_the_json() -> None:
    tracks = some_tracks()
    text = TRACKS["csv"].write("campfire", tracks).data.decode()
    header, *rows = csv.reader(io.StringIO(text))
    assert header == ["frame", "t", *COLUMNS]
    frames = written_json(tracks)["frames"]
    expected = [[f["i"], f["t"], *row] for f in frames for row in f["rows"]]
    assert [[float(cell) for cell in row] for row in rows] == expected


@given(tracks=any_tracks())
def test_the_csv_gives_every_row_back(tracks: Tracks) -> None:
    text = TRACKS["csv"].write("campfire", tracks).data.decode()
    read = np.array(list(csv.reader(io.StringIO(text)))[1:], np.float64)
    rows = np.concatenate(tracks.frames)
    frame = np.repeat(np.arange(len(tracks.frames)), [len(each) for each in tracks.frames])
    read = read.reshape(-1, 2 + len(COLUMNS))
    assert read[:, 0].tolist() == frame.tolist()
    assert read[:, 1] == pytest.approx(frame / tracks.fps, abs=1e-6)
    assert (np.abs(read[:, 2:] - rows) <= rounding_of(COLUMNS)).all()


@pytest.mark.parametrize("flakes", [0, 1])
def test_frames_without_flakes_are_empty(flakes: int) -> None:
    tracks = some_tracks(flakes)
    written = written_json(tracks)
    assert [len(frame["rows"]) for frame in written["frames"]] == [flakes, 0, 0]
    assert len(written["spawns"]) == flakes
    assert TRACKS["csv"].write("campfire", tracks).data.count(b"\n") == 1 + flakes


@pytest.mark.parametrize("name", ["json", "csv"])
def test_files_are_named_after_the_build(name: FlakeTrackName) -> None:
    file = TRACKS[name].write("campfire", some_tracks())
    assert (file.name, file.role) == (f"campfire.flakes.{name}", "tracks")


@pytest.mark.parametrize("name", ["json", "csv"])
@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_what_is_no_number_is_a_fault_of_ours(name: FlakeTrackName, broken: float) -> None:
    tracks = some_tracks()
    tracks.frames[1][2, 4] = broken
    with pytest.raises(AssertionError, match="frame 1, row 2: vy"):
        TRACKS[name].write("campfire", tracks)


@given(
    table=arrays(
        np.float64, st.tuples(st.integers(0, 9), st.just(3)), elements=st.floats(-1e9, 1e9)
    ),
    decimals=st.tuples(*[st.integers(0, 6)] * 3),
)
def test_every_number_is_the_nearest_with_its_decimals(
    table: NDArray[np.float64], decimals: tuple[int, int, int]
) -> None:
    lines = table_text(table, decimals, "[", ",", "]\n").splitlines()
    rows = np.array([strict_json(line) for line in lines]).reshape(table.shape)
    step = 10.0 ** -np.array(decimals)
    assert (np.abs(rows - table) <= 0.5 * step + 1e-6).all()


def test_numbers_carry_no_needless_characters() -> None:
    table = np.array([[0.0, -0.0004, 12.5], [-7.0, 1.25, 100.0], [1203.4, -0.5, 0.001]])
    text = table_text(table, [0, 3, 3], "", " ", "\n")
    assert text == b"0 0.0 12.5\n-7 1.25 100.0\n1203 -0.5 0.001\n"


def test_a_whole_number_is_written_plain() -> None:
    assert (repr(plain(24.0, 3)), repr(plain(1000 / 24, 3))) == ("24", "41.667")
