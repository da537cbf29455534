"""Loops that stand in a scene several times, in the engine: each begins at a moment of its own."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.engines.godot.test_nodes import build
from tests.support.godot4 import Godot4
from tests.support.wind import SILK

COUNT = 12
FRAMES = 24
TICK = 1.5
"""Frames that may have passed since a fire began: its first update."""

FLAT: dict[str, Any] = {
    "source": {
        "path": str(shipped("samples") / "campfire"), "count": FRAMES, "fps": 24, "height": 80,
    },
    "timeline": {"loop": "pingpong"}, "flakes": {"bake": False, "rate": 40},
    "tracks": ["json", "light"], "exports": ["json", "godot"],
}  # fmt: skip

RECIPES: dict[str, dict[str, Any]] = {
    "fire": FLAT,
    "once": {**FLAT, "timeline": {"loop": "none"}},
    "grid": {**FLAT, "flakes": "none", "tracks": [], "atlas": {"layout": "grid"},
             "maps": {"motion": "godot"}},
    "phased": {**FLAT, "phases": {"ignite": 0.5, "extinguish": 0.5}},
    "windy": {**SILK, "flakes": {"bake": False}, "tracks": [], "exports": ["json", "godot"]},
    "deep": {**SILK, "wind": {}, "flakes": {"bake": False}, "tracks": [],
             "exports": ["json", "godot"]},
}  # fmt: skip


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the add-on and fires of all kinds."""
    folder = tmp_path_factory.mktemp("apart")
    (folder / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", "godot", str(folder), "-q"]) == 0
    (folder / "own_start.gd").write_text(Path(__file__).with_name("own_start.gd").read_text())
    for name, recipe in RECIPES.items():
        build(folder, name, recipe)
    return folder


def began(scene: str, **keys: Any) -> dict[str, Any]:
    job = {"do": "ask", "script": "res://own_start.gd", "scene": f"res://{scene}.tscn"}
    return {**job, "count": COUNT, **keys}


def are_apart(fires: list[dict[str, Any]], count: int) -> bool:
    """Whether fires begin all over a loop of ``count`` frames, and no two of them alike."""
    times = np.sort([fire["time"] for fire in fires])
    speeds = np.array([fire["speed"] for fire in fires])
    assert speeds.min() >= 0.9 - 1e-6 and speeds.max() <= 1.1 + 1e-6
    # The chance that twelve of evenly drawn moments lie in half of the loop is 0.3 %.
    spread = times.max() - times.min() > count / 2
    return bool(spread and np.diff(times).min() > 1e-6 and len({*speeds.tolist()}) == COUNT)


def test_every_loop_that_a_build_writes_begins_at_a_moment_of_its_own(
    game: Path, godot4: Godot4
) -> None:
    loop = len(json.loads((game / "fire.json").read_text())["frames"])
    scenes = {
        "fire": loop, "fire_film": loop, "grid_motion": loop, "phased": loop, "windy": 24,
        "deep": 24, "deep_flakes_3d": 24,
    }  # fmt: skip
    jobs = [began(scene) for scene in scenes]
    nodes = [("fire", loop, "2d"), ("fire_film", loop, "2d"), ("phased", loop, "2d"),
             ("fire", loop, "3d"), ("phased", loop, "3d"), ("deep", 24, "3d")]  # fmt: skip
    jobs += [began(scene, kind=kind) for scene, _, kind in nodes]
    counts = [*scenes.values(), *(count for _, count, _ in nodes)]
    for job, fires, count in zip(jobs, godot4.run(game, jobs), counts, strict=True):
        assert are_apart(fires, count), job
    assert {fire["animation"] for fire in godot4.run(game, [began("phased")])[0]} == {"burn"}


def test_lamp_and_sparks_follow_the_moment_at_which_a_fire_begins(
    game: Path, godot4: Godot4
) -> None:
    (fires,) = godot4.run(game, [began("fire")])
    light = json.loads((game / "fire.light.json").read_text())["frames"]
    energies = np.array([frame["intensity"] for frame in light])
    tracks = json.loads((game / "fire.flakes.json").read_text())
    alive = [len(frame["rows"]) for frame in tracks["frames"]]
    for fire in fires:
        frame, part = int(fire["time"]), fire["time"] % 1
        after = (frame + 1) % len(energies)
        wanted = energies[frame] * (1 - part) + energies[after] * part
        assert fire["lamp"] == pytest.approx(wanted, abs=1e-3)
        assert fire["sparks"] == alive[frame]
    assert len({fire["lamp"] for fire in fires}) == COUNT


def test_what_plays_once_begins_at_its_beginning_and_at_its_speed(
    game: Path, godot4: Godot4
) -> None:
    jobs = [began("once"), *(began("once", kind=kind) for kind in ("2d", "3d"))]
    jobs.append(began("phased", set={"burning": False}))
    *once, out = godot4.run(game, jobs)
    for fires in once:
        assert all(fire["time"] < TICK and fire["speed"] == 1 for fire in fires)
    assert {fire["animation"] for fire in out} == {"extinguish"}
    assert len({fire["time"] for fire in out}) == 1


@pytest.mark.parametrize("kind", [None, "2d", "3d"])
def test_a_loop_that_may_not_begins_with_its_first_frame(
    game: Path, godot4: Godot4, kind: str | None
) -> None:
    """Speed and start are properties of their own."""
    keys = {} if kind is None else {"kind": kind}
    fast, slow, still = godot4.run(game, [
        began("fire", set={"random_start": False}, **keys),
        began("fire", set={"speed_spread": 0.5}, **keys),
        began("fire", set={"random_start": False, "speed_spread": 0.0}, **keys),
    ])  # fmt: skip
    assert all(fire["time"] < TICK for fire in fast)
    assert len({fire["speed"] for fire in fast}) == COUNT
    speeds = [fire["speed"] for fire in slow]
    # Of twelve even draws a range of 0.3 or less comes twice in a hundred thousand runs.
    assert min(speeds) >= 0.5 and max(speeds) <= 1.5 and max(speeds) - min(speeds) > 0.3
    assert {fire["speed"] for fire in still} == {1} and len({f["time"] for f in still}) == 1
