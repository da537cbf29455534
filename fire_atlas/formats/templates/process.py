"""Render one template: a request on stdin, the answer on stdout, both JSON. See user_template.py.

``python -m fire_atlas.formats.templates.process``
"""

import json
import re
import sys
from typing import Any

from jinja2.exceptions import (
    SecurityError,
    TemplateError,
    TemplateNotFound,
    TemplateSyntaxError,
)

from fire_atlas.formats.templates.jinja import environment

_MEMORY = 1 << 30
_CPU_SECONDS = 15
_MOST_TEXT = 1 << 26
"""Characters of output."""
_LONGEST_NAME = 200

_ADDRESS = re.compile(r"<[^<>\n]{1,200} at 0x[0-9A-Fa-f]+>")
"""What Python prints of an object that is no value: where it lies in memory."""


def main() -> None:
    """Answer the request."""
    _limit()
    request = json.load(sys.stdin)
    json.dump(_answer(request), sys.stdout)


def _limit() -> None:
    """Give this process little memory and time, where the system knows how."""
    try:
        import resource
    except ImportError:  # Windows; the build's own time limit still holds
        return
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (_CPU_SECONDS, _CPU_SECONDS))


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    try:
        name = environment().from_string(request["to"]).render(request["context"])
        parts, length = [], 0
        for part in environment().from_string(request["template"]).generate(request["context"]):
            length += len(part)
            if length > _MOST_TEXT:
                return {"error": "the template writes more than 64 MiB; does it loop for ever?"}
            parts.append(part)
        return _checked(name, "".join(parts))
    except Exception as error:
        return {"error": _explained(error), "line": _line(error)}


def _checked(name: str, text: str) -> dict[str, Any]:
    """Return the answer, or what is wrong with what was rendered."""
    if len(name) > _LONGEST_NAME:
        return {"error": f"`to` gives a name of {len(name)} characters; at most {_LONGEST_NAME}"}
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
        case MemoryError():
            return "the template asked for too much memory"
        case OverflowError():
            return f"the template asked for too much: {error}"
        case TemplateError():
            return str(error)
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
