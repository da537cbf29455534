"""Flakes of a fire with depth: flown once, on the fire, and the same ones in every view."""

import json
import math
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.context import BuildContext
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import Tracks, by_column
from fire_atlas.formats.tracks.hjson import write_tracks_hjson
from fire_atlas.formats.tracks.pcache import write_tracks_pcache
from fire_atlas.formats.tracks.tracks_csv import write_tracks_csv
from fire_atlas.formats.tracks.tracks_json import read_tracks, write_tracks_json
from fire_atlas.pipeline.animation.animate import animate_views
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.pipeline.input.open import open_input
from fire_atlas.recipe.tree import read_tree
from fire_atlas.sources.sprites import Sprites
from tests.generators.silk.small_fires import COARSE, camera, fire

Columns = dict[str, NDArray[np.float64]]

WIDTH, HEIGHT, FOOT, FRAMES, FPS = 64, 80, 0.1, 12, 24.0
BALL, RADIUS = (0.0, -0.3, 0.45), 0.12
SHEETS = [
    {"at": [-0.15, 0.15, 0.0], "width": 0.2, "height": 0.7, "angle": 30},
    {"at": [0.15, -0.15, 0.0], "width": 0.2, "height": 0.7, "angle": -20},
]
"""Two flames: the left one is farther away."""

SILK: dict[str, Any] = {"kind": "silk", **COARSE, "foot": FOOT, "sheets": SHEETS}
INTRUDERS = [{"shape": "sphere", "at": BALL, "radius": RADIUS, "strength": 0}]
FLAKES = {"rate": 150, "life": [0.3, 0.6], "class": "campfire", "sparks": 0.2}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("depth")


@cache
def tracks_of(folder: Path, recipe: str) -> Mapping[str, Tracks]:
    """Return the tracks of each view of a recipe, in the order of the views."""
    path = folder / "fire.yaml"
    path.write_text(recipe, encoding="utf-8")
    with Workers(2) as workers:
        context = BuildContext.silent(workers)
        (part,) = load_checked(read_tree(path)).parts
        clips = open_input(part, context)
        assert not isinstance(clips, Sprites | FireInWind)
        found = animate_views(part.recipe, clips, (), {}, context).animations
    return {name: each.tracks[0] for name, each in found.items() if each.tracks}


def seen(folder: Path, source: dict[str, Any] | None = None, **keys: Any) -> list[Tracks]:
    recipe = {
        "source": source or SILK, "timeline": {"frames": FRAMES}, "flakes": FLAKES, **keys
    }  # fmt: skip
    return [*tracks_of(folder, json.dumps(recipe)).values()]


def all_rows(tracks: Tracks) -> Columns:
    """Return the columns of all frames, with the number of each row's frame."""
    return by_column(np.concatenate(tracks.frames)) | {"frame": tracks.frame_numbers.astype(float)}


def in_world(row: Columns, elevation: float, distance: float = math.inf) -> NDArray[np.float64]:
    """Return the places (3, n) of flakes seen from the front: right, away, up, heights."""
    nearness = 1 - row["z"] / HEIGHT / distance
    # Right, down and towards the viewer, in the axes of the camera, from the middle of the fire.
    right = ((row["x"] - WIDTH / 2) * nearness) / HEIGHT
    down = ((row["y"] - HEIGHT / 2) * nearness - HEIGHT * (0.5 - FOOT)) / HEIGHT
    towards, tilt = row["z"] / HEIGHT, math.radians(elevation)
    up = towards * math.sin(tilt) - down * math.cos(tilt)
    return np.stack([right, -towards * math.cos(tilt) - down * math.sin(tilt), up])


