"""Flakes of a fire with depth in the engine's space: its camera sees them as the tracks do."""

import json
import math
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from tests.support.godot4 import Godot4, picture

SIZE, FRAMES = (64, 80), 6
TIMES = [0.0, 3.0, 2.5, 5.75]
PX = 0.01
"""Size of a px in the engine, m."""

RECIPE: dict[str, Any] = {
    "source": {
        "kind": "silk", "width": SIZE[0], "height": SIZE[1], "rows": 10, "columns": 8,
        "foot": 0.2, "sheets": {"count": 3, "spread": 0.1},
    },
    "flakes": {"rate": 120, "class": "campfire", "bake": False, "rounds": 1, "life": [0.3, 0.6]},
    "timeline": {"frames": FRAMES},
    "exports": ["godot"],
    "tracks": ["json"],
}  # fmt: skip

VIEWS = {"parallel": {"count": 4}, "perspective": {"count": 4, "elevation": 20, "distance": 2}}


def seen_from(tracks: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """Return the job of seeing flakes with the camera of tracks."""
    camera = tracks["camera"]
    return {
        "do": "see_flakes", "scene": "res://fire_flakes_3d.tscn", "animation": "view_0",
        "times": TIMES,
        "azimuth": math.radians(camera["azimuth"]),
        "elevation": math.radians(camera["elevation"]),
        "raised": (camera["origin"][1] - SIZE[1] / 2) * PX,
        "height": SIZE[1] * PX,
        "distance": camera["distance"] and camera["distance"] * PX,
        **keys,
    }  # fmt: skip


def in_frame(tracks: dict[str, Any], time: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return x and y of the flakes of a loop at a time in frames, on the way to the next frame."""
    frame, part = divmod(time, 1)
    rows = np.array(tracks["frames"][int(frame)]["rows"])
    column = {name: rows[:, i] for i, name in enumerate(tracks["columns"])}
    way = [column[axis] + column[f"v{axis}"] / tracks["fps"] * part for axis in "xy"]
    return np.stack(way, axis=1)


def brightest_frame(tracks: dict[str, Any]) -> float:
    """Return the number of the frame with the ember that lights most pixels."""
    alpha, size = (tracks["columns"].index(name) for name in ("a", "size"))
    lit = [max(row[alpha] * row[size] ** 2 for row in each["rows"]) for each in tracks["frames"]]
    return float(np.argmax(lit))


@pytest.mark.parametrize("views", VIEWS)
def test_a_camera_sees_them_where_the_tracks_have_them(
    godot4: Godot4, tmp_path: Path, views: str
) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text(json.dumps({**RECIPE, "views": VIEWS[views]}), encoding="utf-8")
    assert main(["build", str(path), "-q", "--jobs", "1"]) == 0
    game = tmp_path / "build"
    tracks = [
        json.loads((game / f"fire.view_{k}.flakes.json").read_text(encoding="utf-8"))
        for k in range(4)
    ]
    jobs = [seen_from(each) for each in tracks]
    bright = brightest_frame(tracks[1])
    jobs.append(seen_from(tracks[1], times=[bright], picture=True))
    *found, (image,) = godot4.run(game, jobs, SIZE)
    for each, places in zip(tracks, found, strict=True):
        for time, seen in zip(TIMES, places, strict=True):
            stated = in_frame(each, time)
            assert len(stated) > 10 and np.abs(np.array(seen) - stated).max() < 0.25
    light = picture(image).max(axis=2)
    y, x = np.unravel_index(np.argmax(light), light.shape)
    assert light[y, x] > np.median(light) + 30  # the engine's ground is grey
    off = in_frame(tracks[1], bright) - [x + 0.5, y + 0.5]
    assert np.sqrt((off * off).sum(axis=1)).min() < 4
    for program in ("gdparse", "gdlint"):
        tool = Path(sysconfig.get_path("scripts")) / program
        subprocess.run([tool, game / "fire_flakes_3d.gd"], check=True, capture_output=True)
