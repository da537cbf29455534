"""Errors that a user can act on, each with its exit code.

A message says which file, line, key or frame, what is wrong there and what would be right.
"""

from collections.abc import Generator
from contextlib import contextmanager


class FireAtlasError(Exception):
    """A problem that the user can fix. It is printed without a traceback."""

    exit_code = 1

    def __init__(self, *lines: str, key: tuple[str | int, ...] | None = None) -> None:
        """Say what is wrong in one or several ``lines``.

        A line break inside of a line belongs to what it tells of, such as the name of a file.

        Args:
            lines: What is wrong, and what would be right.
            key: The key of a recipe that should be changed, where only its value is known, and not
                its file. Whoever knows that puts the place before the lines (``recipe.located``).
        """
        super().__init__(*lines)
        self.key = key
        self.is_placed = False
        self._lines = lines

    @property
    def lines(self) -> tuple[str, ...]:
        """What is wrong; each line begins with the key, if it is known and its file is not."""
        where = "" if self.key is None else f"{'.'.join(map(str, self.key))}: "
        return tuple(f"{where}{line}" for line in self._lines)

    def placed(self, where: str) -> "FireAtlasError":
        """Return the error with its place in a recipe, ``fire.yaml:3: source.crop``, before each
        line."""
        error = type(self)(*(f"{where}: {line}" for line in self._lines))
        error.is_placed = True
        return error

    def __str__(self) -> str:
        """Return all lines as one text."""
        return "\n".join(self.lines)


@contextmanager
def about(key: tuple[str | int, ...]) -> Generator[None]:
    """Say of errors that are raised inside, and name no key, that they are about ``key``."""
    try:
        yield
    except FireAtlasError as error:
        if error.key is None and not error.is_placed:
            error.key = key
        raise


class RecipeError(FireAtlasError):
    """A recipe or the command line is invalid."""

    exit_code = 2


class SourceError(FireAtlasError):
    """An input file is missing, damaged or too large."""


class OutputError(FireAtlasError):
    """The outputs cannot be computed or written."""
