"""Ramps that a recipe names: ready ones, the learnt one, and files."""

from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.recipe.located import located
from fire_atlas.recipe.tree import RecipeTree

LEARNT = "learnt"
"""The ramp that gives back the clip's own colours."""

READY_RAMPS = ("campfire", "gas", "copper", "poison", "soul", "frost", "blackbody")
"""The ramps that the tool brings along."""

_RAMP = ("atlas", "ramp")


def ramp_files(tree: RecipeTree) -> dict[str, Path]:
    """Return the absolute path of each image in ``atlas.ramp``, by its path in the recipe."""
    value = tree.value(_RAMP)
    listed = value if isinstance(value, list) else [value]
    found = {}
    for i, name in enumerate(listed):
        if isinstance(name, str) and name != LEARNT and name not in READY_RAMPS:
            found[name] = tree.file_at((*_RAMP, i) if isinstance(value, list) else _RAMP, name)
    return found


def existing_ramps(tree: RecipeTree) -> list[Path]:
    """Return the images in ``atlas.ramp``, in order.

    Raises:
        SourceError: One does not exist.
    """
    found = ramp_files(tree)
    for name, path in found.items():
        with located(tree, _RAMP):
            if not path.is_file():
                raise SourceError(
                    f"{name} is neither a ready ramp ({', '.join(READY_RAMPS)}; "
                    f"{LEARNT}: the clip's own) nor an image: there is no {path}"
                )
    return list(dict.fromkeys(found.values()))
