"""Mistakes in the keys of a recipe: their places in the file, messages and suggestions."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

Value: TypeAlias = "bool | int | float | str | list[Value] | dict[str, Value] | None"
"""A value of a recipe as YAML gives it, before validation."""

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices that lead from the top of a recipe to a value."""


def dotted(path: KeyPath) -> str:
    """Return a key path as text: ``flakes.life.0``."""
    return ".".join(map(str, path))


@dataclass(frozen=True, slots=True)
class Origin:
    """The place where a key was written.

    Attributes:
        file: The recipe file, as the user named it; None for ``--set``.
        line: Line in the file, from 1; 0 for ``--set``.
    """

    file: Path | None
    line: int

    def locate(self, path: KeyPath) -> str:
        """Return the beginning of a message about the key: ``campfire.yaml:12: flakes.alpha``.

        With an empty ``path`` it is about the file as a whole.
        """
        where = "--set " if self.file is None else f"{self.file}:{self.line}: "
        return where + dotted(path) if path else where.rstrip(": ")


COMMAND_LINE = Origin(None, 0)
"""The origin of a key set by ``--set``."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A key that is wrong, and how to correct it.

    Attributes:
        path: The key, from the top of the recipe; in a ``ContradictionError``, from its block.
        message: What is wrong and what to do. It is printed after the key: ``rotate: MESSAGE``.
    """

    path: KeyPath
    message: str


class ContradictionError(ValueError):
    """Keys of one block contradict each other. Raised by the validator of the block's model.

    Attributes:
        problems: At least one, each about the key that should be changed.
    """

    def __init__(self, *problems: Problem) -> None:
        """Join the problems of one block."""
        super().__init__(
            "; ".join(f"{dotted(problem.path)}: {problem.message}" for problem in problems)
        )
        self.problems = problems


def did_you_mean(word: str, choices: Iterable[str], prefix: str = "") -> str:
    """Return ``"; did you mean X?"`` for the most similar choice, or ``""`` if none is similar.

    ``prefix`` is put before the choice, for instance the block of a key.
    """
    from difflib import get_close_matches  # imported only when a message needs it

    spelt = {choice.lower(): choice for choice in choices}
    near = get_close_matches(word.lower(), spelt, n=1)
    return f"; did you mean {prefix}{spelt[near[0]]}?" if near else ""
