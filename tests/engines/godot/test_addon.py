"""The add-on for the editor: recipes become assets, and games hold what they need alone."""

import hashlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.engines.godot.engine import Game
from tests.support.godot4 import Godot4
from tests.support.repo import PACKAGE

PLAY = """\
extends SceneTree


func _init():
	var fire = load("res://my fires #1/torch.fire").instance()
	var flakes = fire.get_node("Flakes").tracks.rows.size() > 0
	print("plays %d frames, shows flakes: %s" % [fire.frames.get_frame_count("torch"), flakes])
	fire.free()
	quit()
"""

SAID = {
    '{"event": "note", "message": "it loops"}\n{"event": "done", "fresh": false}\n': (
        0, ["it loops"], True
    ),
    '{"event": "done", "fresh": true}\n': (0, [], False),
    '{"event": "error", "message": "a.fire:3: no"}\nerror: a.fire:3: no\n': (1, [], False),
    "sh: 1: the-command: not found\n": (2, [], False),
}  # fmt: skip
"""What the command prints -> how many errors that is, which notes, and whether it has built."""

STAND_INS = {
    r"extends Editor\w+": 'extends "res://editor.gd"',
    r": Editor(FileSystem|Settings)": ": Node",
    r"OS\.execute\(.*\)": 'said.append(FileAccess.get_file_as_string("user:/" + program))',
    r"push_warning\((.*)\)": r'calls.append(["warning", \1])',
    r'return "res://"': 'return "user://"',
}
"""What this runtime lacks: editor, commands, a folder for imports -> what is there instead."""

NEEDS = r"""/a\ \#$$b/t.manifest.json: \
  C\:/x\ y.png \
  /clip

C\:/x\ y.png:

/clip:
"""
"""A depfile."""

EXPORTED = {
    "user://build/torch.manifest.json": True,
    "user://build/torch.json": True,
    "user://build/torch.flakes.json": True,
    "user://build/torch.tscn": False,
    "keep user://build/torch.json": False,
    "keep user://build/torch.manifest.json": True,
    "user://mods/game.manifest.json": False,
    "res://addons/fire_atlas/plugin.gd": True,
    "res://addons/fire_atlas/program.gd": True,
    "res://addons/fire_atlas/node.gd": False,
}
"""Files of a project, before some what the setting is -> whether the exporter keeps them out."""

PRESET = """\
[preset.0]

name="pack"
platform="Linux/X11"
runnable=true
custom_features=""
export_filter="all_resources"
include_filter="*.json"
exclude_filter=""
export_path=""
script_export_mode=0
script_encryption_key=""

[preset.0.options]
"""


IN_THE_GAME = (
    "project.godot", "fire-atlas", "fire-atlas.exe", "fire-atlas.cmd", "fire-atlas.bat",
    "node_modules/.bin/fire-atlas", "node_modules/.bin/fire-atlas.exe", ".venv/bin/fire-atlas",
)  # fmt: skip
"""Files of a project that holds programs of the command's name."""

ELSEWHERE = (
    "tools/fire-atlas",
    "tools/fire-atlas.exe",
    "tools/fire-atlas.cmd",
    "game 2/fire-atlas",
)
"""Programs beside that project."""

OF_ITS_OWN = (
    "ERROR: _reimport_file: BUG: File queued for import",
    "ERROR: _reimport_file: Method failed",
)
"""What this version of the engine says of all imported scenes that refer to others."""


def game_with_addon(folder: Path, settings: str = "") -> Game:
    """Return a project that has the add-on."""
    game = Game.at(folder, ["fire_atlas"], settings)
    assert main(["plugin", "godot", "-q", str(game.folder)]) == 0
    return game


def name_command(game: Game, command: str) -> None:
    """Let the user of the editor in which the game is opened name the command."""
    settings = game.folder.parent / "home/godot/editor_settings-3.tres"
    settings.parent.mkdir(parents=True, exist_ok=True)
    settings.write_text(
        f'[gd_resource type="EditorSettings" format=2]\n\n[resource]\n'
        f'fire_atlas/command = "{command}"\n'
    )


