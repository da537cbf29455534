"""Where each key of a recipe was written, mistakes in keys, and guesses at what was meant."""

from collections.abc import Iterable
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
class Problem:
    """A key that is wrong, and what would be right.

    Attributes:
        path: The key, from the top of the recipe; in a ``ContradictionError``, from its block.
        message: What is wrong with it and what to do, as it follows the key: ``rotate: MESSAGE``.
    """

    path: KeyPath
    message: str


class ContradictionError(ValueError):
    """Keys of one block exclude each other. Raised by the validator of the block's model.

    Attributes:
        problems: At least one; each names the key that has to give way.
    """

    def __init__(self, *problems: Problem) -> None:
        """Join the problems of one block."""
        super().__init__("; ".join(f"{dotted(each.path)}: {each.message}" for each in problems))
        self.problems = problems


def did_you_mean(word: str, choices: Iterable[str], prefix: str = "") -> str:
    """Return ``"; did you mean X?"`` for the choice nearest to ``word``, or ``""`` if none is near.

    ``prefix`` goes before the choice: the block a key is in, for instance.
    """
    from difflib import get_close_matches  # only a mistake has to pay for this import

    spelt = {choice.lower(): choice for choice in choices}
    near = get_close_matches(word.lower(), spelt, n=1)
    return f"; did you mean {prefix}{spelt[near[0]]}?" if near else ""
