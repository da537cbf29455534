"""Ramps that a recipe names: ready ones, the learnt one, and files."""

from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.recipe.located import located
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.tree import RecipeTree

LEARNT = "learnt"
"""The ramp that gives back the clip's own colours."""

READY_RAMPS = ("campfire", "gas", "copper", "poison", "soul", "frost", "blackbody")
"""The ramps that the tool brings along."""

HEAT_RAMP, FLAME_RAMP = ("atlas", "ramp"), ("composite", "ramp")
"""The keys that name ramps: those of pages of heat, and those of the flame in pages of colours."""

_WORDS = {HEAT_RAMP: f"; {LEARNT}: the clip's own", FLAME_RAMP: "; none: the fire's own colours"}
"""What else each key may say, for the user."""


def ramp_files(tree: RecipeTree, key: tuple[str, str]) -> dict[KeyPath, Path]:
    """Return the absolute path of each image that ``key`` names, by its key in the recipe."""
    value = tree.value(key)
    listed = (
        {(*key, i): name for i, name in enumerate(value)}
        if isinstance(value, list)
        else {key: value}
    )
    return {
        where: tree.file_at(where, name)
        for where, name in listed.items()
        if isinstance(name, str) and name not in (LEARNT, "none", *READY_RAMPS) and name[:1] != "#"
    }


def existing_ramps(tree: RecipeTree, key: tuple[str, str]) -> list[Path]:
    """Return the images that ``key`` names, in order.

    Raises:
        SourceError: One does not exist.
    """
    found = ramp_files(tree, key)
    for where, path in found.items():
        with located(tree, where):
            if not path.is_file():
                raise SourceError(
                    f"{path.name} is neither a ready ramp ({', '.join(READY_RAMPS)}{_WORDS[key]}) "
                    f"nor an image: there is no {path}"
                )
    return list(dict.fromkeys(found.values()))
