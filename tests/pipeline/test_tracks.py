"""Tracks as an engine reads them: from the written files, by the documented words alone."""

import csv
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import expose
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.pipeline.animation.simulate import simulate
from tests.support.repo import Repo, tracks_of

KEYS = ["format", "version", "name", "fps", "frame_count", "loop", "rounds", "seed", "size",
        "space", "units", "light", "spawns", "columns", "frames"]  # fmt: skip
SPAWN_KEYS = ["id", "t", "life", "x", "y", "vx", "vy", "size", "wraps"]
COLUMNS = ["id", "x", "y", "vx", "vy", "size", "stretch", "rotation", "r", "g", "b", "a", "age",
           "life", "kind", "blur", "tail"]  # fmt: skip

Row = dict[str, float]


def frames_of(tracks: Any) -> list[dict[int, Row]]:
    """Return the flakes of each frame by id."""
    rows = [[dict(zip(tracks["columns"], row, strict=True)) for row in frame["rows"]]
            for frame in tracks["frames"]]  # fmt: skip
    return [{int(row["id"]): row for row in frame} for frame in rows]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Tracks]:
    """Return the folder of a build with many flakes, and the tracks it was drawn from."""
    repo = Repo(tmp_path_factory.mktemp("tracks") / "repo")
    kept: list[Tracks] = []

    def watched(*arguments: Any) -> Tracks:
        kept.append(simulate(*arguments))
        return kept[-1]

    recipe = repo.recipe(
        path=str(shipped("samples") / "campfire"),
        flakes={"rate": 120, "scatter": 0.9},
        tracks=["json", "csv"],
        seed=7,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fire_atlas.pipeline.animation.animate.simulate", watched)
        repo.built(recipe, "--set", "source.fps=24")
    return repo.build, kept[0]


def test_the_json_has_exactly_the_contracts_keys(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    assert list(tracks) == KEYS
    assert (tracks["format"], tracks["version"], tracks["name"]) == ("fire-atlas/tracks", 2, "fire")
    assert (tracks["fps"], tracks["frame_count"], tracks["seed"]) == (24, 48, 7)
    assert tracks["size"] == [256, 320]
    assert tracks["space"] == "source pixels, x right, y down, (0,0) top-left corner"
    assert tracks["units"] == "px, px/s, s, rad"
    assert tracks["light"] == {"sum": "linear", "curve": "x/(1+x)", "halo": [0.004, 2.5]}
    assert tracks["columns"] == COLUMNS
    assert all(list(spawn) == SPAWN_KEYS for spawn in tracks["spawns"])
    for i, frame in enumerate(tracks["frames"]):
        assert list(frame) == ["i", "t", "rows"]
        assert (frame["i"], frame["t"]) == (i, pytest.approx(i / 24, abs=1e-6))


def test_every_velocity_leads_to_the_next_frames_place(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    frames, fps, pairs = frames_of(tracks), tracks["fps"], 0
    for here, there in pairwise([*frames, frames[0]] if tracks["loop"] else frames):
        for number in here.keys() & there.keys():
            if there[number]["age"] < here[number]["age"]:
                continue  # it ended, and the loop bears it again
            for axis in "xy":
                way = there[number][axis] - here[number][axis]
                stated = here[number][f"v{axis}"] / fps
                assert abs(stated - way) <= max(0.01, 0.01 * abs(way)), (number, axis)
            pairs += 1
    assert pairs > 1000


def test_flakes_age_and_end_as_they_say(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    spawns = {spawn["id"]: spawn for spawn in tracks["spawns"]}
    for i, frame in enumerate(frames_of(tracks)):
        for number, row in frame.items():
            spawn = spawns[number]
            periods = (row["age"] - (i / 24 - spawn["t"])) * 24 / tracks["frame_count"]
            assert periods == pytest.approx(round(periods), abs=1e-3)
            assert round(periods) == 0 or (tracks["loop"] and spawn["wraps"])
            assert 0 <= row["age"] < row["life"] + 1e-3
            assert (row["life"], row["size"]) == (spawn["life"], spawn["size"])


def test_spawns_list_exactly_the_flakes_that_are_seen(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    listed = [spawn["id"] for spawn in tracks["spawns"]]
    seen = {number for frame in frames_of(tracks) for number in frame}
    assert listed == sorted(seen)


def test_the_csv_agrees_with_the_json_number_by_number(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    with (built[0] / "fire.flakes.csv").open(newline="", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    assert header == ["frame", "t", *COLUMNS]
    wanted = [[f["i"], f["t"], *row] for f in tracks["frames"] for row in f["rows"]]
    assert [[float(cell) for cell in line] for line in lines] == wanted


def light_drawn(tracks: Any, rows: dict[int, Row]) -> NDArray[np.float64]:
    """Sum the light of a frame's flakes as the tracks' documentation says, pixel by pixel."""
    width, height = tracks["size"]
    halo_light, halo_width = tracks["light"]["halo"]
    light = np.zeros((height, width, 3))
    y, x = np.mgrid[:height, :width] + 0.5
    for row in rows.values():
        cos, sin = math.cos(row["rotation"]), math.sin(row["rotation"])
        along = (x - row["x"]) * cos + (y - row["y"]) * sin
        across = (y - row["y"]) * cos - (x - row["x"]) * sin
        for width_factor, factor in ((1, 1), (halo_width, halo_light)):
            u = 2 * along / (row["size"] * (row["stretch"] + width_factor - 1))
            v = 2 * across / (row["size"] * width_factor)
            inside = np.maximum(1 - np.abs(u) ** 3 - v**2, 0)
            rise = row["tail"] + (1 - row["tail"]) * (1 + u) / 2
            shine = inside**3 * rise * factor * row["a"]
            light += shine[..., None] * (row["r"], row["g"], row["b"])
    return light


def test_drawing_the_written_rows_gives_the_baked_layer(built: tuple[Path, Tracks]) -> None:
    tracks = tracks_of(built[0], "fire")
    frames, (width, height) = frames_of(tracks), tracks["size"]
    difference = total = 0.0
    for i in range(0, len(frames), 6):
        baked = expose(draw_flakes(built[1].frames[i], height, width).rgb())
        light = light_drawn(tracks, frames[i])
        difference += float(np.abs(light / (1 + light) - baked).sum())
        total += float(baked.sum())
    assert total > 0
    assert difference <= 0.03 * total


def test_flakes_that_are_not_baked_leave_the_pixels_alone(repo: Repo) -> None:
    repo.clip()
    baked = repo.built(repo.recipe("baked.yaml"))
    tracked = repo.built(repo.recipe("tracked.yaml"), "--set", "flakes.bake=false")
    without = repo.built(repo.recipe("without.yaml"), "--set", "flakes=none")
    assert tracked["tracked.png"] == without["without.png"] != baked["baked.png"]
    assert tracks_of(repo.build, "tracked")["frames"] == tracks_of(repo.build, "baked")["frames"]
    assert "without.flakes.json" not in without
