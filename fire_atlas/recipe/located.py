"""Name the recipe, the line and the key in errors of what knows only a recipe's values."""

from collections.abc import Generator
from contextlib import contextmanager

from fire_atlas.core.errors import FireAtlasError
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.tree import RecipeTree


@contextmanager
def located(tree: RecipeTree, key: KeyPath = ()) -> Generator[None]:
    """Put the place of its key before the lines of an error that is raised inside.

    Args:
        tree: The recipe.
        key: The key that an error is about that names none; ``()`` for the recipe as a whole.

    Raises:
        FireAtlasError: The error, of its own class. One that has its place already keeps it.
    """
    try:
        yield
    except FireAtlasError as error:
        if error.is_placed:
            raise
        path = key if error.key is None else error.key
        where = tree.origin(path).locate(path) if path else str(tree.path)
        raise error.placed(where) from error
