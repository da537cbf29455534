"""Jinja as all templates of this tool know it: sandboxed, strict, without other files."""

import re
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

from jinja2 import StrictUndefined, Template
from jinja2.sandbox import ImmutableSandboxedEnvironment

from fire_atlas.core.shipped import shipped

Filter: TypeAlias = Callable[[Any], str]
"""What turns a value into text inside a template; called there by its own name."""


def environment() -> ImmutableSandboxedEnvironment:
    """Return the environment. What is not in the context is an error, not an empty text."""
    made = ImmutableSandboxedEnvironment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["identifier"] = identifier
    # Equal builds have equal bytes: nothing here is left to chance.
    del made.filters["random"], made.globals["lipsum"]
    return made


def rendered(template: str, filters: tuple[Filter, ...] = (), **context: object) -> str:
    """Return what one of our own templates makes of the context, with these filters as well."""
    return _shipped_template(template, filters).render(context)


@cache
def _shipped_template(name: str, filters: tuple[Filter, ...]) -> Template:
    made = environment()
    made.filters.update({each.__name__: each for each in filters})
    return made.from_string((shipped("templates") / name).read_text(encoding="utf-8"))


def identifier(text: Any) -> str:
    """Return ``text`` as a name that CSS and most languages take: ``campfire-0000``."""
    name = re.sub(r"[^\w-]+", "-", str(text))
    return name if re.match(r"[^\W\d]", name) else f"_{name}"
