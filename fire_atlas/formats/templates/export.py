"""Export text files rendered from Jinja templates: the tool's own, and users'.

A user's template may come with a recipe from the Internet, so it is rendered in a process of its
own, which gets only the context and has limits on memory and time.
"""

import json
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError, RecipeError, SourceError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.output_file import OutputFile, is_portable, is_reserved
from fire_atlas.core.process import run_module
from fire_atlas.formats.tables import EXPORTS
from fire_atlas.formats.templates.context import context_of
from fire_atlas.formats.templates.jinja import identifier, rendered
from fire_atlas.recipe.output import TemplateExport

MAX_SECONDS = 10
"""Time limit for a user's template."""


def export_css(sheet: AtlasSheet, density: float = 1.0) -> Iterator[OutputFile]:
    """Yield ``name.css``: a CSS class that plays each animation, and one that shows each frame.

    Args:
        sheet: The sheet. Classes of a smaller one end in its scale, ``-at-0-5x``, so that a page
            can have several.
        density: Px of the page for each px of CSS.

    Raises:
        OutputError: Two of them would be one class.
    """
    animations = [animation.name for animation in sheet.animations]
    refuse_equal_classes(animations, [region.name for region in sheet.placed])
    ending = "" if sheet.scale == 1 else f"-at-{sheet.scale:g}x".replace(".", "-")
    text = rendered("sprites.css.j2", **context_of(sheet), ending=ending, density=density)
    yield OutputFile(sheet.file(0, EXPORTS["css"].ending), "atlas", text.encode())


def refuse_equal_classes(animations: Iterable[str], frames: Iterable[str]) -> None:
    """Refuse names of animations and frames of which two would be one CSS class.

    Raises:
        OutputError: With both names.
    """
    taken = dict[str, str]()
    played = (f"animation {name}" for name in animations)
    shown = (f"sprite {name}" for name in frames)
    for title in (*played, *shown):
        css_class = identifier(title.partition(" ")[2])
        other = taken.setdefault(css_class, title)
        if other != title:
            raise OutputError(
                f"css cannot tell the {other} and the {title} apart: the class of both would be "
                f".{css_class}; rename the files of one of them"
            )


def export_tpsheet(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the ``.tpsheet`` of each page, which TexturePacker's importers for engines read."""
    context = context_of(sheet)
    for i, page in enumerate(context["pages"]):
        text = rendered("sprites.tpsheet.j2", **context, page=page)
        yield OutputFile(sheet.file(i, EXPORTS["tpsheet"].ending), "atlas", text.encode())


def export_template(sheet: AtlasSheet, export: TemplateExport, path: Path) -> OutputFile:
    """Return the file that the user's template at ``path`` makes of the sheet.

    Raises:
        FireAtlasError: The template cannot be read, is invalid or forbidden, or takes too long.
    """
    answer = _answer(path, export, context_of(sheet))
    return OutputFile(_checked_name(answer["name"], path), "template", answer["text"].encode())


def check_template(export: TemplateExport, path: Path) -> None:
    """Refuse a template that cannot be rendered, whatever the sheet.

    Raises:
        FireAtlasError: It cannot be read, is invalid, or uses a name that no template has.
    """
    _answer(path, export, None)


def _checked_name(name: str, path: Path) -> str:
    """Return ``name``, which the template at ``path`` gives its file, if it is allowed."""
    if name.startswith(".") or not is_portable(name):
        objection = "which is not a plain file name that every system allows"
    elif is_reserved(name):
        objection = "a name reserved for the tool's own files"
    else:
        return name
    raise OutputError(
        f"{path}: `to` gives {name!r}, {objection}; write something like {{{{ name }}}}.txt"
    )


def _read(path: Path) -> str:
    try:
        return read_file(path, MIB).decode("utf-8-sig")
    except FileNotFoundError:
        raise SourceError(f"there is no template {path}") from None
    except OSError as error:
        raise RecipeError(f"{path}: the template cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: the template is not UTF-8; save it as UTF-8") from None


def _answer(path: Path, export: TemplateExport, context: dict[str, Any] | None) -> dict[str, Any]:
    """Return what ``render_process`` answers about a template; without a context it only looks for
    mistakes.

    Raises:
        FireAtlasError: It found one, or was stopped.
    """
    request = json.dumps({"template": _read(path), "to": export.to, "context": context})
    try:
        done = run_module(
            "fire_atlas.formats.templates.render_process", request.encode(), MAX_SECONDS
        )
    except subprocess.TimeoutExpired:
        raise OutputError(
            f"{path}: the template was stopped after {MAX_SECONDS} s; does it loop for ever?"
        ) from None
    try:
        answer: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        raise OutputError(
            f"{path}: the template needed too much memory or time and was stopped"
        ) from None
    if "error" in answer:
        where = f"{path}:{answer['line']}" if answer.get("line") else f"{path}"
        raise OutputError(f"{where}: {answer['error']}")
    return answer
