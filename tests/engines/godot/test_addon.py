"""The add-on for the editor: recipes become assets, and games hold what they need alone.

The engine's runtime has no editor: others stand in for its classes, and the command is run here.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.support.godot4 import Godot4
from tests.support.repo import PACKAGE

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
    r"OS\.execute\((program, arguments, said), true\)": r'load("res://editor.gd").execute(\1)',
    r"push_warning\((.*)\)": r'calls.append(["warning", \1])',
    r"push_error\((.*recipe.*)\)": r'calls.append(["error", \1])',
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
    "user://addons/fire_atlas.manifest.json": True,
    "res://addons/fire_atlas/node.gd": False,
}
"""Files of a project, before some what the setting is -> whether the exporter keeps them out."""

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

PATHS = {
    ".:node_modules/.bin:/game:/game/node_modules/.bin:/tools": "/tools/fire-atlas",
    ".:/game:/game/node_modules/.bin:/game/.venv/bin": None,
}
"""The system's PATH -> the program of the name `fire-atlas` that the add-on runs."""

INSTALL = (
    "cannot be run. Install it (`pip install ./fire-atlas` in the folder that holds its checkout)."
)


def searches() -> Iterator[tuple[tuple[str, str, str, bool], str]]:
    """Yield what is looked for beside ``IN_THE_GAME`` and ``ELSEWHERE`` at the top of the disk.

    Windows' disk C: is a folder of the working folder, with the same files.

    Yields:
        Command, PATH, project and whether the system is Windows -> the program that is found.
    """
    game, tools = "/game", "/tools"
    inside = f":.:..:node_modules/.bin:../tools:{game}:{game}/node_modules/.bin:{tools}/../game/:"
    yield ("fire-atlas", inside, game, False), ""
    yield ("fire-atlas", f"{inside}:{tools}", game, False), f"{tools}/fire-atlas"
    yield ("fire-atlas", f"/game 2:{tools}", game, False), "/game 2/fire-atlas"
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


def copy_clip(to: Path) -> None:
    """Copy frames of a small fire, as a user would who drew them yesterday."""
    to.mkdir(parents=True)
    frames = sorted((shipped("samples") / "campfire").glob("*.png"))[:3]
    for i, frame in enumerate(frames):
        os.utime(shutil.copyfile(frame, to / f"{i}.png"), (1_700_000_000, 1_700_000_000))


def write_recipe(path: Path, **keys: Any) -> None:
    recipe = {"source": {"path": "../clips/fire", "height": 40}, "exports": ["json", "godot"]}
    path.write_text(json.dumps({**recipe, **keys}, indent=1))


def arguments(depfile: str, recipe: str) -> list[str]:
    """Return the arguments with which the add-on runs the command."""
    return ["build", "--json", "--depfile", depfile, recipe]


def said_of(recipe: Path) -> str:
    """Run the command as the add-on does; return what it says."""
    ran = subprocess.run(
        [sys.executable, "-m", "fire_atlas",
         *arguments(str(recipe.with_suffix(".d")), str(recipe))],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(PACKAGE.parent)},
    )  # fmt: skip
    return ran.stdout


@dataclass(frozen=True)
class Edited:
    """A game with the add-on and three recipes, and what ``addon.gd`` tells of them."""

    folder: Path
    answer: dict[str, Any]

    @property
    def kept_out(self) -> set[str]:
        """Files of the game that the exporter keeps out."""
        return {path.partition("://")[2] for path in self.answer["kept_out"]}


