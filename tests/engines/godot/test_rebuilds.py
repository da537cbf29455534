"""Files live on in a game: names never change, and what others wrote in them survives a build."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.engines.godot.import_settings import import_settings
from fire_atlas.engines.godot.names import derived_uid

REFERENCE = re.compile(r'^\[ext_resource .*uid="(.*?)" path="(.*?)"', re.MULTILINE)
UID = re.compile(r"uid://[a-y0-8]{1,13}")

REWRITTEN = """\
[remap]

importer="texture"
type="CompressedTexture2D"
uid="uid://cxjsam1fyjnui"
path="res://.godot/imported/fire.png-0123456789abcdef0123456789abcdef.ctex"
metadata={
"vram_texture": false
}

[deps]

source_file="res://art/fire.png"
dest_files=["res://.godot/imported/fire.png-0123456789abcdef0123456789abcdef.ctex"]

[params]

compress/mode=3
compress/high_quality=false
compress/lossy_quality=0.7
mipmaps/generate=true
mipmaps/limit=-1
roughness/src_normal=""
process/fix_alpha_border=true
process/premult_alpha=false
process/size_limit=512
detect_3d/compress_to=1
my_plugin/custom="[params] uid=3; process/premult_alpha=true"
"""
"""As Godot 4 leaves it, and as somebody set compression, mipmaps, a limit and a plugin's own."""


def build(folder: Path, out: str = "art", *options: str, **changes: Any) -> str:
    """Build a small fire in ``folder``; return what was said."""
    folder.mkdir(exist_ok=True)
    keys: dict[str, Any] = {
        "source": {"path": str(shipped("samples") / "campfire"), "count": 5, "height": 60},
        "atlas": {"alpha": "premultiplied", "max_size": 64, "scales": [1, 0.5]},
        "exports": ["godot"],
        "tracks": ["csv"],
    }
    keys |= {key: {**keys.get(key, {}), **value} if isinstance(value, dict) else value
             for key, value in changes.items()}  # fmt: skip
    (folder / "fire.yaml").write_text(json.dumps(keys))
    assert main(["build", str(folder / "fire.yaml"), "-o", str(folder / out), *options]) == 0
    return out


def uids(folder: Path) -> dict[str, str]:
    """Return the uid that each file gives itself."""
    found = {}
    for path in folder.iterdir():
        if path.suffix in (".tres", ".tscn", ".import", ".uid"):
            own = UID.search(path.read_text())
            found[path.name] = own[0] if own else ""
    return found


def test_uids_stay_whatever_else_changes(tmp_path: Path) -> None:
    build(tmp_path / "a")
    first = uids(tmp_path / "a/art")
    assert sum(name.endswith(".png.import") for name in first) >= 4  # pages, in two scales
    named = {name: uid for name, uid in first.items() if not name.endswith("csv.import")}
    assert len(set(named.values())) == len(named) >= 10
    assert all(UID.fullmatch(uid) for uid in named.values())
    others: list[dict[str, Any]] = [
        {"source": {"count": 6}}, {"seed": 9}, {"flakes": {"bake": False}},
        {"atlas": {"alpha": "straight"}},
    ]  # fmt: skip
    for i, changes in enumerate(others):
        build(tmp_path / "a", **changes)
        again = uids(tmp_path / "a/art")
        assert again.items() >= {k: v for k, v in first.items() if k in again}.items()
        build(tmp_path / f"b{i}", "other", **changes)
        elsewhere = uids(tmp_path / f"b{i}/other")
        assert all(first.get(name, uid) == uid for name, uid in elsewhere.items())


def test_references_are_those_of_the_files(tmp_path: Path) -> None:
    build(tmp_path / "a")
    own = uids(tmp_path / "a/art")
    referred = 0
    for path in (tmp_path / "a/art").glob("*.t*"):
        for uid, file in re.findall(
            r'^\[ext_resource .*uid="(.*?)" path="(.*?)"', path.read_text(), re.M
        ):
            stating = {".png": f"{file}.import", ".gd": f"{file}.uid"}.get(Path(file).suffix, file)
            assert own[stating] == uid
            assert (path.parent / file).is_file()
            referred += 1
    assert referred >= 6


def test_a_uid_is_63_bits_in_the_engines_letters() -> None:
    letters = "abcdefghijklmnopqrstuvwxy012345678"
    for i in range(1000):
        uid = derived_uid("fire", f"{i}.png")
        number = 0
        for letter in uid.removeprefix("uid://"):
            number = number * 34 + letters.index(letter)
        assert 2**40 < number < 2**63
    assert derived_uid("fire", "fire.png") != derived_uid("torch", "fire.png")


def test_a_uid_that_stands_in_a_file_is_kept(tmp_path: Path) -> None:
    folder = tmp_path / "art"
    folder.mkdir()
    theirs = {
        "fire.tres": '[gd_resource type="SpriteFrames" load_steps=2 format=3 uid="uid://b1"]\n\n'
        '[ext_resource type="Texture2D" uid="uid://c1" path="res://x.png" id="1"]\n',
        "fire.tscn": '[gd_scene load_steps=4 format=3 uid="uid://b2"]\n',
        "fire_flakes.gd.uid": "uid://b3\n",
        "fire.png.import": REWRITTEN,
    }
    for name, text in theirs.items():
        (folder / name).write_text(text)
    build(tmp_path, "art", "--overwrite")
    stated = uids(folder)
    assert [stated[name] for name in theirs] == [
        "uid://b1", "uid://b2", "uid://b3", "uid://cxjsam1fyjnui",
    ]  # fmt: skip


