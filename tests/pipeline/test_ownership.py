"""Only what a manifest vouches for is ever replaced or removed: all else is somebody's work."""

import errno
import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.files import read_file
from fire_atlas.core.output_file import Role
from fire_atlas.pipeline.files.expected import expected_outputs
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.tree import read_tree
from tests.support.repo import Repo, contents

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
    repo: Repo, name: str
) -> None:
    repo.clip()
    recipe = repo.recipe(exports=["json", "godot"])
    repo.build.mkdir()
    (repo.build / name).write_bytes(b"mine")
    ran = repo.run("build", recipe)
    assert ran.code == 1 and contents(repo.build) == {name: b"mine"}
    assert f"{name}: " in ran.err and "--overwrite" in ran.err and "-o" in ran.err
    assert repo.run("build", recipe, "--overwrite").code == 0
    assert (repo.build / name).read_bytes() != b"mine"


def test_every_taken_name_is_listed_before_a_frame_is_decoded(repo: Repo) -> None:
    repo.clip()
    frame = repo.folder / "clip" / "0001.png"
    frame.write_bytes(frame.read_bytes()[:-40])  # its header is sound
    recipe = repo.recipe()
    repo.build.mkdir()
    for name in ("fire.png", "fire.json"):
        (repo.build / name).write_bytes(b"mine")
    said = repo.run("build", recipe).err
    assert "fire.png: was there before" in said and "fire.json: was there before" in said
    assert "0001.png" not in said


def test_a_name_that_is_known_late_is_refused_before_the_commit(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe()
    before = repo.built(recipe)
    (repo.build / "fire-1.png").write_bytes(b"mine")
    many = ("--set", "atlas.max_size=100")
    ran = repo.run("build", recipe, *many)
    assert ran.code == 1 and "fire-1.png: was there before" in ran.err
    assert contents(repo.build) == before | {"fire-1.png": b"mine"}
    assert repo.run("build", recipe, *many, "--overwrite").code == 0


def test_line_endings_of_text_do_not_count(repo: Repo, recipe: Path) -> None:
    """Version control may have checked the outputs out in its own way."""
    described = repo.build / "fire.json"
    described.write_bytes(described.read_bytes().replace(b"\n", b"\r\n"))
    assert repo.run("build", recipe, "--set", "seed=5").code == 0
    assert b"\r" not in described.read_bytes()


def test_an_engines_own_words_in_import_settings_are_no_reason_to_refuse(
    repo: Repo,
) -> None:
    repo.clip()
    recipe = repo.recipe(exports=["json", "godot"])
    repo.built(recipe)
    settings = repo.build / "fire.png.import"
    text = settings.read_text() + '\n[deps]\n\nsource_file="res://build/fire.png"\n'
    settings.write_text(text + "\nmy_plugin/custom=3\n")
    assert repo.run("build", recipe, "--set", "seed=5").code == 0
    assert "my_plugin/custom=3" in settings.read_text()


@pytest.mark.parametrize("command", ["build", "clean"])
@pytest.mark.parametrize(
    ("subject", "name"), [("x", "x.txt"), ("x.png", "x.png.import"), ("x.png", "x.png.meta")]
)
def test_calling_a_file_import_settings_does_not_make_it_ours(
    repo: Repo, recipe: Path, command: str, subject: str, name: str
) -> None:
    (repo.build / name).write_bytes(b"mine")
    add_entry(repo.build, subject, "page", b"")
    add_entry(repo.build, name, "import", b"")
    repo.run(command, recipe, *(["--force"] if command == "build" else []))
    assert (repo.build / name).read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["torch.manifest.json", ".gitignore"])
def test_a_manifest_removes_no_name_that_builds_keep_for_themselves(
    repo: Repo, recipe: Path, name: str
) -> None:
    (repo.build / name).write_bytes(b"mine")
    add_entry(repo.build, name, "template", b"mine")
    repo.run("clean", recipe)
    assert contents(repo.build) == {name: b"mine"}


@posix
@pytest.mark.parametrize("command", ["build", "clean"])
def test_a_link_to_what_a_manifest_lists_is_not_followed(
    repo: Repo, recipe: Path, command: str
) -> None:
    mine = repo.folder / "mine.txt"
    mine.write_bytes(b"mine")
    (repo.build / "fire.txt").symlink_to(mine)
    add_entry(repo.build, "fire.txt", "template", b"mine")
    repo.run(command, recipe, *(["--force"] if command == "build" else []))
    assert (repo.build / "fire.txt").is_symlink() and mine.read_bytes() == b"mine"


@pytest.mark.parametrize("to", ["torch.manifest.json", "{{ name }}.Manifest.JSON"])
def test_a_template_writes_no_name_that_builds_keep_for_themselves(repo: Repo, to: str) -> None:
    repo.clip()
    (repo.folder / "mine.j2").write_text("{}")
    ran = repo.run("build", repo.recipe(exports=[{"template": "mine.j2", "to": to}]))
    assert ran.code == 1 and "a name reserved for the tool's own files" in ran.err
    assert not repo.build.exists()


