"""Point caches, read by the rules of the importers that take them."""

import json
from collections import defaultdict
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks, fold_into_loop
from fire_atlas.formats.tables import TRACKS
from tests.support.any_tracks import any_tracks, flights_of

WIDTH, HEIGHT, FPS = 640, 480, 24
FRAMES = 12
PERIOD = FRAMES / FPS

PROPERTIES = [
    "position.x", "position.y", "position.z", "velocity.x", "velocity.y", "velocity.z", "color.r",
    "color.g", "color.b", "color.a", "size", "angle", "lifetime", "spawnTime", "flakeId",
]  # fmt: skip


def flying(births: list[tuple[float, float]], *, loop: bool = True, first_id: int = 0) -> Tracks:
    """Flakes born at t that live so long, s; they rise, and brighten until half their life."""
    spawns, tables = [], [list[list[float]]() for _ in range(FRAMES * (2 if loop else 1))]
    for i, (t, life) in enumerate(births):
        x, y, vx, vy, size = 300.0 + 10 * i, 400.0 - i, 12.0 + i, -96.0, 4.8
        spawns.append([first_id + i, t, life, x, y, vx, vy, size, 0])
        for frame in range(len(tables)):
            age = frame / FPS - t
            if 0 <= age < life and age < PERIOD - 1 / FPS:
                light = 1 - abs(2 * age / life - 1)
                tables[frame].append([
                    first_id + i, x + vx * age, y + vy * age, vx, vy, size, 2.0,
                    np.arctan2(vy, vx), 6.0, 0.5, 0.1, light, age, life, 0, 0.0, 0.6,
                ])  # fmt: skip
    frames = [np.array(table).reshape(-1, len(COLUMNS)) for table in tables]
    table = np.array(spawns).reshape(-1, len(SPAWN_COLUMNS))
    tracks = Tracks.one_shot(FPS, (WIDTH, HEIGHT), 7, table, frames)
    return fold_into_loop(tracks, FRAMES) if loop else tracks


BIRTHS = [(0.0, 0.2), (0.1, 0.3), (0.35, 0.4), (0.4, 0.05), (0.44, 0.3)]


def pcache(tracks: Tracks) -> dict[str, NDArray[np.float64]]:
    """Read a point cache as Unity does, and refuse what it would misread."""
    file = TRACKS["pcache"].write("fire", tracks)
    assert file.name == "fire.flakes.pcache"
    assert b"\r" not in file.data and b"\t" not in file.data
    assert file.data.isascii() and file.data.endswith(b"\n")
    lines = file.data.decode("ascii").split("\n")[:-1]
    assert lines[:2] == ["pcache", "format ascii 1.0"]
    end = lines.index("end_header")
    words = [line.split(" ") for line in lines[2:end]]
    words = [each for each in words if each[0] != "comment"]
    assert words[0][0] == "elements" and len(words[0]) == 2
    assert all(each[:2] == ["property", "float"] and len(each) == 3 for each in words[1:])
    names, rows = [each[2] for each in words[1:]], lines[end + 1 :]
    assert len(rows) == int(words[0][1])
    points = np.array([[float(cell) for cell in row.split(" ")] for row in rows])
    return dict(zip(names, points.reshape(-1, len(names)).T, strict=True))


