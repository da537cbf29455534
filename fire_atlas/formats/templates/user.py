"""Files from a user's own Jinja2 template.

A template may come with somebody else's recipe, so it is rendered in a process of its own that has
nothing but the context, little memory and little time.
"""

import json
import subprocess
from pathlib import Path
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.output_file import OutputFile, is_portable, is_reserved
from fire_atlas.core.process import run_module
from fire_atlas.formats.templates.context import context_of
from fire_atlas.recipe.output import TemplateExport

SECONDS = 10
"""How long a template may take."""


def export_template(sheet: AtlasSheet, export: TemplateExport, path: Path) -> OutputFile:
    """Return the file that the template at ``path`` makes of the sheet.

    Raises:
        FireAtlasError: It cannot be read, is wrong, does what it must not, or takes too long.
    """
    asked = {"template": _read(path), "to": export.to, "context": context_of(sheet)}
    answer = _answer(json.dumps(asked), path)
    if "error" in answer:
        where = f"{path}:{answer['line']}" if answer.get("line") else f"{path}"
        raise OutputError(f"{where}: {answer['error']}")
    return OutputFile(_sound_name(answer["name"], path), "template", answer["text"].encode())


def _sound_name(name: str, path: Path) -> str:
    """Return the name that the template at ``path`` gives its file, if it may be written."""
    if name.startswith(".") or not is_portable(name):
        objection = "which is no plain file name, good on every system"
    elif is_reserved(name):
        objection = "a name that builds keep for themselves"
    else:
        return name
    raise OutputError(
        f"{path}: `to` gives {name!r}, {objection}; write something like {{{{ name }}}}.txt"
    )


def _read(path: Path) -> str:
    try:
        return read_file(path, MIB).decode("utf-8-sig")
    except OSError as error:
        raise RecipeError(f"{path}: the template cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: the template is not UTF-8; save it as UTF-8") from None


def _answer(asked: str, path: Path) -> dict[str, Any]:
    """Render in another process."""
    try:
        done = run_module("fire_atlas.formats.templates.process", asked.encode(), SECONDS)
    except subprocess.TimeoutExpired:
        raise OutputError(
            f"{path}: the template was stopped after {SECONDS} s; does it loop for ever?"
        ) from None
    try:
        answer: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        raise OutputError(
            f"{path}: the template asked for too much memory or time and was stopped"
        ) from None
    return answer
