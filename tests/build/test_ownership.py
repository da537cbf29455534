"""Only what a manifest vouches for is ever replaced or removed: all else is somebody's work."""

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.output_file import Role
from fire_atlas.pipeline.expected import expected_outputs
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.tree import read_tree

from .desk import Desk, contents

posix = pytest.mark.skipif(sys.platform == "win32", reason="symbolic links of POSIX")


def listed(build: Path, name: str = "fire") -> dict[str, Any]:
    document: dict[str, Any] = json.loads((build / f"{name}.manifest.json").read_bytes())
    return document


def add_entry(build: Path, path: str, role: str, data: bytes) -> None:
    """Let the manifest state one more output, of these bytes."""
    document = listed(build)
    sha256 = hashlib.sha256(data).hexdigest()
    document["outputs"].append({"path": path, "role": role, "bytes": len(data), "sha256": sha256})
    (build / "fire.manifest.json").write_text(json.dumps(document))


@pytest.mark.parametrize(
    "name", ["fire.png", "fire.json", "fire.flakes.json", "fire.manifest.json", "fire.png.import"]
)
def test_a_first_build_refuses_a_name_that_is_taken_and_says_what_to_do(
    desk: Desk, name: str
) -> None:
    desk.clip()
    recipe = desk.recipe(exports=["json", "godot"])
    desk.build.mkdir()
    (desk.build / name).write_bytes(b"mine")
    ran = desk.run("build", recipe)
    assert ran.code == 1 and contents(desk.build) == {name: b"mine"}
    assert f"{name}: " in ran.err and "--overwrite" in ran.err and "-o" in ran.err
    assert desk.run("build", recipe, "--overwrite").code == 0
    assert (desk.build / name).read_bytes() != b"mine"


def test_every_taken_name_is_listed_before_anything_is_read(desk: Desk) -> None:
    desk.clip()
    (desk.folder / "clip" / "0001.png").write_bytes(b"broken")
    recipe = desk.recipe()
    desk.build.mkdir()
    for name in ("fire.png", "fire.json"):
        (desk.build / name).write_bytes(b"mine")
    told = desk.run("build", recipe).err
    assert "fire.png: was there before" in told and "fire.json: was there before" in told
    assert "0001.png" not in told


def test_a_name_that_is_known_late_is_refused_before_the_commit(desk: Desk) -> None:
    desk.clip()
    recipe = desk.recipe()
    before = desk.built(recipe)
    (desk.build / "fire-1.png").write_bytes(b"mine")
    many = ("--set", "atlas.max_size=100")
    ran = desk.run("build", recipe, *many)
    assert ran.code == 1 and "fire-1.png: was there before" in ran.err
    assert contents(desk.build) == before | {"fire-1.png": b"mine"}
    assert desk.run("build", recipe, *many, "--overwrite").code == 0


def test_line_endings_of_text_do_not_count(desk: Desk, recipe: Path) -> None:
    """Version control may have checked the outputs out in its own way."""
    described = desk.build / "fire.json"
    described.write_bytes(described.read_bytes().replace(b"\n", b"\r\n"))
    assert desk.run("build", recipe, "--set", "seed=5").code == 0
    assert b"\r" not in described.read_bytes()


def test_an_engines_own_words_in_import_settings_are_no_reason_to_refuse(desk: Desk) -> None:
    desk.clip()
    recipe = desk.recipe(exports=["json", "godot"])
    desk.built(recipe)
    settings = desk.build / "fire.png.import"
    text = settings.read_text() + '\n[deps]\n\nsource_file="res://build/fire.png"\n'
    settings.write_text(text + "\nmy_plugin/custom=3\n")
    assert desk.run("build", recipe, "--set", "seed=5").code == 0
    assert "my_plugin/custom=3" in settings.read_text()


@pytest.mark.parametrize("command", ["build", "clean"])
@pytest.mark.parametrize(
    ("subject", "name"), [("x", "x.txt"), ("x.png", "x.png.import"), ("x.png", "x.png.meta")]
)
def test_calling_a_file_import_settings_does_not_make_it_ours(
    desk: Desk, recipe: Path, command: str, subject: str, name: str
) -> None:
    (desk.build / name).write_bytes(b"mine")
    add_entry(desk.build, subject, "page", b"")
    add_entry(desk.build, name, "import", b"")
    desk.run(command, recipe, *(["--force"] if command == "build" else []))
    assert (desk.build / name).read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["torch.manifest.json", ".gitignore"])
