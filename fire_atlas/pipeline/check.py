"""Refuse what cannot be written, shown or imported, before any work is done.

A recipe may be sound in itself and still ask for what a file or an engine cannot hold. What that
is stands beside each writer, in its module ``limits``, which imports nothing heavy; a new engine
brings its own, and is listed here.
"""

from collections.abc import Iterator
from typing import NewType

from fire_atlas.channels.limits import map_limits
from fire_atlas.core.errors import OutputError
from fire_atlas.engines.godot.limits import godot_limits
from fire_atlas.engines.unity.limits import unity_limits
from fire_atlas.formats.limits import description_limits, missing_extra, page_limits
from fire_atlas.recipe.load import LoadedRecipe, load_tree
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.problem import Problem
from fire_atlas.recipe.tree import RecipeTree
from fire_atlas.recipe.validate import refusal

CheckedRecipe = NewType("CheckedRecipe", LoadedRecipe)
"""A recipe whose outputs can all be written as it asks. Builds take no other, and only
``load_checked`` makes one."""


def load_checked(tree: RecipeTree) -> CheckedRecipe:
    """Validate a recipe that has been read, and hold it to the limits of all that it writes.

    Its members bring frames alone: where it has any, only its own ``atlas``, ``maps``, ``exports``
    and ``tracks`` are written, and so only these are checked.

    Raises:
        RecipeError: It is not valid, or beyond a limit; a line for each problem, with file, line
            and key.
        OutputError: It needs an extra that is not installed.
    """
    loaded = load_tree(tree)
    if problems := list(_problems(loaded.recipe)):
        raise refusal(tree, problems)
    if missing := missing_extra(loaded.recipe.atlas):
        raise OutputError(missing)
    return CheckedRecipe(loaded)


def _problems(recipe: Recipe) -> Iterator[Problem]:
    """Yield what each writer cannot do of the recipe."""
    atlas, exports = recipe.atlas, recipe.exports
    has_flakes = recipe.flakes != "none" or bool(atlas.members)
    yield from page_limits(atlas)
    yield from map_limits(recipe.maps, atlas, has_flakes)
    yield from description_limits(atlas, exports)
    yield from godot_limits(atlas, exports, recipe.tracks)
    yield from unity_limits(atlas, exports)
