"""A scene of a fire with phases, in the engine, is lit and put out as its graph of states says."""

import itertools
import json
import shutil
import subprocess
import sysconfig
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.sheet import StateTransition
from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.recipe.phases import MAX_EXIT
from tests.docs.markdown import code_blocks
from tests.engines.godot.test_nodes import SIZE, asked, build, corner, ground, over
from tests.support.godot4 import Godot4, picture
from tests.support.wind import SILK

FPS, SPEED = 12, 4
"""Of the recipe, and of the game: each 1/60 s shows the same frame or the next."""

AT = (80, 150)

PHASES = {
    "fire": {"ignite": 0.5, "extinguish": 0.8},
    "at_once": {"ignite": "none", "extinguish": 0.8},
    "gone": {"ignite": 0.5, "extinguish": "none"},
}
"""Recipes: of a fire that is filmed, with a lamp; one in space, and one without sparks."""

OUT = """\
[gd_scene format=3]
[ext_resource type="PackedScene" path="res://{}.tscn" id="1"]
[node name="Fire" instance=ExtResource("1")]
burning = false
"""
"""A user's scene, whose fire does not burn from the start."""

LEVEL = """\
[gd_scene format=3]
[ext_resource type="PackedScene" path="res://fire.tscn" id="1"]
[ext_resource type="Script" path="res://level.gd" id="2"]
[node name="Level" type="Node2D"]
script = ExtResource("2")
[node name="Campfire" parent="." instance=ExtResource("1")]
speed_scale = 4.0
"""
"""A level of a game, whose script is that of the page on Godot."""

Place = tuple[str, int]
"""An animation and the number of a frame in it."""


@dataclass(frozen=True)
class Shown:
    """What a scene shows after 1/60 s, and what it has sent."""

    animation: str
    frame: int
    progress: float
    visible: bool
    signals: list[str]
    energy: float
    flakes: list[list[float]]

    @property
    def place(self) -> Place:
        return self.animation, self.frame