@pytest.fixture(scope="module")
def edited(godot4: Godot4, tmp_path_factory: pytest.TempPathFactory) -> Edited:
    """A game with a recipe, one with a typing error, and one that writes no scene."""
    folder = tmp_path_factory.mktemp("work")
    game = folder / "game"
    copy_clip(folder / "clips/fire")
    game.mkdir()
    (game / "project.godot").write_text("config_version=5")
    assert main(["plugin", "godot", "-q", str(game)]) == 0
    write_recipe(game / "torch.fire", flakes={"bake": False})
    write_recipe(game / "typo.fire", flakess="none")
    write_recipe(game / "other.fire", exports=["json"])
    files = {f"clip/{i}.png": "a frame" for i in range(3)}
    for recipe in game.glob("*.fire"):
        files[recipe.name] = ""
        files[f"chosen/fire-atlas/{recipe.name}"] = said_of(recipe)
        if recipe.with_suffix(".d").exists():
            needs = recipe.with_suffix(".d").read_text()
            needs = needs.replace(f"{game}/{recipe.name}", f"USERS/{recipe.name}")
            needs = needs.replace(f"{game}/", r"user\://")
            needs = needs.replace(f"{folder}/clips/fire", r"user\://clip")
            files[f".godot/imported/{recipe.stem}.d"] = needs
            recipe.with_suffix(".d").unlink()
    files["tools/fire-atlas/torch.fire"] = files["chosen/fire-atlas/torch.fire"]
    built = sorted((game / "build").iterdir())
    texts = [path for path in built if path.suffix in (".json", ".tscn")]
    files |= {f"build/{path.name}": path.read_text() for path in texts}
    files["mods/game.manifest.json"] = '{"outputs": {"mod": 1}}'
    manifest = game / "addons/fire_atlas/fire_atlas.manifest.json"
    files["addons/fire_atlas.manifest.json"] = manifest.read_text()
    disk = [f"{disk}/{path}" for disk in ("", "/C:")
            for path in (*(f"game/{name}" for name in IN_THE_GAME), *ELSEWHERE)]  # fmt: skip
    project = folder / "stand-ins"
    shutil.copytree(game, project)
    for path in (project / "addons/fire_atlas").glob("*.gd"):
        text = path.read_text()
        for old, new in STAND_INS.items():
            text = re.sub(old, new, text)
        path.write_text(text)
    for name in ("addon.gd", "editor.gd"):
        shutil.copy(Path(__file__).with_name(name), project)
    scripts = [f"res://addons/fire_atlas/{path.name}"
               for path in (game / "addons/fire_atlas").glob("*.gd")]  # fmt: skip
    exported = {*EXPORTED, *scripts, *(f"user://build/{path.name}" for path in built)}
    asked, _ = zip(*searches(), strict=True)
    job = {"do": "ask", "script": "res://addon.gd", "files": files, "exported": sorted(exported),
           "needs": NEEDS, "said": [*SAID], "disk": disk, "programs": asked,
           "paths": [*PATHS]}  # fmt: skip
    (answer,) = godot4.run(project, [job])
    return Edited(game, answer)


def test_what_the_command_prints_and_lists_is_understood(edited: Edited) -> None:
    assert edited.answer["needs"] == ["/a #$b/t.manifest.json", "C:/x y.png", "/clip"]
    for (errors, notes, is_new), stated in zip(edited.answer["events"], SAID.values(), strict=True):
        assert (len(errors), notes, is_new) == stated


def test_a_recipe_becomes_an_asset_and_is_imported_again_when_its_inputs_change(
    edited: Edited,
) -> None:
    """Not while the editor imports other files, but then; and when the user comes back to it."""
    imported = edited.answer["imported"]
    page, recipe = "user://build/torch.png", "user://torch.fire"
    (setting, *warnings), calls = imported["calls"][:3], imported["calls"][3:]
    assert setting == ["setting", "fire_atlas/command"]
    for (kind, said), ignored in zip(warnings, ("fire", "editor_overrides/fire"), strict=True):
        assert kind == "warning" and f"{ignored}_atlas/command is ignored" in said
        assert "Editor > Editor Settings > Fire Atlas > Command" in said
    assert calls == [
        ["run", "/chosen/fire-atlas", *arguments("user://.godot/imported/torch.d", recipe)],
        ["update", page],
        ["import", page],
        ["scan", ""],
        ["reimport", recipe],  # a frame was as new as the build
        ["no more imports", ""],
        ["reimport", recipe],
        ["reimport", recipe],
    ]
    assert imported["error"] == 0
    merged = (".import", ".uid")  # the engine writes them too
    written = {
        path.name
        for path in (edited.folder / "build").glob("torch*")
        if path.suffix not in merged and path.name != "torch.manifest.json"
    }
    assert {Path(path).name for path in imported["generated"]} == written
    assert set(imported["inputs"]) == {"user://clip", *(f"user://clip/{i}.png" for i in range(3))}
    assert imported["asset"] == ["Torch", "res://build/torch.tres"]


