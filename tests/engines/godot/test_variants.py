"""Fires of one recipe that differ, in the engine: each that is placed shows another one."""

import json
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from tests.engines.godot.test_flakes import assert_alike, built_tracks, wanted
from tests.engines.godot.test_nodes import build
from tests.engines.godot.test_own_start import COUNT, FLAT, began
from tests.support.godot4 import Godot4
from tests.support.wind import SILK

TINY: dict[str, Any] = {**SILK["source"], "width": 24, "height": 28, "rows": 6, "columns": 4}
"""What is seen of the fires is their names."""

SMALL: dict[str, Any] = {
    "source": TINY, "timeline": {"frames": 8, "fps": 8}, "flakes": {"bake": False},
    "tracks": ["light"], "exports": ["json", "godot"], "variants": 3,
}  # fmt: skip

RECIPES: dict[str, dict[str, Any]] = {
    "plain": SMALL,
    "views": {**SMALL, "views": {"count": 2}},
    "windy": {**SMALL, "wind": SILK["wind"], "variants": 2},
    "phased": {**SMALL, "phases": {"ignite": 0.5, "extinguish": 0.5}},
    "heat": {**SMALL, "atlas": {"pixels": "heat"}, "variants": 2},
    "sets": {**SMALL, "variants": 1, "flakes": {"bake": False, "rate": 60, "variants": 3},
             "tracks": ["json"]},
    "together": {"atlas": {"members": ["plain.yaml", "two.yaml"]}, "exports": ["json", "godot"]},
}  # fmt: skip

