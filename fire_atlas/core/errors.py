"""Errors that a user can act on, each with its exit code.

A message says which file, line, key or frame, what is wrong there and what would be right.
"""


class FireAtlasError(Exception):
    """A problem that the user can fix. It is printed without a traceback."""

    exit_code = 1

    def __init__(self, *lines: str) -> None:
        """Say what is wrong in one or several ``lines``.

        A line break inside of a line belongs to what it tells of, such as the name of a file.
        """
        super().__init__(*lines)
        self.lines = lines

    def __str__(self) -> str:
        """Return all lines as one text."""
        return "\n".join(self.lines)


class RecipeError(FireAtlasError):
    """A recipe or the command line is invalid."""

    exit_code = 2


class SourceError(FireAtlasError):
    """An input file is missing, damaged or too large."""


class OutputError(FireAtlasError):
    """The outputs cannot be computed or written."""
