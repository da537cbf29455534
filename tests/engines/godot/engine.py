"""Godot 3, as Debian has it, and what it says of a project."""

import json
import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PROGRAMS = ("godot3-server", "godot3", "xvfb-run")
SCRIPTS = Path(__file__).parent

_PROJECT = """\
config_version=4

[application]

config/name="a game"

[editor_plugins]

enabled=PoolStringArray( {} )
{}"""
_PLUGIN = """\
[plugin]

name="quit_when_imported"
description="Quits the editor once it has looked at all files"
author=""
version=""
script="quit_when_imported.gd"
"""
_NO_FAULT = ("get_language_code", "set_locale")
"""What the engine calls an error where the system has no language."""


def missing_programs() -> list[str]:
    """Return what has to be installed yet."""
    return [program for program in PROGRAMS if shutil.which(program) is None]


@dataclass(frozen=True)
class Game:
    """A project in a folder."""

    folder: Path

    @classmethod
    def at(cls, folder: Path, addons: Sequence[str] = (), settings: str = "") -> "Game":
        """Start a project in ``folder``, which may hold files already.

        ``addons`` are enabled, if they are there; ``settings`` end the project's file.
        """
        folder.mkdir(parents=True, exist_ok=True)
        enabled = ", ".join(f'"{each}"' for each in [*addons, "quit_when_imported"])
        (folder / "project.godot").write_text(_PROJECT.format(enabled, settings))
        plugin = folder / "addons/quit_when_imported"
        plugin.mkdir(parents=True, exist_ok=True)
        (plugin / "plugin.cfg").write_text(_PLUGIN)
        shutil.copy(SCRIPTS / "quit_when_imported.gd", plugin)
        return cls(folder)

    def import_all(self) -> list[str]:
        """Let the editor import everything; return its warnings and errors."""
        said = self.run("godot3-server", "--editor")
        assert self._is_imported(), said
        return self.faults(said)

    def _is_imported(self) -> bool:
        """Whether what each picture was made into is there."""
        pictures = [path for kind in ("png", "webp") for path in self.folder.rglob(f"*.{kind}")]
        stated = [path.with_name(f"{path.name}.import") for path in pictures]
        made = [re.findall(r'"res://(.import/.*?)"', path.read_text()) for path in stated]
        return all(files and (self.folder / files[0]).is_file() for files in made)

    def ask(self, script: str, job: Any = None, size: tuple[int, int] = (0, 0)) -> Any:
        """Run a script of this folder; return what it answers to ``job``.

        With a ``size``, it runs in a window of so many px, on a screen that nobody sees. A frame of
        the engine lasts 1/60 s, however long this machine takes for it.
        """
        for name in (script, "job.gd"):
            shutil.copy(SCRIPTS / name, self.folder / name)
        (self.folder / "job.json").write_text(json.dumps(job))
        (self.folder / "answer.json").unlink(missing_ok=True)
        line = ["godot3-server"]
        if any(size):
            line = ["xvfb-run", "-a", "godot3", "--video-driver", "GLES2", "--audio-driver"]
            line += ["Dummy", "--resolution", "{}x{}".format(*size)]
        said = self.run(*line, "--fixed-fps", "60", "-s", script)
        assert not self.faults(said), said
        return json.loads((self.folder / "answer.json").read_text())

    def run(self, *line: str) -> str:
        """Run a program of the engine in the project; return what it says."""
        home = self.folder.parent / "home"
        places = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME")
        ran = subprocess.run(
            [*line, "--path", str(self.folder)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
            timeout=120, check=False, env={**os.environ, **dict.fromkeys(places, str(home))},
        )  # fmt: skip
        return ran.stdout

    @staticmethod
    def faults(said: str) -> list[str]:
        """Return the warnings and errors in what the engine says."""
        return [
            line
            for line in said.splitlines()
            if line.startswith(("ERROR", "WARNING", "SCRIPT ERROR", "SHADER ERROR"))
            and not any(word in line for word in _NO_FAULT)
        ]
