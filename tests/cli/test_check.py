"""``check`` and ``schema``."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import yaml

Run = Callable[..., CompletedProcess[str]]


def test_a_good_recipe_is_ok_and_nothing_is_written(run: Run, campfire: Path) -> None:
    result = run("check", campfire.name)
    assert (result.returncode, result.stdout, result.stderr) == (0, "campfire.yaml: ok\n", "")
    assert not (campfire.parent / "build").exists()
    assert run("check", campfire.name, "-q").stdout == ""


def test_every_recipe_of_a_folder_is_checked(run: Run, campfire: Path) -> None:
    campfire.with_name("bad.yaml").write_text("source: {path: clip, fsp: 3}\n")
    result = run("check", ".")
    assert result.returncode == 2
    fault = "bad.yaml:1: source.fsp: unknown key; did you mean source.fps?"
    assert result.stdout == f"campfire.yaml: ok\n2 recipes: 1 ok, 1 failed\n  {fault}\n"
    assert f"error: {fault}" in result.stderr


def test_files_that_are_links_in_a_circle_are_missing(run: Run, campfire: Path) -> None:
    campfire.with_name("loop").symlink_to("loop")
    campfire.with_name("a.yaml").write_text("source: {path: loop}\n")
    campfire.with_name("b.yaml").write_text("extends: loop\n")
    campfire.with_name("c.yaml").symlink_to("c.yaml")
    said = run("check", "a.yaml", "b.yaml").stderr
    assert "a.yaml:1: source.path" in said and "b.yaml:1: extends" in said and "bug" not in said
    assert "c.yaml: there is no such recipe file" in run("check", "c.yaml").stderr


def test_resolved_prints_the_whole_recipe(run: Run, campfire: Path) -> None:
    result = run("check", campfire.name, "--resolved", "--set", "seed=7")
    values = yaml.safe_load(result.stdout)
    assert (values["name"], values["seed"], values["source"]["path"]) == ("campfire", 7, "clip")
    campfire.with_name("again.yaml").write_text(result.stdout)
    assert run("check", "again.yaml").returncode == 0


def test_schema_prints_json(run: Run) -> None:
    result = run("schema")
    assert result.returncode == 0
    assert json.loads(result.stdout)["title"] == "fire-atlas recipe"
