"""Files from a user's own Jinja2 template.

A template may come with somebody else's recipe, so it is rendered in a process of its own that has
nothing but the context, little memory and little time.
"""

import json
import os
import subprocess
import sys
from pathlib import Path, PureWindowsPath
from typing import Any

from fire_atlas.atlas.layout import AtlasSheet
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.templates.context import context_of
from fire_atlas.recipe.output import TemplateExport

SECONDS = 10
"""How long a template may take."""

_IMPORT_ROOT = Path(__file__).resolve().parents[3]


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
    name = answer["name"]
    is_plain = PureWindowsPath(name).name == name and name.isprintable()
    if not name or name.startswith(".") or not is_plain:
        raise OutputError(
            f"{path}: `to` gives {name!r}, which is no plain file name; write something like "
            f"{{{{ name }}}}.txt"
        )
    return OutputFile(name, "template", answer["text"].encode())


def _read(path: Path) -> str:
    try:
        return read_file(path, MIB).decode("utf-8-sig")
    except OSError as error:
        raise RecipeError(f"{path}: the template cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: the template is not UTF-8; save it as UTF-8") from None


def _answer(asked: str, path: Path) -> dict[str, Any]:
    """Render in another process. Signals meant for the build do not reach it."""
    search = os.pathsep.join(filter(None, [str(_IMPORT_ROOT), os.environ.get("PYTHONPATH")]))
    try:
        done = subprocess.run(
            [sys.executable, "-m", "fire_atlas.formats.templates.process"],
            input=asked.encode(),
            capture_output=True,
            timeout=SECONDS,
            env={**os.environ, "PYTHONPATH": search},
            start_new_session=True,
            check=False,
        )
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