def searches(root: str) -> Iterator[tuple[tuple[str, str, str, bool], str]]:
    """Yield what is looked for beside ``IN_THE_GAME`` and ``ELSEWHERE`` in ``root``.

    Windows' disk C: is a folder of the working folder, with the same files.

    Yields:
        Command, PATH, project and whether the system is Windows -> the program that is found.
    """
    game, tools = f"{root}/game", f"{root}/tools"
    inside = f":.:..:node_modules/.bin:../tools:{game}:{game}/node_modules/.bin:{tools}/../game/:"
    yield ("fire-atlas", inside, game, False), ""
    yield ("fire-atlas", f"{inside}:{tools}", game, False), f"{tools}/fire-atlas"
    yield ("fire-atlas", f"{root}/game 2:{tools}", game, False), f"{root}/game 2/fire-atlas"
    yield ("fire-atlas", "", game, False), ""
    yield ("..", tools, game, False), ""
    yield (".venv/bin/fire-atlas", tools, game, False), f"{game}/.venv/bin/fire-atlas"
    yield ("/elsewhere/fire-atlas", "", game, False), "/elsewhere/fire-atlas"
    inside = (
        r".;;C:;C:tools;\tools;tools;C:\game;C:\game\node_modules\.bin;C:/game;C:\tools\..\game"
    )
    found = r"C:\tools\fire-atlas.exe"
    yield ("fire-atlas", inside, r"C:\game", True), ""
    yield ("fire-atlas", rf'{inside};"C:\tools"', r"C:\game", True), found
    yield ("fire-atlas.exe", r"C:\tools", r"C:\game", True), found
    yield ("fire-atlas.cmd", r"C:\tools", r"C:\game", True), ""
    yield ("C:fire-atlas.exe", r"C:\tools", r"C:\game", True), ""
    for path in (r"D:\a b\fire-atlas.bat", r"\\server\fire-atlas.exe", "D:/fire-atlas.exe"):
        yield (path, "", r"C:\game", True), path
    yield (r"x\fire-atlas.exe", "", "C:/game", True), r"C:/game/x\fire-atlas.exe"


