"""Tracks that are written as JSON are the same when they are read back, to the last decimal."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.statistics import flake_figures
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks, first_frames
from fire_atlas.formats.tracks.columns import DECIMALS
from fire_atlas.formats.tracks.tracks_json import read_tracks, write_tracks_json
from tests.support.any_tracks import any_tracks, flights_of
from tests.support.clips import campfire
from tests.support.effect import run_effect


def read_back(file: OutputFile, folder: Path) -> Tracks:
    (folder / file.name).write_bytes(file.data)
    tracks = read_tracks(folder / file.name)
    assert tracks is not None
    return tracks


def assert_near(read: NDArray[np.float64], stated: NDArray[np.float64], *columns: str) -> None:
    """Half a step of each column's last decimal may be lost, and a hair."""
    assert read.shape == stated.shape
    half_steps = [0.5001 * 10.0 ** -DECIMALS[column] for column in columns]
    assert (np.abs(read - stated) <= half_steps).all()


def assert_same(read: Tracks, stated: Tracks) -> None:
    assert (read.width, read.height, read.loop, read.seed, read.rounds) == (
        stated.width, stated.height, stated.loop, stated.seed, stated.rounds,
    )  # fmt: skip
    assert read.fps == pytest.approx(stated.fps, abs=5e-7)
    assert_near(read.spawns, stated.spawns, *SPAWN_COLUMNS)
    for here, there in zip(read.frames, stated.frames, strict=True):
        assert_near(here, there, *COLUMNS)
    for numbers in ("flights", "flight_frames"):
        for here, there in zip(getattr(read, numbers), getattr(stated, numbers), strict=True):
            assert here.tolist() == there.tolist()


@given(tracks=any_tracks())
def test_tracks_come_back_with_all_that_they_know(
    tracks: Tracks, tmp_path_factory: pytest.TempPathFactory
) -> None:
    assert_same(read_back(write_tracks_json("fire", tracks), tmp_path_factory.mktemp("a")), tracks)


@pytest.mark.parametrize("count", [48, 13, 2, 1])
def test_flights_of_a_loop_are_read_as_they_were_flown(count: int, tmp_path: Path) -> None:
    """Loops that are longer and shorter than the flakes live, and one of a single frame."""
    clip = replace(campfire(96), count=count, loop=True)
    tracks = run_effect(clip, {"flakes": {"rate": 150, "life": [0.3, 2.6]}}).tracks
    changes_ids = len(tracks.spawns) > len(flights_of(tracks))
    assert changes_ids == (count < 2.6 * clip.fps)
    assert_same(read_back(write_tracks_json("fire", tracks), tmp_path), tracks)


def test_tracks_of_several_rounds_come_back(tmp_path: Path) -> None:
    clip = replace(campfire(96), count=8, loop=True)
    tracks = run_effect(clip, {"flakes": {"bake": False, "rate": 150, "rounds": 5}}).tracks
    assert (tracks.rounds, len(tracks.frames)) == (5, 40)
    assert_same(read_back(write_tracks_json("fire", tracks), tmp_path), tracks)


def test_flights_of_a_clip_that_plays_once_are_read_as_they_were_flown(tmp_path: Path) -> None:
    """With its tail, and with most of that cut off, so that flights end before they are over."""
    effect = run_effect(campfire(96, 24), {"timeline": {"loop": "none", "tail": True}})
    cut = first_frames(effect.tracks, effect.clip.body + 3)
    assert cut.flight_frames[-1].any()
    for tracks in (effect.tracks, cut):
        assert_same(read_back(write_tracks_json("fire", tracks), tmp_path), tracks)


@given(tracks=any_tracks())
def test_as_many_embers_are_born_as_there_are_flights(tracks: Tracks) -> None:
    born = {figure.name: figure.value for figure in flake_figures(tracks)}.get("born", 0)
    assert born == len(flights_of(tracks))


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace('"spawns": [', '"spawns": {', 1),
        lambda text: text.replace('"size": [640, 480]', '"size": [640]', 1),
        lambda text: text.replace('"columns": ["id"', '"columns": ["name"', 1),
        lambda text: text.replace("[0,", "[99,", 1),
        lambda text: text.replace("[0,", "[1e999,", 1),
        lambda text: text.replace("[0,", "[NaN,", 1),
        lambda text: text.replace('"fps": 24', '"fps": "fast"', 1),
        lambda text: text.replace('"rounds": 1', '"rounds": 2', 1),
        lambda text: f"[{text}]",
    ],
)
def test_what_is_no_tracks_is_refused(change: Callable[[str], str], tmp_path: Path) -> None:
    row: dict[str, Any] = dict.fromkeys(COLUMNS, 0.0) | {"x": 1.0}
    spawns = np.zeros((1, len(SPAWN_COLUMNS)))
    tracks = Tracks.one_shot(24, (640, 480), 7, spawns, [np.array([list(row.values())])])
    file = write_tracks_json("fire", tracks)
    text = file.data.decode()
    assert change(text) != text
    with pytest.raises(
        SourceError, match=r"fire\.flakes\.json: is not a file of flake tracks that"
    ):
        read_back(replace(file, data=change(text).encode()), tmp_path)


def test_where_there_is_no_file_there_are_no_tracks(tmp_path: Path) -> None:
    assert read_tracks(tmp_path / "fire.flakes.json") is None
