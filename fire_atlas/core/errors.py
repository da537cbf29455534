"""Errors that a user can act on, each with its exit code.

A message says which file, line, key or frame, what is wrong there and what would be right.
"""


class FireAtlasError(Exception):
    """A problem that the user can fix. It is printed without a traceback."""

    exit_code = 1


class RecipeError(FireAtlasError):
    """A recipe or the command line is invalid."""

    exit_code = 2


class SourceError(FireAtlasError):
    """An input file is missing, damaged or too large."""


class OutputError(FireAtlasError):
    """The outputs cannot be computed or written."""
