"""Which files a recipe writes: all that its builds write, and nothing else."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fire_atlas.core.shipped import shipped
from fire_atlas.pipeline.files.expected import expected_outputs, files, unexpected
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.tree import read_tree
from tests.support.repo import Repo

GODOT = {"exports": ["json", "godot"], "tracks": ["csv", "light", "json"]}
RECIPES: dict[str, dict[str, Any]] = {
    "ramps": {
        "composite": {"ramp": ["soul", {"hue": 200}]},
        "tracks": ["json", "light"], "movies": ["gif"],
    },
    "godot": GODOT,
    "godot with maps": {
        **GODOT,
        "maps": {"motion": "godot", "haze": True, "flakes": True},
        "atlas": {"layout": "grid", "scales": [1, 0.5]},
    },
    "godot by heat": {**GODOT, "atlas": {"pixels": "heat", "ramp": "campfire"}},
    "unity": {
        "exports": ["json-array", {"unity": {"assembly": True, "namespace": "My.Fires"}}],
        "tracks": ["json", "pcache", "hjson", "light"],
        "maps": {"haze": True},
        "movies": ["webp", "gif", "apng"],
    },
    "unity, premultiplied": {
        "exports": ["unity"], "atlas": {"alpha": "premultiplied", "scales": [1, 0.25]},
    },
    "unity by heat, from its package": {
        "exports": [{"unity": {"player": "package"}}],
        "tracks": ["light"],
        "atlas": {"pixels": "heat", "ramp": "campfire"},
    },
    "both": {
        "exports": ["godot", "unity"], "tracks": ["csv", "light"], "flakes": {"bake": False},
        "maps": {"flame": True, "emission": "exr"},
    },
    "web": {
        "exports": ["phaser", "css", "tpsheet", "aseprite"],
        "atlas": {"max_size": 160, "format": "webp"},
        "movies": ["apng"],
    },
    "no flakes": {"exports": ["godot", "unity"], "flakes": "none", "tracks": ["light", "csv"]},
}  # fmt: skip


def recipe_of(path: Path) -> Recipe:
    return load_checked(read_tree(path)).recipe


def may_write(recipe: Recipe, file: str) -> bool:
    """Return whether a build may write a file of this name, whatever it is for."""
    roles = {each.role for each in files(recipe)} | {"template"}
    return any(not list(unexpected(recipe, [(file, role)])) for role in roles)


@pytest.mark.parametrize("name", RECIPES)
def test_every_file_of_a_build_is_one_that_its_recipe_writes(name: str, repo: Repo) -> None:
    repo.clip(count=6, height=64)
    path = repo.recipe(**RECIPES[name])
    repo.built(path)
    recipe = recipe_of(path)
    listed = json.loads((repo.build / "fire.manifest.json").read_bytes())["outputs"]
    written = [(entry["path"], entry["role"]) for entry in listed]
    assert list(unexpected(recipe, written)) == []
    assert {*expected_outputs(recipe)} <= {*written, ("fire.manifest.json", "manifest")}


PLANTED = (
    "fire.Editor.cs", "fire.cs", "fire.gd", "fire.exe", "fire.dll", "fire_plugin.gd", "fire.asmdef",
    "fire.js", "fire.bat", "fire.png.exe", "fire-1.gd", "fire.gd.uid", "fire.cs.meta", "fire.so",
    "fire_flakes.gd.exe", "fire.py", "other.png", "fire.html", "fire", "fire.evil.tscn",
    "fire.evil.png", "fire-evil.json", "fire-01.png", "fire-0.png", "fire@2x.png", "Fire.png",
    "fire.Editor.cs.meta", "fire.shader.meta.meta", "firepng", ".json", "fire..png",
)  # fmt: skip


@pytest.mark.parametrize("name", RECIPES)
def test_what_no_build_of_a_recipe_writes_is_not_among_them(name: str, repo: Repo) -> None:
    recipe = recipe_of(repo.recipe(**RECIPES[name]))
    assert [file for file in PLANTED if may_write(recipe, file)] == []


RUN = (".cs", ".gd", ".dll", ".exe", ".so", ".dylib", ".js", ".py", ".bat", ".asmdef")
SCRIPTS = re.compile(
    r"fire_(flakes|heat|start)\.cs|My\.Fires\.asmdef"
    r"|fire_(flakes|flake_tracks|flakes_3d|haze|heat|light|motion|phases|start|wind)\.gd"
)


@pytest.mark.parametrize("name", RECIPES)
@given(data=st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_put_together_no_program_but_an_exports_own_is_among_them(
    name: str, repo: Repo, data: st.DataObject
) -> None:
    recipe = recipe_of(repo.recipe(**RECIPES[name]))
    known = [each for each in files(recipe) if each.role != "manifest"]
    part = st.sampled_from([*(each.stem for each in known), *(each.ending for each in known), *RUN])
    between = st.sampled_from(["", "-1", "-2", ".a", ".view_0", "_", "@0.5x", ".meta", ".import"])
    pieces = data.draw(st.lists(part | between | st.text(max_size=3), max_size=4))
    file = "".join((*pieces, data.draw(st.sampled_from(RUN))))
    assert not may_write(recipe, file) or SCRIPTS.fullmatch(file)


def test_each_page_and_animation_may_have_its_files(repo: Repo) -> None:
    recipe = recipe_of(repo.recipe(
        exports=["json", "css", "godot", "unity"], tracks=["csv", "light"], movies=["gif"],
        atlas={"gpu": ["bc7.dds"], "scales": [1, 0.5]}, maps={"flame": True},
    ))  # fmt: skip
    written = [
        ("fire-1.png", "page"), ("fire@0.5x-12.flame.png", "map"), ("fire-1.json", "atlas"),
        ("fire-3.flame.bc7.dds", "texture"), ("fire-1.png.import", "import"),
        ("fire-1.png.meta", "import"),
        ("fire.view_0.flakes.csv", "tracks"), ("fire.in.wind.light.json", "light"),
        ("fire.view_0.flakes.csv.import", "import"), ("fire.view_0.gif", "movie"),
        ("fire@0.5x.view_0.anim", "engine"), ("fire.view_0_particles.tscn", "scene"),
    ]  # fmt: skip
    assert list(unexpected(recipe, written)) == []
    wrong = [
        ("fire-1.css", "atlas"), ("fire-1.tres", "scene"), ("fire-99999.png", "page"),
        ("fire-1.png", "import"), ("fire.png", "template"), ("fire_flakes.gd", "scene"),
    ]  # fmt: skip
    assert list(unexpected(recipe, wrong)) == [file for file, _ in wrong]


def test_scripts_are_an_engines_own(repo: Repo) -> None:
    web = recipe_of(repo.recipe(**RECIPES["web"]))
    unity = recipe_of(repo.recipe(**RECIPES["unity"]))
    godot = recipe_of(repo.recipe(**RECIPES["godot"]))
    for file, writer in (("fire_flakes.gd", godot), ("fire_flakes.cs", unity)):
        assert [may_write(each, file) for each in (web, unity, godot)] == [
            False, unity is writer, godot is writer
        ]  # fmt: skip


@pytest.mark.parametrize(
    ("to", "written", "others"),
    [
        ("{{ name }}.txt", ["fire.txt", "fire@0.5x.txt"], ["fire.txt.exe", "fire.cs", "fire.TXT"]),
        ("{{ name }}.cs", ["fire.cs", "fire_1.cs"], ["fire.gd", "fire.cs.exe"]),
        ("list", ["list"], ["list.gd", "lists"]),
        ("l[i]s?", ["l[i]s?"], ["lis_", "li"]),
        ("fire.{{ 'gd' }}", ["fire.ini"], ["fire.gd", "fire.exe", "fire.tscn", "fire.GD"]),
        ("{{ '}}' }}.txt", ["}}.txt"], ["x.cs"]),
        ("{% if scale == 1 %}a{% else %}b{% endif %}.ini", ["a.ini", "b.ini"], ["a.ini.cs"]),
        ("a {{- name -}} b{# no #}.txt", ["afireb.txt"], ["fire.txt"]),
    ],
)
def test_a_template_writes_what_its_to_says(
    to: str, written: list[str], others: list[str], repo: Repo
) -> None:
    (repo.folder / "list.j2").write_text("{{ name }}")
    recipe = recipe_of(repo.recipe(exports=[{"template": "list.j2", "to": to}]))
    given = [(file, "template") for file in (*written, *others)]
    assert list(unexpected(recipe, given)) == others


def test_a_name_is_compared_with_many_variables_at_once(repo: Repo) -> None:
    (repo.folder / "list.j2").write_text("{{ name }}")
    to = "{{a}}a" * 33
    recipe = recipe_of(repo.recipe(exports=[{"template": "list.j2", "to": to}]))
    assert list(unexpected(recipe, [("a" * 200 + "b", "template")]))


@pytest.mark.parametrize("name", sorted(path.stem for path in shipped("recipes").glob("*.yaml")))
def test_what_a_ready_recipe_writes_for_certain_it_may_write(name: str) -> None:
    expected = list(expected_outputs(recipe_of(shipped("recipes") / f"{name}.yaml")))
    assert expected
    assert list(unexpected(recipe_of(shipped("recipes") / f"{name}.yaml"), expected)) == []
