"""The order in which people number files."""

import re
from pathlib import Path


def natural_key(path: Path) -> tuple[object, ...]:
    """Sort key that puts fire2 before fire10, the same on every machine and in every locale."""
    parts = [re.split(r"([0-9]+)", part.casefold()) for part in path.parts]
    words = tuple(
        tuple((int(w), "") if w.isascii() and w.isdigit() else (-1, w) for w in part)
        for part in parts
    )
    return (words, str(path))
