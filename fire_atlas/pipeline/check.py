"""Check a recipe against the limits of the formats and engines it names, before any work is done.

A valid recipe may still ask for what a file format cannot hold or an engine cannot show. Each of
them states that in a module ``limits``, which imports nothing heavy; all are called here.
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
"""A valid recipe within the limits of all its outputs: the result of ``load_checked``, and all that
builds accept."""


def load_checked(tree: RecipeTree) -> CheckedRecipe:
    """Validate a recipe that has been read, and check the limits of its outputs.

    If it has members, these contribute only frames; ``atlas``, ``maps``, ``exports`` and ``tracks``
    are its own, and so only these are checked.

    Raises:
        RecipeError: It is invalid or exceeds a limit; a line for each problem, with file, line and
            key.
        OutputError: It needs an optional package that is not installed.
    """
    loaded = load_tree(tree)
    if problems := list(_problems(loaded.recipe)):
        raise refusal(tree, problems)
    if missing := missing_extra(loaded.recipe.atlas):
        raise OutputError(missing)
    return CheckedRecipe(loaded)


def _problems(recipe: Recipe) -> Iterator[Problem]:
    """Yield what the formats and engines of a recipe cannot do."""
    atlas, exports = recipe.atlas, recipe.exports
    has_flakes = recipe.flakes != "none" or bool(atlas.members)
    yield from page_limits(atlas)
    yield from map_limits(recipe.maps, atlas, has_flakes)
    yield from description_limits(atlas, exports)
    yield from godot_limits(atlas, exports, recipe.tracks)
    yield from unity_limits(atlas, exports)