def hjson(tracks: Tracks) -> list[list[list[float]]]:
    """Read a cache as HoudiniNiagara does; return the points of each frame."""
    file = TRACKS["hjson"].write("fire", tracks)
    assert file.name == "fire.flakes.hjson"
    document = json.loads(file.data)
    header, frames = document["header"], document["cache_data"]["frames"]
    assert list(document) == ["header", "cache_data"]
    names, sizes = header["attrib_name"], header["attrib_size"]
    assert names == ["id", "P", "v", "Cd", "alpha", "pscale", "age", "life"]
    assert sizes == [1, 3, 3, 3, 1, 1, 1, 1]
    assert (header["version"], header["data_type"]) == ("1.0", "linear")
    assert header["num_attrib"] == len(names)
    letters = header["attrib_data_type"]
    assert len(letters) == sum(sizes) == 14 and {len(letter) for letter in letters} == {1}
    assert header["num_frames"] == len(frames)
    assert [frame["number"] for frame in frames] == list(range(1, len(frames) + 1))
    rows = [frame["frame_data"] for frame in frames]
    assert [frame["num_points"] for frame in frames] == [len(each) for each in rows]
    points = [row for each in rows for row in each]
    assert header["num_samples"] == len(points)
    assert header["num_points"] == len({row[0] for row in points})
    assert all(len(row) == 14 and type(row[0]) is int for row in points)
    assert rows[0], "the first frame holds a point"
    assert not rows[-1], "nothing is left in the last"
    flights = defaultdict(list)
    for frame, each in zip(frames, rows, strict=True):
        ages = [row[12] for row in each]
        assert ages == sorted(ages, reverse=True)
        assert len({row[0] for row in each}) == len(each)
        for row in each:
            flights[row[0]].append((frame["number"], frame["time"], row))
    for flight in flights.values():
        numbers = [number for number, _, _ in flight]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "one flight, one id"
        for (_, before, here), (_, after, there) in pairwise(flight):
            assert there[12] - here[12] == pytest.approx(after - before, abs=2e-3)
        for _, time, row in flight:
            assert time - row[12] + row[13] < frames[-1]["time"], "dead before the last frame"
    return [list(each) for each in rows]


@pytest.mark.parametrize("loop", [True, False])
def test_a_point_cache_has_a_point_for_every_birth(loop: bool) -> None:
    tracks = flying(BIRTHS, loop=loop)
    points = pcache(tracks)
    assert list(points) == PROPERTIES
    births = dict(zip(SPAWN_COLUMNS, tracks.spawns.T, strict=True))
    expected = {
        "position.x": (births["x"] - 320) / 480,
        "position.y": 1 - births["y"] / 480,
        "velocity.x": births["vx"] / 480,
        "velocity.y": np.full(5, 96 / 480),
        "size": np.full(5, 0.01),
        "angle": np.degrees(np.arctan2(96, births["vx"])),
        "lifetime": births["life"],
        "spawnTime": births["t"],
        "flakeId": np.arange(5),
        "color.r": np.full(5, 6.0),
        "position.z": np.zeros(5),
    }
    for name, values in expected.items():
        assert points[name] == pytest.approx(values, abs=1e-3 if name == "angle" else 1e-5), name
    brightest = [max(row[11] for f in tracks.frames for row in f if row[0] == i) for i in range(5)]
    assert points["color.a"] == pytest.approx(np.array(brightest), abs=1e-4)


def test_ids_survive_half_precision() -> None:
    ids = pcache(flying(BIRTHS, first_id=2046))["flakeId"]
    assert ids.tolist() == [2046, 2047, 0, 1, 2]
    assert (ids.astype(np.float16) == ids).all()


@pytest.mark.parametrize("loop", [True, False])
def test_a_niagara_cache_holds_every_row(loop: bool) -> None:
    tracks = flying(BIRTHS, loop=loop)
    frames = hjson(tracks)
    for table, rows in zip(tracks.frames, frames, strict=False):
        by_age = table[np.lexsort((table[:, 0], -table[:, 12]))]
        read = np.array(rows).reshape(-1, 14)
        assert read[:, 1] == pytest.approx((by_age[:, 1] - 320) / 480, abs=1e-6)
        assert read[:, 2] == pytest.approx(1 - by_age[:, 2] / 480, abs=1e-6)
        assert read[:, 4] == pytest.approx(by_age[:, 3] / 480, abs=1e-5)
        assert read[:, 5] == pytest.approx(-by_age[:, 4] / 480, abs=1e-5)
        assert read[:, 7:11] == pytest.approx(by_age[:, 8:12], abs=1e-4)
        assert read[:, 11] == pytest.approx(by_age[:, 5] / 480, abs=1e-6)
        assert not read[:, [3, 6]].any()


