"""Render a user's template: a request on stdin, the answer on stdout, both JSON.

``export.py`` runs it as ``python -m fire_atlas.formats.templates.render_process``; it limits its
own memory and time.
"""

import json
import re
import sys
from typing import Any

from jinja2 import nodes
from jinja2.exceptions import (
    SecurityError,
    TemplateAssertionError,
    TemplateError,
    TemplateNotFound,
    TemplateSyntaxError,
)
from jinja2.meta import find_undeclared_variables

from fire_atlas.formats.templates.jinja import NAMES, environment
from fire_atlas.recipe.problem import did_you_mean

_MAX_MEMORY_BYTES = 1 << 30
_MAX_CPU_SECONDS = 15
_MAX_TEXT_LENGTH = 1 << 26
_MAX_NAME_LENGTH = 200

_ASKING = {"defined", "undefined", "default", "d"}
"""Tests and filters of names that need not exist."""

_ADDRESS = re.compile(r"<[^<>\n]{1,200} at 0x[0-9A-Fa-f]+>")
"""Python's default text of an object, which contains its address in memory."""


def main() -> None:
    """Read the request, render, and write the answer."""
    _limit()
    request = json.load(sys.stdin)
    json.dump(_answer(request), sys.stdout)


def _limit() -> None:
    """Limit the memory and time of this process, where the operating system can."""
    try:
        import resource
    except ImportError:  # Windows; the build's own time limit still holds
        return
    resource.setrlimit(resource.RLIMIT_AS, (_MAX_MEMORY_BYTES, _MAX_MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (_MAX_CPU_SECONDS, _MAX_CPU_SECONDS))


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    try:
        for text in (request["to"], request["template"]):
            _refuse_unknown_names(text)
        if request["context"] is None:
            return {}
        name = environment().from_string(request["to"]).render(request["context"])
        parts, length = [], 0
        for part in environment().from_string(request["template"]).generate(request["context"]):
            length += len(part.encode())
            if length > _MAX_TEXT_LENGTH:
                return {"error": "the template writes more than 64 MiB; does it loop for ever?"}
            parts.append(part)
        return _checked(name, "".join(parts))
    except Exception as error:
        return {"error": _explained(error), "line": _line(error)}


def _refuse_unknown_names(text: str) -> None:
    """Refuse a template that uses names which no template has, unless it asks whether they exist.

    Raises:
        TemplateError: It does, or cannot be parsed.
    """
    made = environment()
    parsed = made.parse(text)
    asked = {
        name.name
        for node in parsed.find_all((nodes.Test, nodes.Filter))
        if node.name in _ASKING
        for name in node.find_all(nodes.Name)
    }
    unknown = find_undeclared_variables(parsed) - {*NAMES, *made.globals} - asked
    for name in parsed.find_all(nodes.Name):
        if name.name in unknown:
            near = did_you_mean(name.name, NAMES)
            raise TemplateAssertionError(
                f"'{name.name}' is undefined{near}; a template has {', '.join(NAMES)}", name.lineno
            )


def _checked(name: str, text: str) -> dict[str, Any]:
    """Return the answer, or an error if the rendered name or text is not acceptable."""
    if len(name) > _MAX_NAME_LENGTH:
        return {"error": f"`to` gives a name of {len(name)} characters; at most {_MAX_NAME_LENGTH}"}
    if found := _ADDRESS.search(f"{name}\n{text}"):
        return {
            "error": f"the template prints {found[0]}, which differs from build to build; is a "
            f"filter like `list` or a pair of brackets () missing?"
        }
    return {"name": name, "text": text}


def _explained(error: Exception) -> str:
    match error:
        case SecurityError():
            return f"a template must not do that: {error}"
        case TemplateNotFound():
            return "a template cannot include, import or extend other files"
        case TemplateSyntaxError():
            return str(error.message)
        case MemoryError():
            return "the template needs too much memory"
        case OverflowError():
            return f"the template needs too much: {error}"
        case TemplateError():
            return str(error)
        case UnicodeEncodeError():
            return (
                f"the template writes {error.object[error.start]!r}, half of a surrogate pair, "
                f"which no text file can hold; write the whole character"
            )
        case TypeError() if "no loader" in str(error):
            return "a template cannot include, import or extend other files"
    return f"{type(error).__name__}: {error}"


def _line(error: Exception) -> int | None:
    """Return the line of the template the error came from."""
    if isinstance(error, TemplateSyntaxError):
        return error.lineno
    line, frame = None, error.__traceback__
    while frame is not None:
        if frame.tb_frame.f_code.co_filename == "<template>":
            line = frame.tb_lineno
        frame = frame.tb_next
    return line


if __name__ == "__main__":
    main()
