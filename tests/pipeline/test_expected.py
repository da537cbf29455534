"""Which files a recipe writes: all that its builds write, and nothing else that can run."""

from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.shipped import shipped
from fire_atlas.pipeline.check import load_checked
from fire_atlas.pipeline.expected import expected_outputs, may_write
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.tree import read_tree
from tests.support.repo import Repo

GODOT = {"exports": ["json", "godot"], "tracks": ["csv", "light", "json"]}
RECIPES: dict[str, dict[str, Any]] = {
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
    "web": {
        "exports": ["phaser", "css", "tpsheet", "aseprite"],
        "atlas": {"max_size": 160, "format": "webp"},
        "movies": ["apng"],
    },
}


def recipe_of(path: Path) -> Recipe:
    return load_checked(read_tree(path)).recipe


@pytest.mark.parametrize("name", RECIPES)
def test_every_file_of_a_build_is_one_that_its_recipe_writes(name: str, repo: Repo) -> None:
    repo.clip(count=6, height=64)
    path = repo.recipe(**RECIPES[name])
    written = repo.built(path)
    recipe = recipe_of(path)
    outputs = written.keys() - {"fire.manifest.json"}
    assert [file for file in outputs if not may_write(recipe, file)] == []
    certain = {file for file, _ in expected_outputs(recipe)}
    assert certain <= written.keys()


PLANTED = (
    "fire.Editor.cs", "fire.cs", "fire.gd", "fire.exe", "fire.dll", "fire_plugin.gd", "fire.asmdef",
    "fire.js", "fire.bat", "fire.png.exe", "fire-1.gd", "fire.gd.uid", "fire.cs.meta", "fire.so",
    "fire_flakes.gd.exe", "fire.py", "other.png", "fire.html", "fire",
)  # fmt: skip


@pytest.mark.parametrize("name", RECIPES)
@pytest.mark.parametrize("file", PLANTED)
def test_no_program_is_among_them(file: str, name: str, repo: Repo) -> None:
    assert not may_write(recipe_of(repo.recipe(**RECIPES[name])), file)


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
        ("{{ name }}.txt", ["fire.txt", "fire@0.5x.txt"], ["fire.txt.exe", "fire.cs", "a/b.txt"]),
        ("{{ name }}.cs", ["fire.cs", "fire_1.cs"], ["fire.gd", "fire.cs.exe"]),
        ("list", ["list"], ["list.gd", "lists"]),
        ("fire.{{ 'gd' }}", ["fire.ini"], ["fire.gd", "fire.exe"]),
    ],
)
def test_a_template_writes_what_its_to_says(
    to: str, written: list[str], others: list[str], repo: Repo
) -> None:
    (repo.folder / "list.j2").write_text("{{ name }}")
    recipe = recipe_of(repo.recipe(exports=[{"template": "list.j2", "to": to}]))
    assert [file for file in (*written, *others) if may_write(recipe, file)] == written


@pytest.mark.parametrize("name", sorted(path.stem for path in shipped("recipes").glob("*.yaml")))
def test_what_a_ready_recipe_writes_for_certain_it_may_write(name: str) -> None:
    recipe = recipe_of(shipped("recipes") / f"{name}.yaml")
    names = [file for file, role in expected_outputs(recipe) if role != "manifest"]
    assert names and [file for file in names if not may_write(recipe, file)] == []
