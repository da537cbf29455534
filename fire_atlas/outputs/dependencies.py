"""Which files a build reads, for build systems and ``watch``. Imports nothing heavy."""

from pathlib import Path

from fire_atlas.outputs.manifest import inputs_of
from fire_atlas.recipe.tree import RecipeTree, member_trees, source_files


def files_of(tree: RecipeTree) -> list[Path]:
    """Return every file that a build of a sound recipe reads, each once: recipes first.

    Raises:
        SourceError: The source is missing, or has not the frames that the recipe asks for.
    """
    return list(dict.fromkeys([*recipe_files(tree), *inputs_of(tree)]))


def recipe_files(tree: RecipeTree) -> list[Path]:
    """Return the recipe, what it extends, and its members with theirs."""
    return [file for part in (tree, *member_trees(tree)) for file in part.files]


def folders_of(tree: RecipeTree) -> list[Path]:
    """Return the folders whose images are frames, of sources that are not a single file."""
    folders: dict[Path, None] = {}
    for part in (tree, *member_trees(tree)):
        for source in source_files(part).values():
            if not source.is_file():
                folders |= dict.fromkeys([_existing(source)])
    return list(folders)


def _existing(path: Path) -> Path:
    """Return ``path``, or the innermost folder of it that exists: globs name files in it."""
    return path if path.is_dir() or path == path.parent else _existing(path.parent)
