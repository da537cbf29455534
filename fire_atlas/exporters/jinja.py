"""Jinja as all templates of this tool know it: sandboxed, strict, without other files."""

import re
from typing import Any

from jinja2 import StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment


def environment() -> ImmutableSandboxedEnvironment:
    """Return the environment. What is not in the context is an error, not an empty text."""
    made = ImmutableSandboxedEnvironment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["identifier"] = identifier
    return made


def identifier(text: Any) -> str:
    """Return ``text`` as a name that CSS and most languages take: ``campfire-0000``."""
    name = re.sub(r"[^\w-]+", "-", str(text))
    return name if re.match(r"[^\W\d]", name) else f"_{name}"
