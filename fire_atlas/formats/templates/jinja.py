"""The Jinja environment of all templates: sandboxed, strict, without access to files."""

import re
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

from jinja2 import FunctionLoader, StrictUndefined, Template
from jinja2.sandbox import ImmutableSandboxedEnvironment

from fire_atlas.core.shipped import shipped

Filter: TypeAlias = Callable[[Any], str]
"""A function that turns a value into text; templates call it by its own name."""


NAMES = (
    "name", "title", "scale", "fps", "alpha", "blend_space", "version",
    "pages", "frames", "animations", "grid", "motion", "states",
)  # fmt: skip
"""The names that templates get: ``context.context_of`` says what they are."""


class _NamedUndefined(StrictUndefined):
    """A name that does not exist; the error says which ones there are beside it."""

    @property
    def _undefined_message(self) -> str:
        message, beside = super()._undefined_message, self._undefined_obj
        return f"{message}; it has {', '.join(beside)}" if isinstance(beside, dict) else message


def environment() -> ImmutableSandboxedEnvironment:
    """Return a new environment that raises for names that are not in the context."""
    made = ImmutableSandboxedEnvironment(
        undefined=_NamedUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["identifier"] = identifier
    # Builds must be reproducible, so random functions are removed.
    del made.filters["random"], made.globals["lipsum"]
    return made


def rendered(template: str, filters: tuple[Filter, ...] = (), **context: object) -> str:
    """Return one of the tool's own templates rendered with ``context`` and additional filters."""
    return _shipped_template(template, filters).render(context)


@cache
def _shipped_template(name: str, filters: tuple[Filter, ...]) -> Template:
    made = environment()
    made.filters.update({function.__name__: function for function in filters})
    # So that templates share macros; those of users have no loader, and read no file.
    made.loader = FunctionLoader(
        lambda other: (shipped("templates") / other).read_text(encoding="utf-8")
    )
    return made.get_template(name)


def identifier(text: Any) -> str:
    """Return ``text`` as a name that is a valid CSS identifier: ``campfire-0000``."""
    name = re.sub(r"[^\w-]+", "-", str(text))
    return name if re.match(r"[^\W\d]", name) else f"_{name}"
