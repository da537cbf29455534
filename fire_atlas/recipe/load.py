"""A recipe file → everything a build has to know."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.tree import RecipeTree, read_tree
from fire_atlas.recipe.validate import validate

_SOURCE_PATH = ("source", "path")


@dataclass(frozen=True, slots=True)
class LoadedRecipe:
    """A valid recipe and where it lies.

    Attributes:
        recipe: The recipe; its ``name`` is filled in.
        path: The recipe file, as the user named it.
        base: The folder of ``path``.
        tree: What the recipe was made from.
        source_path: Absolute path (or glob) of the source, relative to the file that states it.
    """

    recipe: Recipe
    path: Path
    base: Path
    tree: RecipeTree
    source_path: Path


def load(path: Path, overrides: Sequence[str] = ()) -> LoadedRecipe:
    """Read and validate the recipe ``path``, changed by ``overrides`` (``key=value``)."""
    return load_tree(read_tree(path, overrides))


def load_tree(tree: RecipeTree) -> LoadedRecipe:
    """Validate a recipe that has been read."""
    recipe = validate(tree).model_copy(update={"name": tree.name})
    source_path = tree.file_at(_SOURCE_PATH, recipe.source.path)
    return LoadedRecipe(recipe, tree.path, tree.path.parent, tree, source_path)
