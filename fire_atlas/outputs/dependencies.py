"""List the files that a build reads, to find out whether it is stale, for depfiles and ``watch``.

Imports nothing heavy, so that a build that is up to date ends at once.
"""

from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import real
from fire_atlas.recipe.located import located
from fire_atlas.recipe.ramps import FLAME_RAMP, HEAT_RAMP, existing_ramps
from fire_atlas.recipe.tree import RecipeTree, source_files, templates, texture_files
from fire_atlas.sources.listing import (
    FixedRange,
    folders_of_sprites,
    list_inputs,
    list_sprites,
)


def files_of(tree: RecipeTree) -> list[Path]:
    """Return every file that a build of a valid recipe reads, recipes first, without repeats.

    Raises:
        SourceError: The source is missing, or lacks frames that the recipe uses.
    """
    return list(dict.fromkeys([*recipe_files(tree), *inputs_of(tree)]))


def dependencies_of(tree: RecipeTree, out: Path) -> list[Path]:
    """Return ``files_of`` a recipe, and the folders in which a new file would be a new frame.

    Folders that a build into ``out`` changes are left out: they would keep it stale.

    Raises:
        SourceError: As in ``files_of``.
    """
    changed = real(out), real(out).parent
    folders = [folder for folder in folders_of(tree) if folder not in changed]
    return [*files_of(tree), *folders]


def recipe_files(tree: RecipeTree) -> list[Path]:
    """Return the files of a recipe and its members, with the recipes that these extend."""
    return [file for recipe in (tree, *tree.members) for file in recipe.files]


def inputs_of(tree: RecipeTree) -> list[Path]:
    """Return the files of sources, textures, ramps and templates, in the order of the manifest.

    Globs and folders are resolved as they are now.

    Raises:
        SourceError: The source is missing, or lacks frames that the recipe uses.
    """
    own = [tree] if tree.has_source else []
    frames = [path for recipe in (*own, *tree.members) for path in _source_inputs(recipe)]
    ramps = existing_ramps(tree, HEAT_RAMP)
    ramps += [
        path for recipe in (*own, *tree.members) for path in existing_ramps(recipe, FLAME_RAMP)
    ]
    return [*frames, *dict.fromkeys(ramps), *templates(tree).values()]


def _is_of_sprites(tree: RecipeTree) -> bool:
    return tree.value(("source", "kind")) == "sprites"


def _source_inputs(tree: RecipeTree) -> list[Path]:
    if _is_of_sprites(tree):
        return list_sprites(source_files(tree).values())
    start, count = (tree.value(("source", key)) for key in ("start", "count"))
    first = start if isinstance(start, int) else 0
    used = FixedRange(first, count if isinstance(count, int) else None)
    is_learnt = tree.value(("source", "kind")) == "profile"
    found = list[Path]()
    for key, files in source_files(tree).items():
        is_clip = not (is_learnt and key == ("source", "path"))
        with located(tree, key):
            found += list_inputs(used, files, is_clip=is_clip)
    return [*found, *textures_of(tree)]


def textures_of(tree: RecipeTree) -> list[Path]:
    """Return the file of the texture of flakes, if there is one.

    Raises:
        SourceError: It does not exist, or is a folder.
    """
    for key, path in texture_files(tree).items():
        with located(tree, key):
            if not path.exists():
                raise SourceError(f"there is no image {path}; paths begin at the recipe file")
            if path.is_dir():
                raise SourceError(f"{path} is a folder; name one image, or a sheet with grid")
    return list(texture_files(tree).values())


def folders_of(tree: RecipeTree) -> list[Path]:
    """Return the folders to watch for new frames: of sources given as a folder or a glob."""
    folders: dict[Path, None] = {}
    for recipe in (tree, *tree.members):
        for source in source_files(recipe).values():
            if _is_of_sprites(recipe):
                folders |= dict.fromkeys(folders_of_sprites(source))
            elif not source.is_file():
                folders |= dict.fromkeys([_existing(source)])
    return list(folders)


def _existing(path: Path) -> Path:
    """Return ``path`` if it is a folder, else its innermost parent that exists, as for globs."""
    return path if path.is_dir() or path == path.parent else _existing(path.parent)