@given(tracks=any_tracks())
def test_a_niagara_cache_gives_each_flight_back_in_unbroken_runs(tracks: Tracks) -> None:
    runs = defaultdict[int, list[float]](list)
    for rows in hjson(tracks):
        for row in rows:
            if row[11] > 0:
                runs[int(row[0])].append(row[1] * tracks.height + tracks.width / 2)
    flights = [np.array(places) for places in flights_of(tracks).values()]
    assert sum(map(len, runs.values())) == sum(map(len, flights))
    for run in runs.values():
        begins = [(flight, i) for flight in flights for i in np.flatnonzero(near(flight, run[0]))]
        assert any(near(flight[i : i + len(run)], run).all() for flight, i in begins)


def near(places: NDArray[np.float64], others: Any) -> NDArray[np.bool_]:
    """Whether places, px, are those of a cache, whose positions have six decimals of a metre."""
    return np.asarray(np.abs(places - others) < 1e-3)


@given(tracks=any_tracks())
def test_a_point_cache_gives_every_birth_back(tracks: Tracks) -> None:
    births, points = dict(zip(SPAWN_COLUMNS, tracks.spawns.T, strict=True)), pcache(tracks)
    assert points["flakeId"].tolist() == births["id"].tolist()
    for name, values in {
        "position.x": (births["x"] - tracks.width / 2) / tracks.height,
        "position.y": 1 - births["y"] / tracks.height,
        "velocity.x": births["vx"] / tracks.height,
        "velocity.y": -births["vy"] / tracks.height,
        "size": births["size"] / tracks.height,
        "lifetime": births["life"],
        "spawnTime": births["t"],
    }.items():
        assert points[name] == pytest.approx(values, abs=6e-4 if name == "lifetime" else 6e-6)


def test_a_flake_that_flies_into_the_next_round_has_a_second_id() -> None:
    tracks = flying(BIRTHS)
    frames = hjson(tracks)
    wrapping = set(tracks.spawns[tracks.spawns[:, -1] > 0, 0])
    assert wrapping == {2, 4}
    at_first = {row[0] for row in frames[0]}
    assert {i - 5 for i in at_first if i >= 5} == wrapping
    assert wrapping <= {row[0] for row in frames[-2]}


def test_a_flake_that_meets_itself_flies_on_under_ids_of_its_own() -> None:
    row = [0.0, 300, 400, 0, -50, 3, 1, 0, 1, 1, 1, 1, 0.0, 3.0]
    ages = np.arange(3 * FPS) / FPS
    rows = [np.array([[*row[:12], age, 3.0, 0, 0, 1]]) for age in ages]
    spawns = np.array([[0, 0.0, 3.0, 300, 400, 0, -50, 3, 0.0]])
    tracks = fold_into_loop(Tracks.one_shot(FPS, (WIDTH, HEIGHT), 7, spawns, rows), FRAMES)
    assert [len(each) for each in hjson(tracks)] == [6] * FRAMES + [0]


@pytest.mark.parametrize(("births", "seen"), [([], 0), ([(0.2, 0.1)], 3)])
def test_a_first_frame_without_flakes_has_a_point_that_nobody_sees(
    births: list[tuple[float, float]], seen: int
) -> None:
    frames = hjson(flying(births, loop=False))
    (point,) = frames[0]
    assert point[1:13] == [0] * 12
    assert 0 < point[13] < 1 / FPS
    assert sum(map(len, frames[1:])) == seen


def test_without_flakes_a_point_cache_is_empty() -> None:
    assert all(len(values) == 0 for values in pcache(flying([])).values())


@pytest.mark.parametrize("name", ["pcache", "hjson"])
def test_what_is_no_number_is_a_fault_of_ours(name: Any) -> None:
    tracks = flying(BIRTHS)
    tracks.frames[1][0, 4] = np.nan
    with pytest.raises(AssertionError, match="frame 1, row 0: vy"):
        TRACKS[name].write("fire", tracks)
