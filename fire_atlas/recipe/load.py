"""Load a recipe: its validated model, where it lies, its files and members; and print it whole."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps
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


def resolved_yaml(loaded: LoadedRecipe) -> str:
    """Return the whole recipe in model order; saved beside ``loaded.path`` it builds the same."""
    values = loaded.recipe.model_dump(mode="json")
    base = loaded.base.resolve()
    if values["source"] is None:
        del values["source"]
    for (*blocks, key), path in loaded.source_files.items():
        block = values
        for name in blocks:
            block = block[name]
        block[key] = _relative(path, base)
    values["atlas"]["members"] = [
        _relative(member.path.resolve(), base) for member in loaded.members
    ]
    if loaded.recipe.atlas.layout == "grid" or loaded.recipe.maps != Maps():
        values["atlas"]["dedupe"] = False  # what such a recipe means by leaving it out
    for export in values["exports"]:
        if isinstance(export, dict) and "template" in export:
            export["template"] = _relative(loaded.templates[export["template"]], base)
    return yaml.dump(
        values, Dumper=_Dumper, sort_keys=False, default_flow_style=False, allow_unicode=True
    )


class _Dumper(yaml.SafeDumper):
    """Writes lists on one line, blocks on lines of their own, in the order they come."""


def _one_line(dumper: _Dumper, items: list[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=True)


_Dumper.add_representer(list, _one_line)


def _relative(path: Path, base: Path) -> str:
    try:
        return Path(os.path.relpath(path, base)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()