FIRES = {
    "plain": {"v0", "v1", "v2"},
    "plain_film": {"v0", "v1", "v2"},
    "views": {"v0_view_0", "v1_view_0", "v2_view_0"},
    "windy": {"v0_wind_0", "v1_wind_0"},
    "phased": {"v0_burn", "v1_burn", "v2_burn"},
    "phased_film": {"v0_burn", "v1_burn", "v2_burn"},
    "heat": {"v0", "v1"},
    "together": {"plain_v0", "plain_v1", "plain_v2"},
    "plain_flakes_3d": {"v0", "v1", "v2"},
}
"""What scenes show when they are placed."""


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("variants")
    (folder / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", "godot", str(folder), "-q"]) == 0
    (folder / "own_start.gd").write_text(Path(__file__).with_name("own_start.gd").read_text())
    (folder / "two.yaml").write_text(json.dumps({**SMALL, "variants": 2, "tracks": []}))
    for name, recipe in RECIPES.items():
        build(folder, name, recipe)
    return folder


def test_fires_that_are_placed_one_after_the_other_show_all_variants(
    game: Path, godot4: Godot4
) -> None:
    jobs = [began(scene) for scene in FIRES]
    nodes = {scene: kind for kind in ("2d", "3d") for scene in FIRES if "3d" not in scene}
    jobs += [began(scene, kind="2d") for scene in nodes]
    jobs += [began(scene, kind="3d") for scene in ("plain", "views", "phased", "together")]
    for job, fires in zip(jobs, godot4.run(game, jobs), strict=True):
        name = job["scene"].removeprefix("res://").removesuffix(".tscn")
        shown = [fire["animation"] for fire in fires]
        wanted = FIRES[name]
        assert set(shown) == wanted, job
        for at in range(COUNT - len(wanted)):  # so many neighbours all differ
            assert len({*shown[at : at + len(wanted)]}) == len(wanted), (job, shown)


@pytest.mark.parametrize("scene", ["plain", "windy", "phased", "together"])
def test_a_variant_may_be_chosen_and_one_too_many_begins_again(
    scene: str, game: Path, godot4: Godot4
) -> None:
    names = sorted(FIRES[scene])
    jobs = [began(scene, set={"variant": number}) for number in range(4)]
    jobs += [began(scene, set={"variant": number}, kind="2d") for number in range(4)]
    if scene != "windy":
        jobs += [began(scene, set={"variant": number}, kind="3d") for number in range(4)]
    for job, fires in zip(jobs, godot4.run(game, jobs), strict=True):
        wanted = names[job["set"]["variant"] % len(names)]
        assert {fire["animation"] for fire in fires} == {wanted}, job


def test_a_variant_is_lit_and_put_out_and_passes_from_wind_to_wind(
    game: Path, godot4: Godot4
) -> None:
    """It follows its own part of the graph of states."""
    fast = {":speed_scale": "8.0"}
    walk = {"do": "change_wind", "scene": "res://windy.tscn", "set": fast,
            "winds": [5.0] * 90 + [0.0] * 90}  # fmt: skip
    (walked,) = godot4.run(game, [walk])
    shown = list(dict.fromkeys(animation for animation, *_ in walked))
    ways = ["0", "0_1", "1", "1_2", "2", "2_1", "1_0"]
    assert shown == [f"{shown[0][:2]}_wind_{way}" for way in ways]
    job = {"do": "ask", "script": "res://own_start.gd", "scene": "res://phased.tscn",
           "put_out": True, "set": {"variant": 2, "speed_scale": 8.0}}  # fmt: skip
    (passed,) = godot4.run(game, [job])
    assert passed[0] == "v2_burn" and passed[-1] == "v2_burn"
    assert all(animation.startswith("v2_") for animation in passed)
    assert "v2_extinguish" in passed and "v2_ignite" in passed


def test_sparks_and_lamp_are_those_of_the_variant(game: Path, godot4: Godot4) -> None:
    (fires,) = godot4.run(game, [began("plain", set={"random_start": False})])
    for fire in fires:
        light = json.loads((game / f"plain.{fire['animation']}.light.json").read_text())["frames"]
        whole, part = int(fire["time"]), fire["time"] % 1
        between = light[whole]["intensity"] * (1 - part) + light[whole + 1]["intensity"] * part
        assert fire["lamp"] == pytest.approx(between, abs=1e-3)
    assert len({fire["sparks"] for fire in fires}) > 1


def test_a_set_of_flakes_may_be_chosen_and_flies_as_its_tracks_say(
    game: Path, godot4: Godot4
) -> None:
    job = {"do": "seek_flakes", "scene": "res://sets.tscn", "animation": "sets", "times": [0, 7]}
    jobs = [{**job, "set": {"Flakes:flake_set": str(number)}} for number in range(4)]
    for number, seen in enumerate(godot4.run(game, jobs)):
        stem = "sets" if number % 3 == 0 else f"sets.v{number}"
        tracks, frames, pivot = built_tracks(game, stem, "sets")
        assert tracks["loop"]
        for time, rows in zip((0, 7), seen, strict=True):
            assert len(rows) > 3
            assert_alike(rows, wanted(frames[time], pivot))


def test_fires_that_are_placed_one_after_the_other_show_all_sets_of_flakes(
    game: Path, godot4: Godot4
) -> None:
    scenes = ("sets", "sets_film", "sets_flakes_3d")
    for fires in godot4.run(game, [began(scene) for scene in scenes]):
        shown = [fire["set"] % 3 for fire in fires]
        assert all({*shown[at : at + 3]} == {0, 1, 2} for at in range(COUNT - 2))


@pytest.mark.parametrize("kind", [None, "2d"])
@pytest.mark.parametrize("scene", ["flat", "flat_film"])
def test_fires_are_mirrored_if_they_may_be(
    scene: str, kind: str | None, game: Path, godot4: Godot4
) -> None:
    if not (game / "flat.tscn").exists():
        build(game, "flat", FLAT)
    keys = {} if kind is None else {"kind": kind}
    never, some = godot4.run(game, [
        began(scene, count=24, **keys),
        began(scene, count=24, set={"random_mirror": True}, **keys),
    ])  # fmt: skip
    assert {fire["mirrored"] for fire in never} == {False}
    assert {fire["mirrored"] for fire in some} == {False, True}