@dataclass(frozen=True)
class Fire:
    """A finished build."""

    folder: Path
    name: str

    @cached_property
    def atlas(self) -> AtlasFile:
        return read_atlas(self.folder / f"{self.name}.json")

    @cached_property
    def counts(self) -> dict[str, int]:
        return {each.name: len(each.frames) for each in self.atlas.sheet.animations}

    @cached_property
    def ways(self) -> dict[Place, StateTransition]:
        graph = self.atlas.sheet.states
        assert graph is not None
        return {(way.before, way.frame): way for way in graph.transitions}

    def after(self, place: Place, burning: bool) -> Place:
        """Return what a game shows after a frame."""
        name, frame = place
        if place in self.ways and not (burning and name == "burn"):
            way = self.ways[place]
            return way.after, way.entry
        if frame < self.counts[name] - 1:
            return name, frame + 1
        if name == "burn":
            return name, 0
        assert burning, "it is out"
        return ("ignite" if "ignite" in self.counts else "burn"), 0

    def over(self, ground: Any, place: Place) -> Any:
        """Return a picture of a frame before a ground."""
        number = [(name, i) for name, count in self.counts.items() for i in range(count)].index(
            place
        )
        return over(ground, self.atlas, number, corner(self.atlas, number, AT))

    def track(self, kind: str, animation: str) -> dict[str, Any]:
        """Return the file of a track of an animation."""
        path = self.folder / f"{self.name}.{animation}.{kind}.json"
        return dict(json.loads(path.read_text()))


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the add-on, the fires, and scenes in which they do not burn at first."""
    folder = tmp_path_factory.mktemp("phases")
    (folder / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", "godot", str(folder), "-q"]) == 0
    shutil.copy(Path(__file__).with_name("nodes.gd"), folder)
    clip = {"path": str(shipped("samples") / "campfire"), "count": 16, "fps": FPS, "height": 64}
    filmed = {"source": clip, "timeline": {"loop": "crossfade"}}
    fires: dict[str, dict[str, Any]] = {
        "fire": {**filmed, "flakes": {"bake": False}, "tracks": ["json", "light"]},
        "at_once": {**SILK, "flakes": {"bake": False, "rate": 60}, "wind": {}, "tracks": ["light"]},
        "gone": {**filmed, "flakes": "none", "tracks": ["light"]},
    }
    for name, keys in fires.items():
        same = {"atlas": {"alpha": "premultiplied"}, "exports": ["json", "godot"]}
        build(folder, name, {**keys, **same, "phases": PHASES[name]})
        (folder / f"{name}_out.tscn").write_text(OUT.format(name))
    (folder / "level.tscn").write_text(LEVEL)
    (script,) = (
        block for block in code_blocks("docs/engines/godot.md", "gdscript") if "extends" in block
    )
    (folder / "level.gd").write_text(script)
    return folder


@pytest.fixture(scope="module")
def switches() -> list[bool]:
    """Whether a fire is to burn in each 1/60 s: it is put out and lit, 20 times each."""
    burns = np.arange(41) % 2 == 0
    lengths = np.random.default_rng(8).integers(1, np.where(burns, 40, 25))
    return [bool(each) for each in np.repeat(burns, lengths)]


@pytest.fixture(scope="module")
def answers(game: Path, godot4: Godot4, switches: list[bool]) -> dict[str, Any]:
    """What the engine answers to all that it is asked, in one run."""
    faster = {":speed_scale": f"{SPEED}.0"}
    walk = {"do": "light_and_put_out", "set": faster}
    alone = {"Flakes:visible": "false", "Light:visible": "false"}
    draw = {"do": "draw", "background": "000000", "at": AT, "set": alone}
    state = [":animation", ":frame", ":visible"]
    steps = [
        {"set": {"speed_scale": f"{SPEED}.0", "burning": "false"}, "ticks": 20},
        {"set": {"playing": "true"}, "ticks": 5},
        {"set": {"playing": "true"}, "ticks": 5},
        {"set": {"burning": "true"}, "ticks": 5},
        {"ticks": 10},
    ]
    in_space = [True] * 4 + [False] * 30 + [True] * 4
    jobs: dict[str, dict[str, Any]] = {
        **{
            f"walk {name}": {**walk, "scene": f"res://{name}.tscn", "burning": switches[:count]}
            for name, count in {"fire": None, "at_once": 80, "gone": 80}.items()
        },
        **{
            f"out {name}": {
                "do": "read", "scene": f"res://{name}_out.tscn", "read": state, "ticks": 8,
            }
            for name in PHASES
        },
        "walk out": {**walk, "scene": "res://fire_out.tscn", "burning": [False] * 5 + [True] * 15},
        "film": {"do": "read", "scene": "res://fire_film.tscn", "read": ["Film/Fire:burning"]},
        "draw dying": {**draw, "scene": "res://fire.tscn", "animation": "extinguish", "frame": 3},
        "draw out": {**draw, "scene": "res://fire_out.tscn"},
        "node": asked("change", "fire", at=AT, steps=steps),
        "space": asked("light_in_space", "at_once", speed=SPEED, burning=in_space),
        "space gone": asked("light_in_space", "gone", speed=SPEED, burning=[True, False, False]),
        "level": asked("press", "level", action="ui_accept", read="is_warm", waits=[25, 14, 4]),
    }  # fmt: skip
    return dict(zip(jobs, godot4.run(game, list(jobs.values()), SIZE), strict=True))


def shown(answer: Sequence[Sequence[Any]]) -> list[Shown]:
    return [Shown(*each) for each in answer]


@pytest.mark.parametrize(("name", "animations"), [("fire", 7), ("at_once", 3)])
def test_it_walks_as_the_graph_says(
    game: Path, answers: Mapping[str, Any], switches: list[bool], name: str, animations: int
) -> None:
    fire, walked = Fire(game, name), shown(answers[f"walk {name}"])
    dark = "extinguish", fire.counts["extinguish"] - 1
    now, is_out, shown_for, waited, visited = ("burn", 0), False, 0, 0, {"burn"}
    for burning, tick in zip(switches, walked, strict=False):
        before, was_out, shown_for = now, is_out, shown_for + 1
        ends = tick.signals[:1] == ["went_out"]
        if before == dark and not was_out:
            # As all frames it is shown for 5/4 of 1/60 s, and another follows when it is out.
            assert ends or (shown_for < 2 and tick.place == dark)
        else:
            assert not ends
        if tick.place != now:
            now, shown_for = fire.after(now, burning), 0
            assert tick.place == now
        is_out = now == dark and (was_out or ends)
        is_lit = now[0] == "burn" != before[0]
        assert tick.signals == ["went_out"] * ends + ["lit"] * is_lit
        is_to_leave = now[0] == before[0] == "burn" and not burning
        waited = waited + 1 if is_to_leave else 0
        assert waited * SPEED / 60 <= MAX_EXIT + SPEED / 60
        assert tick.visible
        visited.add(now[0])
    assert len(visited) >= animations


def test_without_frames_of_its_end_it_is_hidden_at_once(
    game: Path, answers: Mapping[str, Any], switches: list[bool]
) -> None:
    fire, now, burned, signals = Fire(game, "gone"), ("burn", 0), True, set[str]()
    for burning, tick in zip(switches, shown(answers["walk gone"]), strict=False):
        is_lit = False
        if burning and not burned:
            now = "ignite", 0
            assert tick.place == now
        elif burning and tick.place != now:
            was, now = now, fire.after(now, burning)
            assert tick.place == now
            is_lit = was[0] == "ignite" and now == ("burn", 0)
        assert tick.visible == burning
        assert tick.signals == ["went_out"] * (burned and not burning) + ["lit"] * is_lit
        burned = burning
        signals.update(tick.signals)
    assert signals == {"lit", "went_out"}


def test_a_fire_that_does_not_burn_at_first_is_out(game: Path, answers: Mapping[str, Any]) -> None:
    for name in ("fire", "at_once"):
        last = Fire(game, name).counts["extinguish"] - 1
        state = {":animation": "extinguish", ":frame": last, ":visible": True}
        assert answers[f"out {name}"] == state
    assert not answers["out gone"][":visible"]
    walked = shown(answers["walk out"])
    assert [tick.animation for tick in walked[:7]] == ["extinguish"] * 5 + ["ignite"] * 2
    assert [name for tick in walked for name in tick.signals] == ["lit"]
    assert answers["film"] == {"Film/Fire:burning": True}


def test_it_draws_the_frames_that_were_built(game: Path, answers: Mapping[str, Any]) -> None:
    fire = Fire(game, "fire")
    last = fire.counts["extinguish"] - 1
    for name, frame, brightest in (("dying", 3, 150), ("out", last, 0)):
        drawn = picture(answers[f"draw {name}"]).astype(int)
        wanted = fire.over(ground(), ("extinguish", frame))
        assert wanted.max() >= brightest
        assert np.abs(drawn - wanted).max() <= 2


def test_sparks_and_lamp_follow_it_without_a_jump(game: Path, answers: Mapping[str, Any]) -> None:
    fire, walked = Fire(game, "fire"), shown(answers["walk fire"])
    energies, sparks = dict[Place, float](), dict[Place, float]()
    for name in fire.counts:
        light, flakes = fire.track("light", name), fire.track("flakes", name)
        column = {name: i for i, name in enumerate(flakes["columns"])}
        for i, frame in enumerate(flakes["frames"]):
            energies[name, i] = light["frames"][i]["intensity"]
            sparks[name, i] = sum(
                row[column[c]] * row[column["a"]] for row in frame["rows"] for c in "rgb"
            )
    for tick in walked:
        after = fire.after(tick.place, burning=True)
        # What plays once keeps its last light for the whole frame.
        later = after if after[0] == tick.animation else tick.place
        energy = energies[tick.place] + (energies[later] - energies[tick.place]) * tick.progress
        assert tick.energy == pytest.approx(energy, abs=0.01)
        # Between two frames a few sparks go out, and none is born.
        low, high = sorted((sparks[tick.place], sparks[after]))
        assert 0.6 * low <= sum(sum(row[5:8]) for row in tick.flakes) <= 1.01 * high
    steps: dict[bool, list[float]] = {False: [], True: []}
    for one, other in itertools.pairwise(walked):
        steps[one.animation != other.animation].append(abs(one.energy - other.energy))
    assert max(steps[True]) < 1.5 * max(steps[False])


def test_the_level_of_the_page_is_warm_while_its_fire_burns(answers: Mapping[str, Any]) -> None:
    """Its key is pressed three times, the last time shortly before it is asked."""
    assert answers["level"] == [False, True, True]


def test_scenes_of_sparks_alone_are_of_the_fire_that_burns(game: Path) -> None:
    assert [path.name for path in game.glob("fire*_particles.tscn")] == ["fire.burn_particles.tscn"]
    assert '\nanimation = "burn"\n' in (game / "at_once_flakes_3d.tscn").read_text()


def test_the_script_is_sound(game: Path) -> None:
    for program in ("gdparse", "gdlint"):
        tool = Path(sysconfig.get_path("scripts")) / program
        subprocess.run([tool, game / "fire_phases.gd"], check=True, capture_output=True)


def test_the_node_of_the_add_on_is_lit_and_put_out(answers: Mapping[str, Any]) -> None:
    states = [state for _, state in answers["node"]]
    assert [state["animation"] for state in states] == ["extinguish"] * 3 + ["ignite", "burn"]
    # Whoever plays a fire that is out lights nothing.
    assert [state["signals"] for state in states] == [["went_out"]] * 4 + [["went_out", "lit"]]
    assert all(state["playing"] for state in states)
    assert not any(state["ended"] for state in states)


def test_the_node_in_space_is_lit_and_put_out(game: Path, answers: Mapping[str, Any]) -> None:
    fire, now, signals = Fire(game, "at_once"), ("burn", 0), list[str]()
    seen, left = answers["space"]
    dark = "extinguish", fire.counts["extinguish"] - 1
    for i, (name, frame, visible, sparks, energy, sent) in enumerate(seen):
        if (name, frame) != now:
            now = fire.after(now, burning=not 4 <= i < 34)
            assert (name, frame) == now
        assert visible
        assert (sparks > 0, energy > 0) == (now != dark,) * 2
        signals += sent
    assert signals == ["went_out", "lit"]
    (lit, *out), left_too = answers["space gone"]
    assert lit[2] and lit[4] > 0
    assert [each[2:] for each in out] == [[False, 0, 0, ["went_out"]], [False, 0, 0, []]]
    assert left == left_too == 0
