"""A recipe file → everything a build has to know."""

from dataclasses import dataclass, replace
from pathlib import Path

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.tree import RecipeTree, source_files, templates
from fire_atlas.recipe.validate import validate


@dataclass(frozen=True, slots=True)
class LoadedRecipe:
    """A valid recipe and where it lies.

    Attributes:
        recipe: The recipe; its ``name`` is filled in.
        path: The recipe file, as the user named it.
        base: The folder of ``path``.
        tree: What the recipe was made from.
        source_files: Absolute path (or glob) of each file the source names, by its key; each is
            relative to the recipe file that states it.
        templates: Absolute path of each template in ``exports``, by what the recipe calls it.
        members: Recipes whose effects share the pages; they have this recipe's ``atlas``,
            ``maps`` and ``tracks``.
    """

    recipe: Recipe
    path: Path
    base: Path
    tree: RecipeTree
    source_files: dict[tuple[str, ...], Path]
    templates: dict[str, Path]
    members: tuple["LoadedRecipe", ...] = ()

    @property
    def parts(self) -> "tuple[LoadedRecipe, ...]":
        """The recipes that bring frames: this one, if it has a source, and its members."""
        return ((self,) if self.recipe.source else ()) + self.members


def load_tree(tree: RecipeTree) -> LoadedRecipe:
    """Validate a recipe that has been read."""
    recipe = validate(tree).model_copy(update={"name": tree.name})
    members = tuple(_member(each, recipe) for each in tree.members)
    return LoadedRecipe(
        recipe, tree.path, tree.path.parent, tree, source_files(tree), templates(tree), members
    )


def _member(tree: RecipeTree, host: Recipe) -> LoadedRecipe:
    """Return a member as it is built for the pages of ``host``."""
    loaded = load_tree(tree)
    shared = {"atlas": host.atlas, "maps": host.maps, "tracks": host.tracks}
    return replace(loaded, recipe=loaded.recipe.model_copy(update=shared))
