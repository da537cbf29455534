"""Find the recipe files that are given to a command, as files or folders."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.files import natural_key, real
from fire_atlas.core.output_file import as_file_name
from fire_atlas.recipe.document import read_document
from fire_atlas.recipe.inherit import EXTENDS
from fire_atlas.recipe.tree import RecipeTree, is_recipe


def find_recipes(arguments: Sequence[Path]) -> list[Path]:
    """Return each file in ``arguments``, and the recipes in each folder in natural order."""
    found: dict[Path, Path] = {}
    for argument in arguments:
        for path in _recipes_in(argument) if argument.is_dir() else [argument]:
            found.setdefault(real(path), path)
    return list(found.values())


def refuse_same_outputs(
    trees: Iterable[RecipeTree], folder_of: Callable[[RecipeTree], Path]
) -> None:
    """Raise ``RecipeError`` if two recipes would write the same files.

    ``folder_of`` gives a recipe's output folder.
    """
    owners: dict[tuple[Path, str], Path] = {}
    for tree in trees:
        folder = folder_of(tree)
        key = real(folder), as_file_name(tree.name)
        other = owners.setdefault(key, tree.path)
        if other != tree.path:
            raise RecipeError(
                f"{tree.path}: would write the same files ({folder / tree.name}.*) "
                f"as {other}; give one of them another `name`"
            )


def _recipes_in(folder: Path) -> list[Path]:
    files = [path for path in folder.iterdir() if is_recipe(path)]
    shown = [path for path in files if path.is_file() and not path.name.startswith(".")]
    recipes = [path for path in sorted(shown, key=natural_key) if _looks_like_recipe(path)]
    if not recipes:
        raise RecipeError(
            f"{folder}: no recipe in this folder (a .yaml or .fire file with `source` or "
            f"`extends`); if it holds frames, fire-atlas init {folder} writes a recipe for them"
        )
    return recipes


def _looks_like_recipe(path: Path) -> bool:
    """Return whether a file of YAML is a recipe. True if it is broken, to report that later."""
    try:
        values = read_document(path).values
    except RecipeError:
        return True
    atlas = values.get("atlas")
    has_members = isinstance(atlas, dict) and "members" in atlas
    return has_members or not {"source", EXTENDS}.isdisjoint(values)
