"""``build --frozen``: for CI, which is to find everything built."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from fire_atlas.core.cpu import cpu_class
from tests.cli.test_imports import HEAVY, imported

Run = Callable[..., CompletedProcess[str]]


@pytest.fixture
def built(run: Run, campfire: Path) -> Path:
    assert run("build", campfire.name, "-q").returncode == 0
    return campfire


def tree_of(folder: Path) -> dict[Path, tuple[int, bytes]]:
    """Return all files of a folder with what would show that one was written."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in files}


def build_on_another_cpu(recipe: Path) -> None:
    """Make the manifest that a build on another class of CPU would have left."""
    manifest = recipe.parent / "build" / "campfire.manifest.json"
    document = json.loads(manifest.read_text())
    assert document["statistics"]["cpu"] == cpu_class()
    document["statistics"]["cpu"] = "x86-64-v1"
    manifest.write_text(json.dumps(document))


def test_what_is_up_to_date_passes(run: Run, built: Path) -> None:
    before = tree_of(built.parent)
    done = run("build", built.name, "--frozen", "--depfile", "fire.d")
    assert (done.returncode, done.stdout, done.stderr) == (0, "campfire.yaml: up to date\n", "")
    assert tree_of(built.parent) == before


def test_nothing_heavy_is_imported_to_find_it_up_to_date(
    built: Path, environment: dict[str, str]
) -> None:
    modules = imported(["build", built.name, "--frozen"], built.parent, environment)
    assert modules.isdisjoint((*HEAVY, "pydantic"))


def test_what_is_stale_fails_with_the_reason_and_nothing_is_written(run: Run, built: Path) -> None:
    (built.parent / "clip" / "0005.png").unlink()
    before = tree_of(built.parent)
    done = run("build", built.name, "--frozen", "--depfile", "fire.d")
    assert done.returncode == 1
    assert "campfire.yaml: would be rebuilt: " in done.stderr
    assert "clip/0005.png is gone" in done.stderr
    assert tree_of(built.parent) == before


def test_what_was_never_built_fails(run: Run, campfire: Path) -> None:
    done = run("build", campfire.name, "--frozen")
    assert done.returncode == 1
    assert "holds no valid campfire.manifest.json" in done.stderr
    assert not (campfire.parent / "build").exists()


def test_each_recipe_that_is_stale_is_named(run: Run, built: Path) -> None:
    for name in ("one", "two"):
        (built.parent / f"{name}.yaml").write_text("source: {path: clip}\nflakes: none\n")
    done = run("build", ".", "--frozen")
    assert done.returncode == 1
    assert "one.yaml: would be rebuilt" in done.stderr
    assert "two.yaml: would be rebuilt" in done.stderr
    assert "campfire.yaml: up to date" in done.stdout


def test_force_rebuilds_everything_so_nothing_passes(run: Run, built: Path) -> None:
    before = tree_of(built.parent)
    done = run("build", built.name, "--frozen", "--force")
    assert done.returncode == 1
    assert "would be rebuilt: --force" in done.stderr
    assert tree_of(built.parent) == before


def test_a_recipe_that_is_wrong_is_reported_as_such(run: Run, campfire: Path) -> None:
    campfire.write_text("source: {path: clip}\nseeed: 3\n")
    done = run("build", campfire.name, "--frozen")
    assert done.returncode == 2
    assert "seeed" in done.stderr


def test_another_class_of_cpu_fails_with_advice(run: Run, built: Path) -> None:
    build_on_another_cpu(built)
    done = run("build", built.name, "--frozen")
    assert done.returncode == 1
    assert "built on a CPU of class x86-64-v1" in done.stderr
    assert f"this one is {cpu_class()}" in done.stderr
    assert "without --frozen" in done.stderr


def test_another_class_of_cpu_alone_makes_nothing_stale(run: Run, built: Path) -> None:
    build_on_another_cpu(built)
    before = tree_of(built.parent)
    done = run("build", built.name)
    assert (done.returncode, done.stdout) == (0, "campfire.yaml: up to date\n")
    assert tree_of(built.parent) == before