def changed_lines(before: str, after: str) -> set[str]:
    assert len(before.splitlines()) == len(after.splitlines())
    return {b for a, b in zip(before.splitlines(), after.splitlines(), strict=True) if a != b}


@pytest.mark.parametrize(
    ("alpha", "changed"),
    [
        ("premultiplied", {"process/fix_alpha_border=false", "process/size_limit=0"}),
        ("additive", {"process/fix_alpha_border=false", "process/size_limit=0"}),
        ("straight", {"process/size_limit=0"}),
    ],
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_only_what_must_hold_is_changed(alpha: str, changed: set[str], newline: str) -> None:
    theirs = REWRITTEN.replace("\n", newline)
    patched = import_settings(theirs.encode(), alpha, "uid://cxjsam1fyjnui").decode()
    assert changed_lines(theirs, patched) == changed
    assert patched.count("\r") == theirs.count("\r")
    again = import_settings(patched.encode(), alpha, "uid://cxjsam1fyjnui")
    assert again.decode() == patched


@pytest.mark.parametrize("cut", ["[params]", "compress/mode", "process/fix"])
def test_what_a_file_lacks_is_added(cut: str) -> None:
    """Older engines and other tools write fewer keys, or no section of them at all."""
    theirs = REWRITTEN.partition(cut)[0]
    patched = import_settings(theirs.encode(), "additive", "uid://cxjsam1fyjnui").decode()
    assert patched.startswith(theirs.rstrip())
    params = patched.partition("[params]")[2].split()
    assert [line for line in params if line.startswith(("process", "size"))] == [
        "process/fix_alpha_border=false", "process/premult_alpha=false", "process/size_limit=0",
    ]  # fmt: skip
    assert patched.count("[params]") == 1


@pytest.mark.parametrize(
    "theirs", [b"", b"\xff\xfe\x00", b"<<<<<<< HEAD\n", b'[remap]\n\nimporter="texture"\n']
)
def test_what_is_no_import_file_is_written_anew(theirs: bytes) -> None:
    new = import_settings(None, "straight", "uid://a")
    assert import_settings(theirs, "straight", "uid://a") == new
    assert b'uid="uid://a"' in new and b"process/fix_alpha_border=false" in new


def test_a_page_that_somebody_imports_as_something_else_is_left_alone() -> None:
    theirs = b'[remap]\n\nimporter="bitmap"\ntype="BitMap"\n'
    assert import_settings(theirs, "additive", "uid://a") == theirs


def test_a_build_that_changes_nothing_stays_one_after_the_engine_was_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build(tmp_path)
    page = tmp_path / "art/fire.png.import"
    mine = uids(page.parent)["fire.png.import"]
    theirs = REWRITTEN.replace("uid://cxjsam1fyjnui", mine)
    page.write_text(theirs)
    capsys.readouterr()
    build(tmp_path)
    assert "up to date" in capsys.readouterr().out
    assert page.read_text() == theirs
    build(tmp_path, seed=3)
    assert changed_lines(theirs, page.read_text()) == {
        "process/fix_alpha_border=false", "process/size_limit=0",
    }  # fmt: skip


def imported(folder: Path) -> None:
    """Fill in import settings as Godot 4 does, those of new pictures too."""
    for path in folder.rglob("*.png"):
        settings = path.with_name(f"{path.name}.import")
        own = UID.search(settings.read_text()) if settings.exists() else None
        text = REWRITTEN.replace("uid://cxjsam1fyjnui", own[0] if own else "uid://b4")
        text = text.replace("res://art/fire.png", f"res://{path.relative_to(folder).as_posix()}")
        settings.write_text(text)


def test_what_the_engine_imports_makes_nothing_stale(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither its changes to the settings of pages, nor settings beside the frames of the clip."""
    shutil.copytree(shipped("samples") / "campfire", tmp_path / "clip")
    keys: dict[str, Any] = {
        "source": {"path": "clip"},
        "maps": {"motion": "godot"},
        "atlas": {"layout": "grid"},
    }
    build(tmp_path, **keys, tracks=["light", "csv"])
    before = {path: path.read_bytes() for path in (tmp_path / "art").glob("*.import")}
    imported(tmp_path)
    assert any(path.read_bytes() != data for path, data in before.items())
    recipe, art = str(tmp_path / "fire.yaml"), tmp_path / "art"
    assert main(["build", "--frozen", recipe, "-o", str(art)]) == 0
    capsys.readouterr()
    assert main(["build", recipe, "-o", str(art)]) == 0
    assert "up to date" in capsys.readouterr().out
    assert main(["clean", recipe, "-o", str(art)]) == 0
    assert not art.exists() or not list(art.iterdir())