def test_a_manifest_removes_no_name_that_builds_keep_for_themselves(
    desk: Desk, recipe: Path, name: str
) -> None:
    (desk.build / name).write_bytes(b"mine")
    add_entry(desk.build, name, "template", b"mine")
    desk.run("clean", recipe)
    assert contents(desk.build) == {name: b"mine"}


@posix
@pytest.mark.parametrize("command", ["build", "clean"])
def test_a_link_to_what_a_manifest_lists_is_not_followed(
    desk: Desk, recipe: Path, command: str
) -> None:
    mine = desk.folder / "mine.txt"
    mine.write_bytes(b"mine")
    (desk.build / "fire.txt").symlink_to(mine)
    add_entry(desk.build, "fire.txt", "template", b"mine")
    desk.run(command, recipe, *(["--force"] if command == "build" else []))
    assert (desk.build / "fire.txt").is_symlink() and mine.read_bytes() == b"mine"


@pytest.mark.parametrize("to", ["torch.manifest.json", "{{ name }}.Manifest.JSON"])
def test_a_template_writes_no_name_that_builds_keep_for_themselves(desk: Desk, to: str) -> None:
    desk.clip()
    (desk.folder / "mine.j2").write_text("{}")
    ran = desk.run("build", desk.recipe(exports=[{"template": "mine.j2", "to": to}]))
    assert ran.code == 1 and "a name that builds keep for themselves" in ran.err
    assert not desk.build.exists()


def test_a_file_that_two_builds_wrote_stays_until_both_are_cleaned(desk: Desk) -> None:
    desk.clip()
    (desk.folder / "shared.j2").write_text("the same for all")
    exports = [{"template": "shared.j2", "to": "shared.txt"}]
    fire, torch = (desk.recipe(f"{name}.yaml", exports=exports) for name in ("fire", "torch"))
    desk.built(fire)
    desk.built(torch)
    ran = desk.run("clean", fire)
    assert "shared.txt: the build of torch wrote it too" in ran.out
    assert (desk.build / "shared.txt").exists() and not (desk.build / "fire.png").exists()
    desk.built(fire)
    desk.recipe("fire.yaml")
    assert "shared.txt" in desk.built(fire), "it is no longer fire's, but still torch's"
    desk.run("clean", torch)
    assert not (desk.build / "shared.txt").exists()


def test_overwriting_spares_what_belongs_to_another_build(desk: Desk) -> None:
    desk.clip()
    taken = desk.built(desk.recipe("fire-1.yaml"))
    ran = desk.run("build", desk.recipe(), "--set", "atlas.max_size=100", "--overwrite")
    assert ran.code == 1 and "belongs to the build of fire-1" in ran.err
    assert contents(desk.build) == taken


@pytest.mark.parametrize(
    "keys",
    [
        {"exports": ["json", "json-array", "phaser", "css", "tpsheet", "godot", "unity"]},
        {"exports": ["aseprite"], "atlas": {"scales": [1, 0.5], "format": "webp"}},
        {"maps": {"motion": "godot", "flame": True, "flakes": True}, "exports": ["unity"]},
        {"flakes": "none", "tracks": ["light"]},
        {"tracks": ["json", "csv", "pcache", "hjson", "light"]},
    ],
)
def test_what_is_expected_before_any_work_is_written(desk: Desk, keys: dict[str, Any]) -> None:
    desk.clip()
    recipe = desk.recipe(**keys)
    expected: dict[str, Role] = dict(expected_outputs(load_tree(read_tree(recipe)).recipe))
    written = desk.built(recipe)
    roles = {entry["path"]: entry["role"] for entry in listed(desk.build)["outputs"]}
    assert expected.items() <= (roles | {"fire.manifest.json": "manifest"}).items()
    assert expected.keys() <= written.keys() and "fire.manifest.json" in expected
