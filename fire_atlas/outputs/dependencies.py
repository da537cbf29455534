"""Which files a build reads, for its freshness, for build systems and for ``watch``.

Nothing heavy is imported here: a build that is up to date needs no more than this.
"""

from pathlib import Path

from fire_atlas.recipe.tree import RecipeTree, source_files, templates
from fire_atlas.sources.listing import FixedRange, list_inputs


def files_of(tree: RecipeTree) -> list[Path]:
    """Return every file that a build of a sound recipe reads, each once: recipes first.

    Raises:
        SourceError: The source is missing, or has not the frames that the recipe asks for.
    """
    return list(dict.fromkeys([*recipe_files(tree), *inputs_of(tree)]))


def recipe_files(tree: RecipeTree) -> list[Path]:
    """Return the recipe, what it extends, and its members with theirs."""
    return [file for each in (tree, *tree.members) for file in each.files]


def inputs_of(tree: RecipeTree) -> list[Path]:
    """Return the files that the sources and the templates of a sound recipe stand for now, in the
    order of the manifest.

    Raises:
        SourceError: The source is missing, or has not the frames that the recipe asks for.
    """
    own = [tree] if tree.has_source else []
    frames = [path for each in (*own, *tree.members) for path in _source_inputs(each)]
    return [*frames, *templates(tree).values()]


def _source_inputs(tree: RecipeTree) -> list[Path]:
    start, count = (tree.value(("source", key)) for key in ("start", "count"))
    first = start if isinstance(start, int) else 0
    used = FixedRange(first, count if isinstance(count, int) else None)
    return [path for files in source_files(tree).values() for path in list_inputs(used, files)]


def folders_of(tree: RecipeTree) -> list[Path]:
    """Return the folders whose images are frames, of sources that are not a single file."""
    folders: dict[Path, None] = {}
    for each in (tree, *tree.members):
        for source in source_files(each).values():
            if not source.is_file():
                folders |= dict.fromkeys([_existing(source)])
    return list(folders)


def _existing(path: Path) -> Path:
    """Return ``path``, or the innermost folder of it that exists: globs name files in it."""
    return path if path.is_dir() or path == path.parent else _existing(path.parent)