def test_what_a_recipe_was_built_from_is_compared_with_what_is_there(edited: Edited) -> None:
    changes = edited.answer["changes"]
    changed = {"user://torch.fire": "user://.godot/imported/torch"}
    assert changes[:5] == [{}, changed, {}, changed, {}]
    assert set(changes[5]) == {"torch.d", "typo.d", "other.d", "torch.tscn"}


def test_the_editor_says_what_to_do_and_tries_again_when_it_is_started(edited: Edited) -> None:
    failed = edited.answer["failed"]
    typo, other, torch = (call[1] for call in failed["calls"] if call[0] == "error")
    assert re.fullmatch(
        r"user://typo\.fire: .*typo\.fire:\d+: flakess: unknown key; did you mean flakes\?", typo
    )
    assert other == (
        "user://other.fire: its build writes no scene for Godot 4: write `exports: [godot]` into "
        "the recipe"
    )
    assert torch.startswith(f"user://torch.fire: `/nowhere/fire-atlas` {INSTALL}")
    assert "Editor > Editor Settings > Fire Atlas > Command" in torch
    cannot_create = 20
    assert failed["errors"] == {
        "user://typo.fire": cannot_create,
        "user://other.fire": cannot_create,
        "user://torch.fire": 0,
        "again": 0,
    }
    assert failed["asset stays"]
    assert not [call for call in failed["calls"] if call[0] == "reimport"]
    (again,) = (call for call in failed["calls after a restart"] if call[0] == "reimport")
    assert {*again[1].split(",")} == {f"user://{name}.fire" for name in ("typo", "other", "torch")}
    assert {*failed["left"]} == {"user://typo.fire", "user://other.fire"}


def test_only_what_the_user_has_named_or_what_lies_outside_of_projects_is_run(
    edited: Edited,
) -> None:
    """The project names a program in its settings, and holds others of that name."""
    asked, found = zip(*searches(), strict=True)
    assert edited.answer["programs"] == list(found), asked
    told = dict(zip(PATHS, edited.answer["named"], strict=True))
    for path, program in PATHS.items():
        if program:
            assert told[path][:2] == ["run", program]
        else:
            assert told[path][0] == "error" and f"`fire-atlas` {INSTALL}" in told[path][1]
    calls = [*edited.answer["imported"]["calls"], *edited.answer["failed"]["calls"]]
    assert {call[1] for call in calls if call[0] == "run"} == {
        "/chosen/fire-atlas", "/nowhere/fire-atlas",
    }  # fmt: skip


def test_manifests_descriptions_and_the_editors_scripts_stay_out_of_games(edited: Edited) -> None:
    kept_out = set(edited.answer["kept_out"])
    assert {path for path in EXPORTED if path in kept_out} == {
        path for path, is_kept_out in EXPORTED.items() if is_kept_out
    }
    in_games = {"fire_atlas_2d.gd", "fire_atlas_3d.gd", "fire_parts.gd"}
    scripts = (edited.folder / "addons/fire_atlas").glob("*.gd")
    assert {path.name for path in scripts if f"addons/fire_atlas/{path.name}" not in
            edited.kept_out} == in_games  # fmt: skip


def test_a_game_without_what_is_kept_out_plays_the_asset(
    edited: Edited, godot4: Godot4, tmp_path: Path
) -> None:
    game = tmp_path / "game"
    shutil.copytree(edited.folder, game)
    for name in edited.kept_out:
        (game / name).unlink(missing_ok=True)
    assert [*game.rglob("*.json")] == [game / "addons/fire_atlas/fire_atlas.manifest.json"]
    asset = game / ".godot/imported/torch.fire-0.tscn"
    asset.parent.mkdir(parents=True)
    asset.write_text(edited.answer["imported"]["text"].replace("user://", "res://"))
    (game / "torch.fire.import").write_text(
        '[remap]\n\nimporter="fire_atlas.recipe"\ntype="PackedScene"\n'
        f'path="res://.godot/imported/{asset.name}"\n'
    )
    job = {"scene": "res://torch.fire", "animation": "torch"}
    seen, played = godot4.run(game, [
        {"do": "read", **job, "read": [":name", ":autoplay", ":sprite_frames"]},
        {"do": "play", **job, "ticks": 5},
    ])  # fmt: skip
    assert seen == {
        ":name": "Torch", ":autoplay": "torch", ":sprite_frames": "res://build/torch.tres",
    }  # fmt: skip
    assert all(flakes for _, flakes in played[1:])