def built_with_a_shared_file(repo: Repo) -> tuple[Path, Path]:
    """Build two recipes into one folder, both of which write ``shared.txt``."""
    repo.clip()
    (repo.folder / "shared.j2").write_text("the same for all")
    exports = [{"template": "shared.j2", "to": "shared.txt"}]
    fire, torch = (repo.recipe(f"{name}.yaml", exports=exports) for name in ("fire", "torch"))
    repo.built(fire)
    repo.built(torch)
    return fire, torch


def test_a_file_that_two_builds_wrote_stays_until_both_are_cleaned(repo: Repo) -> None:
    fire, torch = built_with_a_shared_file(repo)
    ran = repo.run("clean", fire)
    assert "shared.txt: the build of torch wrote it too" in ran.out
    assert (repo.build / "shared.txt").exists() and not (repo.build / "fire.png").exists()
    repo.built(fire)
    repo.recipe("fire.yaml")
    assert "shared.txt" in repo.built(fire), "it is no longer fire's, but still torch's"
    repo.run("clean", torch)
    assert not (repo.build / "shared.txt").exists()


@pytest.mark.parametrize("reason", [errno.EACCES, errno.EIO])
def test_a_manifest_that_cannot_be_read_stops_a_build_from_removing_what_it_may_list(
    repo: Repo, reason: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    fire, _ = built_with_a_shared_file(repo)
    before = contents(repo.build)
    repo.recipe("fire.yaml")  # writes shared.txt no more

    def unreadable(path: Path, max_bytes: int) -> bytes:
        if path.name == "torch.manifest.json":
            raise OSError(reason, "the device failed", str(path))
        return read_file(path, max_bytes)

    monkeypatch.setattr("fire_atlas.outputs.ownership.read_file", unreadable)
    ran = repo.run("build", fire)
    assert ran.code == 1 and "torch.manifest.json: cannot be read (the device failed)" in ran.err
    assert contents(repo.build) == before


def test_overwriting_spares_what_belongs_to_another_build(repo: Repo) -> None:
    repo.clip()
    taken = repo.built(repo.recipe("fire-1.yaml"))
    ran = repo.run("build", repo.recipe(), "--set", "atlas.max_size=100", "--overwrite")
    assert ran.code == 1 and "belongs to the build of fire-1" in ran.err
    assert contents(repo.build) == taken


@pytest.mark.parametrize(
    "keys",
    [
        {"exports": ["json", "json-array", "phaser", "css", "tpsheet", "godot", "unity"]},
        {"exports": ["aseprite"], "atlas": {"scales": [1, 0.5], "format": "webp"}},
        {"maps": {"motion": "godot", "flame": True, "flakes": True}, "exports": ["unity"]},
        {"atlas": {"pixels": "heat4", "gpu": ["bc7.dds"]}, "exports": ["godot", "unity"]},
        {"flakes": "none", "tracks": ["light"]},
        {"tracks": ["json", "csv", "pcache", "hjson", "light"]},
    ],
)
def test_what_is_expected_before_any_work_is_written(repo: Repo, keys: dict[str, Any]) -> None:
    repo.clip()
    recipe = repo.recipe(**keys)
    expected: dict[str, Role] = dict(expected_outputs(load_tree(read_tree(recipe)).recipe))
    written = repo.built(recipe)
    roles = {entry["path"]: entry["role"] for entry in listed(repo.build)["outputs"]}
    assert expected.items() <= (roles | {"fire.manifest.json": "manifest"}).items()
    assert expected.keys() <= written.keys() and "fire.manifest.json" in expected
    images = {name for name, role in expected.items() if role in {"page", "map", "ramp"}}
    settings = {f"{image}{ending}" for image in images for ending in (".import", ".meta")}
    assert settings & written.keys() <= expected.keys()


def test_a_manifest_that_lies_removes_no_material_of_the_users(repo: Repo) -> None:
    """It calls it the import settings of a file that it lists, and states no digest of it."""
    repo.clip()
    recipe = repo.recipe()
    repo.built(recipe)
    mine = repo.build / "Hero.mat"
    mine.write_text("%YAML 1.1\n--- !u!21\nMaterial:\n  m_Name: mine\n", encoding="utf-8")
    path = repo.build / "fire.manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    for name, role in (("Hero", "page"), ("Hero.mat", "import")):
        manifest["outputs"].append({"path": name, "role": role, "bytes": 1, "sha256": "0" * 64})
    path.write_text(json.dumps(manifest), encoding="utf-8")
    assert repo.run("clean", recipe).code == 0
    assert "mine" in mine.read_text(encoding="utf-8")