def projected(
    place: NDArray[np.float64], azimuth: float, elevation: float, distance: float = math.inf
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y, px, at which a camera sees places (3, n)."""
    turn, tilt = math.radians(azimuth), math.radians(elevation)
    x, y, up = place
    right = x * math.cos(turn) + y * math.sin(turn)
    level = y * math.cos(turn) - x * math.sin(turn)
    down = -level * math.sin(tilt) - up * math.cos(tilt)
    nearness = 1 + (level * math.cos(tilt) - up * math.sin(tilt)) / distance
    return (
        WIDTH / 2 + right * HEIGHT / nearness,
        HEIGHT / 2 + (down + 0.5 - FOOT) * HEIGHT / nearness,
    )


VIEWS = {"level": (0.0, math.inf), "above": (35.0, math.inf), "perspective": (20.0, 2.0)}


@pytest.mark.parametrize("seen_as", VIEWS)
def test_an_ember_is_where_every_camera_sees_it(folder: Path, seen_as: str) -> None:
    elevation, distance = VIEWS[seen_as]
    views: dict[str, Any] = {"count": 4, "elevation": elevation}
    if math.isfinite(distance):
        views["distance"] = distance
    source = {**SILK, "intruders": INTRUDERS} if seen_as == "level" else SILK
    front, *others = (all_rows(each) for each in seen(folder, source, views=views))
    assert len(front["id"]) > 200
    world = in_world(front, elevation, distance)
    assert np.ptp(world[1]) > 0.3
    for k, view in enumerate(others, 1):
        assert (view["id"] == front["id"]).all() and (view["frame"] == front["frame"]).all()
        x, y = projected(world, 90.0 * k, elevation, distance)
        assert np.abs(view["x"] - x).max() < 0.01 and np.abs(view["y"] - y).max() < 0.01
        if seen_as == "level":
            assert np.abs(view["y"] - front["y"]).max() < 0.01


def test_nearer_embers_are_larger_in_perspective(folder: Path) -> None:
    """From behind, the near ones are far: sizes and distances change in inverse proportion."""
    views = {"count": 4, "elevation": 20.0, "distance": 2.0}
    front, _, back, _ = (all_rows(each) for each in seen(folder, SILK, views=views))
    born = front["blur"] == 0
    width = [(view["size"] - 1.7)[born] for view in (front, back)]  # less a pixel's reach
    near = [(1 - view["z"] / HEIGHT / 2)[born] for view in (front, back)]
    assert np.ptp(near[1] / near[0]) > 0.2
    assert np.allclose(width[0] / width[1], near[1] / near[0], rtol=1e-6)


def test_flakes_are_born_on_the_flames(folder: Path) -> None:
    """Each on one of two sheets, left and behind or right and in front."""
    tracks = seen(folder, SILK, views={"count": 4})[0]
    spawns = dict(zip(tracks.spawn_columns, tracks.spawns.T, strict=True))
    place = in_world(spawns, 0.0)
    recorded = fire(FRAMES, foot=FOOT, sheets=SHEETS, wind={}).recording.x
    frame = np.floor(spawns["t"] * FPS + 1e-6).astype(int) % FRAMES
    nodes = recorded.reshape(len(recorded), -1, 3)
    distance = [
        np.sqrt(np.square(nodes[i] - at).sum(axis=1)).min()
        for i, at in zip(frame, place.T, strict=True)
    ]
    spacing = 0.7 / (COARSE["rows"] - 1)
    assert np.median(distance) < 0.6 * spacing
    assert np.max(distance) < 2 * spacing  # flames reach beyond the nodes of their sheets
    left = place[0] < 0
    assert 0.2 < left.mean() < 0.8
    assert place[1][left].min() > 0 > place[1][~left].max()


def test_seen_from_above_they_drift_with_the_wind_alone(folder: Path) -> None:
    views, still = {"elevation": 90}, {"turbulence": 0.0}
    means = {}
    for level in (0, 3):
        wind = {"level": level, "direction": 90}
        (tracks,) = seen(folder, {**SILK, **still, "foot": 0.5}, views=views, wind=wind)
        row, flights = all_rows(tracks), np.concatenate(tracks.flights)
        of_flake = np.array([row["vy"][flights == one].mean() for one in np.unique(flights)])
        means[level] = of_flake.mean(), of_flake.std() / math.sqrt(len(of_flake))
        assert row["vz"].mean() > 0.3 * HEIGHT  # they rise towards the eye
    mean, noise = means[0]
    assert abs(mean) < 3 * noise
    assert means[3][0] < mean - 0.1 * HEIGHT  # what blows away from the front goes up in the frame


def test_a_sphere_hides_all_embers_behind_it(folder: Path) -> None:
    front, _, back, _ = seen(
        folder, {**SILK, "intruders": INTRUDERS}, views={"count": 4, "elevation": 0.0}
    )
    row, behind = all_rows(front), all_rows(back)
    ball = WIDTH / 2 + BALL[0] * HEIGHT, HEIGHT * (1 - FOOT - BALL[2]), -BALL[1] * HEIGHT
    is_hidden = np.hypot(row["x"] - ball[0], row["y"] - ball[1]) < RADIUS * HEIGHT
    is_hidden &= row["z"] < ball[2]
    assert np.count_nonzero(is_hidden) > 20
    assert (row["a"][is_hidden] == 0).all()
    assert (behind["a"][is_hidden] > 0).mean() > 0.6  # from behind, flames alone outshine some
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    inside = np.hypot(x - ball[0], y - ball[1]) < RADIUS * HEIGHT - 1
    for rows in front.frames:
        assert draw_flakes(rows, HEIGHT, WIDTH).rgb()[inside].max() < 0.05  # ends of halos
    assert max(draw_flakes(r, HEIGHT, WIDTH).rgb()[inside].max() for r in back.frames) > 1


def test_every_view_closes_its_loop(folder: Path) -> None:
    views = {"count": 4, "elevation": 20.0, "distance": 2.0}
    for tracks in seen(folder, SILK, views=views):
        assert tracks.loop
        row, following = all_rows(tracks), tracks.following_rows()
        goes_on = following >= 0
        assert goes_on[row["frame"] == FRAMES - 1].mean() > 0.8
        for axis in "xyz":
            there = row[axis][following[goes_on]]
            step = row[f"v{axis}"][goes_on] / FPS
            assert np.abs(row[axis][goes_on] + step - there).max() < 1e-6


def test_a_learnt_fire_has_the_same_embers_on_all_sides(folder: Path) -> None:
    """In wind from the side, embers lean away in its own view, and not in the view along it."""
    source = {"kind": "profile", "path": str(shipped("samples") / "torch.gif"), "height": 64}
    views, wind = {"count": 4}, {"level": 2.0, "direction": 0}
    front, right, back, _ = (
        all_rows(each)
        for each in seen(folder, source, views=views, wind=wind, timeline={"frames": 8})
    )
    assert (front["id"] == right["id"]).all()
    assert np.abs(front["y"] - right["y"]).max() < 1e-6
    axis = (front["x"] + back["x"]).mean() / 2
    assert np.abs(right["x"] - (axis - front["z"])).max() < 1e-6
    assert (front["x"] - axis).mean() > 2 * abs((right["x"] - axis).mean())


def test_files_have_the_depth_of_flakes(folder: Path, tmp_path: Path) -> None:
    tracks = seen(folder, SILK, views={"count": 4})[1]
    path = tmp_path / "a.flakes.json"
    path.write_bytes(write_tracks_json("a", tracks).data)
    read = read_tracks(path)
    assert read is not None and read.columns[-2:] == ("z", "vz")
    assert read.camera is not None and math.isclose(read.camera.azimuth, math.pi / 2)
    for one, other in zip(tracks.frames, read.frames, strict=True):
        assert np.abs(one - other)[:, -2:].max() <= 0.005
    header, first = write_tracks_csv("a", tracks).data.decode().splitlines()[:2]
    assert header.endswith(",tail,z,vz")
    assert float(first.split(",")[-2]) == pytest.approx(tracks.frames[0][0, -2], abs=5e-4)
    spawns = dict(zip(tracks.spawn_columns, tracks.spawns.T, strict=True))
    text = write_tracks_pcache("a", tracks).data.decode().partition("end_header\n")[2]
    points = np.array([line.split() for line in text.splitlines()], float)
    assert np.allclose(points[:, 2], spawns["z"] / HEIGHT, atol=1e-6)
    assert np.allclose(points[:, 5], spawns["vz"] / HEIGHT, atol=1e-5)


def test_point_caches_are_without_perspective(folder: Path) -> None:
    """Engines have a camera of their own: points are where the flakes are, and go where they go."""
    views = {"count": 4, "elevation": 20.0, "distance": 2.0}
    tracks = seen(folder, SILK, views=views)[0]
    cache = json.loads(write_tracks_hjson("a", tracks).data)["cache_data"]["frames"]
    right, away, up = in_world(all_rows(tracks), 20.0, 2.0)
    tilt = math.radians(20.0)
    towards = up * math.sin(tilt) - away * math.cos(tilt)
    points = np.concatenate([frame["frame_data"] for frame in cache if frame["frame_data"]])
    assert np.allclose(np.sort(points[:, 1]), np.sort(right), atol=1e-6)
    assert np.allclose(np.sort(points[:, 3]), np.sort(towards), atol=1e-6)
    known = [{row[0]: np.array(row[1:7]) for row in frame["frame_data"]} for frame in cache]
    off = [
        here[one][:3] + here[one][3:] / FPS - there[one][:3]
        for here, there in pairwise(known)
        for one in here.keys() & there.keys()
    ]
    assert len(off) > 100 and np.abs(off).max() < 0.2 / HEIGHT


def test_a_flat_clip_has_none(folder: Path) -> None:
    source = {"path": str(shipped("samples") / "campfire"), "count": 6, "height": 48}
    (tracks,) = seen(folder, source, timeline={})
    assert tracks.camera is None and "z" not in tracks.columns
    assert b'"z"' not in write_tracks_json("a", tracks).data


def test_the_depth_of_clips_is_in_px_of_their_camera() -> None:
    """What a camera projects, it finds again."""
    chance = np.random.default_rng(2)
    for eye in (camera(0.4, 0.0), camera(70.0, 25.0, 3.0)):
        places = chance.uniform(-0.4, 0.4, (50, 3))
        assert np.allclose(eye.unproject(eye.project(places)), places)
