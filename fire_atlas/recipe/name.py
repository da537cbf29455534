"""Names of outputs."""

import re

from fire_atlas.core.output_file import is_device

NAME_PATTERN = r"^[A-Za-z0-9_]([A-Za-z0-9_.\-]*[A-Za-z0-9_\-])?$"
"""A file stem that is good on every system and in every engine."""

NAME_ADVICE = (
    "must be a plain file name, not a path: letters, digits, `_`, `-` and `.`,"
    " beginning with a letter, a digit or `_`; not one that Windows keeps for a device, like con"
)

MAX_NAME = 100
"""Longest name, characters."""


def is_name(text: str) -> bool:
    """Return whether outputs may be called ``text``."""
    is_plain = len(text) <= MAX_NAME and re.fullmatch(NAME_PATTERN, text) is not None
    return is_plain and not is_device(text)


def nearest_name(text: str) -> str:
    """Return a good name that looks like ``text``."""
    plain = re.sub(r"[^A-Za-z0-9_.\-]+", "_", text)[:MAX_NAME].strip("-._")
    return next(name for name in (plain, f"{plain}_", "effect") if is_name(name))
