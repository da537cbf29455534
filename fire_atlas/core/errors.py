"""Everything that can go wrong, each with its exit code.

A message says which file, line, key or frame, what is wrong there and what would be right.
"""


class FireAtlasError(Exception):
    """A problem a person can act on. Printed without a traceback."""

    exit_code = 1


class RecipeError(FireAtlasError):
    """A recipe, or the command line, asks for something that cannot be."""

    exit_code = 2


class SourceError(FireAtlasError):
    """The input named by a recipe is missing, broken or too large."""


class OutputError(FireAtlasError):
    """The outputs cannot be written where they were asked for."""