@pytest.fixture(scope="module")
def command(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command under test, as a program at a path with a space."""
    path = tmp_path_factory.mktemp("some tools") / "fire-atlas"
    path.write_text(
        f'#!/bin/sh\nPYTHONPATH="{PACKAGE.parent}" exec "{sys.executable}" -m fire_atlas "$@"\n'
    )
    path.chmod(0o755)
    return path


def copy_clip(to: Path, first: int = 0, count: int = 3) -> None:
    """Copy frames of a small fire, as a user would who drew them yesterday."""
    to.mkdir(parents=True, exist_ok=True)
    frames = sorted((shipped("samples") / "campfire").glob("*.png"))[first : first + count]
    for i, frame in enumerate(frames):
        os.utime(shutil.copyfile(frame, to / f"{i}.png"), (1_700_000_000, 1_700_000_000))


def write_recipe(path: Path, **keys: Any) -> None:
    recipe: dict[str, Any] = {
        "source": {"path": "../clips/fire", "height": 40},
        "exports": ["json", {"godot": {"version": 3}}],
        **keys,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(recipe, indent=1))


def imported_page(game: Game, page: Path) -> str:
    """Return the digest of the picture that the editor has imported as a page."""
    (stated,) = (game.folder / ".import").glob(f"{page.name}-*.md5")
    found = re.search(r'source_md5="(\w+)"', stated.read_text())
    assert found
    return found[1]


def said_by(game: Game) -> tuple[str, list[str]]:
    """Open the game in the editor; return what it says, and its faults but for those of its own."""
    said = game.run("godot3-server", "--editor")
    return said, [line for line in game.faults(said) if not line.startswith(OF_ITS_OWN)]


@pytest.fixture(scope="module")
def edited(
    godot: None, command: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Game, str, list[str]]:
    """A game into which a recipe was dropped, and of whose clip a frame was then drawn anew."""
    folder = tmp_path_factory.mktemp("work")
    game = game_with_addon(folder / "game")
    name_command(game, str(command))
    copy_clip(game.folder / "clips/fire")
    (game.folder / "clips/.gdignore").touch()
    write_recipe(game.folder / "my fires #1/torch.fire")
    copy_clip(folder / "new", 20, 1)
    later = {str(folder / "new/0.png"): str(game.folder / "clips/fire/0.png")}
    (game.folder / "later.json").write_text(json.dumps(later))
    return game, *said_by(game)


def test_a_recipe_becomes_an_asset_and_again_when_its_input_changes(
    edited: tuple[Game, str, list[str]],
) -> None:
    game, said, faults = edited
    assert said.count("torch.fire: built") == 2 and not faults, said
    assert "command" not in (game.folder / "project.godot").read_text()
    page = game.folder / "my fires #1/build/torch.png"
    assert imported_page(game, page) == hashlib.md5(page.read_bytes()).hexdigest()
    paths = [f"res://my fires #1/{name}" for name in ("torch.fire", "build/torch.tscn")]
    asset, scene = game.ask("describe.gd", paths).values()
    assert asset == scene
    assert (asset["name"], asset["type"]) == ("Torch", "AnimatedSprite")
    assert asset["flakes"]["rows"] > 0


def test_an_exported_game_holds_no_manifest_and_no_json_that_it_does_not_read(
    edited: tuple[Game, str, list[str]],
) -> None:
    game, _, _ = edited
    (game.folder / "export_presets.cfg").write_text(PRESET)
    (game.folder / "dialogues.json").write_text("{}")
    (game.folder / "play.gd").write_text(PLAY)
    path, elsewhere = game.folder.parent / "game.zip", game.folder.parent / "elsewhere"
    game.run("godot3-server", "--editor", "--export-pack", "pack", str(path))
    with ZipFile(path) as pack:
        names = set(pack.namelist()) - {"job.json", "answer.json"}
    assert {f"my fires #1/{name}" for name in ("torch.fire.import", "build/torch.tscn")} <= names
    assert [name for name in names if name.endswith(".json")] == ["dialogues.json"]
    assert not [name for name in names if name.startswith("addons/fire_atlas/")]
    elsewhere.mkdir()
    said = Game(elsewhere).run("godot3-server", "--main-pack", str(path), "-s", "res://play.gd")
    assert "plays 3 frames, shows flakes: True" in said
    assert all("_get_modified_time" in fault for fault in game.faults(said))  # of all imports


def test_the_editor_says_what_to_do_and_imports_what_was_mended(
    godot: None, command: Path, tmp_path: Path
) -> None:
    game = game_with_addon(tmp_path / "game")
    name_command(game, "/nowhere/fire-atlas")
    copy_clip(game.folder / "clips/fire")
    write_recipe(game.folder / "fires/torch.fire")
    said, _ = said_by(game)
    assert "torch.fire: `/nowhere/fire-atlas` cannot be run" in said
    assert "Install it (`pip install ./fire-atlas`" in said
    assert "in Editor > Editor Settings > Fire Atlas > Command" in said
    venv = game.folder / ".venv/bin"
    venv.mkdir(parents=True)
    shutil.copy(command, venv)
    name_command(game, ".venv/bin/fire-atlas")
    write_recipe(game.folder / "fires/typo.fire", flakess="none")
    write_recipe(game.folder / "fires/other.fire", exports=["json"])
    write_recipe(game.folder / "fires/a$b.fire")
    said, faults = said_by(game)
    assert "torch.fire: built" in said
    assert re.search(r"typo.fire:\d+: flakess: unknown key; did you mean flakes\?", said)
    assert "other.fire: its build writes no scene for Godot 3: write `exports: [{godot" in said
    assert "a$b.fire: its path holds a $" in said
    assert len({line for line in faults if "Error importing" not in line}) == 3, faults
    shutil.rmtree(game.folder / "fires/build")  # which version control may ignore
    assert "torch.fire: built" in said_by(game)[0]


def test_the_editor_runs_no_program_that_a_project_brings(
    godot: None, command: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither by its name, whatever the PATH holds, nor since the project's settings name it."""
    planted = tmp_path / "planted"
    game = game_with_addon(tmp_path / "game", '\n[fire_atlas]\n\ncommand="./fire-atlas"\n')
    for name in IN_THE_GAME[1:]:
        (game.folder / name).parent.mkdir(parents=True, exist_ok=True)
        (game.folder / name).write_text(f"#!/bin/sh\necho $0 >> '{planted}'\n")
        (game.folder / name).chmod(0o755)
    copy_clip(game.folder / "clips/fire")
    write_recipe(game.folder / "fires/torch.fire")
    (tmp_path / "link").symlink_to(game.folder)
    inside = ["", ".", "node_modules/.bin", game.folder, game.folder / "node_modules/.bin"]
    searched = [*inside, tmp_path / "link/node_modules/.bin", command.parent, os.environ["PATH"]]
    monkeypatch.setenv("PATH", ":".join(map(str, searched)))
    said, faults = said_by(game)
    assert not planted.exists(), planted.read_text()
    assert "torch.fire: built" in said
    (warning,) = faults
    assert "the project's setting fire_atlas/command is ignored" in warning
    assert "Editor > Editor Settings > Fire Atlas > Command" in warning


def test_a_program_is_looked_for_outside_of_projects(godot: None, tmp_path: Path) -> None:
    game = game_with_addon(tmp_path / "game")
    assert game.import_all() == []
    for folder in (tmp_path, game.folder / "C:"):
        for path in (*(folder / "game" / name for name in IN_THE_GAME),
                     *(folder / name for name in ELSEWHERE)):  # fmt: skip
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    asked, found = zip(*searches(str(tmp_path)), strict=True)
    assert game.ask("program.gd", asked) == list(found)


def test_the_add_on_does_the_same_in_godot_4_without_its_editor(
    godot4: Godot4, tmp_path: Path
) -> None:
    """This runtime has no editor: others stand in for its classes, and the command is run here."""
    game, depfile = tmp_path / "game", tmp_path / "torch.d"
    copy_clip(tmp_path / "clips/fire")
    write_recipe(game / "torch.fire", exports=["json", "godot"])
    (game / "project.godot").write_text("config_version=5")
    assert main(["plugin", "godot", "-q", str(game)]) == 0
    assert main(["build", "-q", str(game / "torch.fire"), "--depfile", str(depfile)]) == 0
    for path in (game / "addons/fire_atlas").glob("*.gd"):
        text = path.read_text()
        for old, new in STAND_INS.items():
            text = re.sub(old, new, text)
        path.write_text(text)
    for name in ("addon.gd", "editor.gd"):
        shutil.copy(Path(__file__).with_name(name), game)
    needs = depfile.read_text().replace(f"{game}/torch.fire", "RECIPE")
    needs = needs.replace(f"{game}/", r"user\://").replace(
        f"{tmp_path}/clips/fire", r"user\://clip"
    )
    built = [path for path in (game / "build").iterdir() if path.suffix in (".json", ".tscn")]
    files = {f"build/{path.name}": path.read_text() for path in built}
    files |= {".godot/imported/torch.d": needs, "torch.fire": ""}
    files["chosen/fire-atlas"] = next(iter(SAID))
    files["mods/game.manifest.json"] = '{"outputs": {"mod": 1}}'
    files |= {f"clip/{i}.png": "a frame" for i in range(3)}
    disk = [f"{disk}/{path}" for disk in ("", "/C:")
            for path in (*(f"game/{name}" for name in IN_THE_GAME), *ELSEWHERE)]  # fmt: skip
    asked, found = zip(*searches(""), strict=True)
    job = {"do": "ask", "script": "res://addon.gd", "files": files, "exported": [*EXPORTED],
           "needs": NEEDS, "said": [*SAID], "disk": disk, "programs": asked}  # fmt: skip
    (answer,) = godot4.run(game, [job])
    assert answer["programs"] == list(found)
    assert answer["needs"] == ["/a #$b/t.manifest.json", "C:/x y.png", "/clip"]
    for (errors, notes, is_new), stated in zip(answer["events"], SAID.values(), strict=True):
        assert (len(errors), notes, is_new) == stated
    imported = answer["imported"]
    page, recipe = "user://build/torch.png", "user://torch.fire"
    reimports = [["reimport", recipe]] * 2  # the clip was as new as the build; then a frame went
    (setting, *warnings), calls = imported["calls"][:3], imported["calls"][3:]
    assert setting == ["setting", "fire_atlas/command"]
    for (kind, said), ignored in zip(warnings, ("fire", "editor_overrides/fire"), strict=True):
        assert kind == "warning" and f"{ignored}_atlas/command is ignored" in said
    assert calls == [["update", page], ["import", page], ["scan", ""], *reimports]
    assert imported["error"] == 0
    merged = (".import", ".uid")  # the engine writes them too
    written = {path.name for path in (game / "build").iterdir() if path.suffix not in merged}
    assert {Path(path).name for path in imported["generated"]} == written - {"torch.manifest.json"}
    assert set(imported["inputs"]) == {"user://clip", *(f"user://clip/{i}.png" for i in range(3))}
    assert imported["asset"] == ["Torch", "res://build/torch.tres"]
    changed = {recipe: "user://.godot/imported/torch"}
    assert answer["changes"][:5] == [{}, changed, {}, changed, {}]
    assert set(answer["changes"][5]) == {"torch.d", "torch.tscn"}
    assert answer["kept_out"] == [path for path, is_kept_out in EXPORTED.items() if is_kept_out]
