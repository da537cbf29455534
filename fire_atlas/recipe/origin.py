"""Where each key of a recipe was written, so that every message can point at it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

Value: TypeAlias = "bool | int | float | str | list[Value] | dict[str, Value] | None"
"""What a recipe is made of before it is validated."""

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the top of a recipe to a value."""


def dotted(path: KeyPath) -> str:
    """Return a key path as people write it: ``flakes.life.0``."""
    return ".".join(map(str, path))


@dataclass(frozen=True, slots=True)
class Origin:
    """The place a key was written.

    Attributes:
        file: The recipe file, as the user named it; None for ``--set``.
        line: Line in the file, from 1; 0 for ``--set``.
    """

    file: Path | None
    line: int

    def locate(self, path: KeyPath) -> str:
        """Return how a message about the key ``path`` begins: ``campfire.yaml:12: flakes.alpha``.

        The path may be empty: the message is then about the file as a whole.
        """
        where = "--set " if self.file is None else f"{self.file}:{self.line}: "
        return where + dotted(path) if path else where.rstrip(": ")


COMMAND_LINE = Origin(None, 0)
"""The origin of what ``--set`` gives."""


@dataclass(frozen=True, slots=True)
class Document:
    """A tree of plain values, and the origin of every key and list item in it.

    Attributes:
        values: The top-level mapping.
        origins: Key path → where it was written; ``()`` is the document itself.
    """

    values: dict[str, Value]
    origins: dict[KeyPath, Origin]
