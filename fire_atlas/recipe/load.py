"""Load a recipe with its files and members, and print it with all defaults."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from fire_atlas.core.files import real
from fire_atlas.recipe.frame_size import SizedFrame
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.ramps import FLAME_RAMP, HEAT_RAMP, ramp_files
from fire_atlas.recipe.tree import RecipeTree, source_files, templates, texture_files
from fire_atlas.recipe.validate import validate


@dataclass(frozen=True, slots=True)
class LoadedRecipe:
    """A validated recipe and its files.

    Attributes:
        recipe: The recipe, with its ``name`` filled in.
        path: The recipe file, as the user named it.
        base: The folder of ``path``.
        tree: The merged keys from which ``recipe`` was validated.
        source_files: Absolute path (or glob) of each file of the source, by its key, or by that of
            an item of a list.
        texture_files: Absolute path of the texture of flakes by its key, if there is one.
        templates: Absolute path of each template in ``exports``, by its path in the recipe.
        heat_ramps, flame_ramps: Absolute path of each image in ``atlas.ramp`` and in
            ``composite.ramp``, by its key.
        members: Recipes whose effects share the pages. Their ``atlas``, ``maps`` and ``tracks`` are
            those of this recipe.
    """

    recipe: Recipe
    path: Path
    base: Path
    tree: RecipeTree
    source_files: dict[KeyPath, Path]
    texture_files: dict[KeyPath, Path]
    templates: dict[str, Path]
    heat_ramps: dict[KeyPath, Path]
    flame_ramps: dict[KeyPath, Path]
    members: tuple["LoadedRecipe", ...] = ()

    @property
    def parts(self) -> "tuple[LoadedRecipe, ...]":
        """The recipes whose frames are on the pages: this one, if it has a source, and members."""
        return ((self,) if self.recipe.source else ()) + self.members


def load_tree(tree: RecipeTree) -> LoadedRecipe:
    """Validate a recipe that has been read."""
    recipe = validate(tree).model_copy(update={"name": tree.name})
    members = tuple(_member(member, recipe) for member in tree.members)
    return LoadedRecipe(
        recipe,
        tree.path,
        tree.path.parent,
        tree,
        source_files(tree),
        texture_files(tree),
        templates(tree),
        ramp_files(tree, HEAT_RAMP),
        ramp_files(tree, FLAME_RAMP),
        members,
    )


def _member(tree: RecipeTree, host: Recipe) -> LoadedRecipe:
    """Load a member with the settings of ``host`` for the shared pages."""
    loaded = load_tree(tree)
    names = ("atlas", "maps", "tracks", "movies")
    shared = {name: getattr(host, name) for name in names}
    return replace(loaded, recipe=loaded.recipe.model_copy(update=shared))


def resolved_yaml(loaded: LoadedRecipe) -> str:
    """Return the recipe with all defaults as YAML, which builds the same beside ``loaded.path``."""
    values = loaded.recipe.model_dump(mode="json", by_alias=True)
    base = real(loaded.base)
    if values["source"] is None:
        del values["source"]
    if isinstance(loaded.recipe.source, SizedFrame) and loaded.recipe.source.size is not None:
        del values["source"]["width"], values["source"]["height"]  # refused beside it
    files: dict[Any, Path] = {
        **loaded.source_files, **loaded.texture_files, **loaded.heat_ramps, **loaded.flame_ramps
    }  # fmt: skip
    for (*blocks, key), path in files.items():
        block: Any = values
        for name in blocks:
            block = block[name]
        block[key] = _relative(path, base)
    values["atlas"]["members"] = [_relative(real(member.path), base) for member in loaded.members]
    if loaded.recipe.atlas.layout == "grid" or loaded.recipe.maps != Maps():
        values["atlas"]["dedupe"] = False  # the default in grids and with maps
    for export in values["exports"]:
        if isinstance(export, dict) and "template" in export:
            export["template"] = _relative(loaded.templates[export["template"]], base)
    return yaml.dump(
        values, Dumper=_Dumper, sort_keys=False, default_flow_style=False, allow_unicode=True
    )


class _Dumper(yaml.SafeDumper):
    """YAML writer with each list on one line and each key of a block on its own."""


def _one_line(dumper: _Dumper, items: list[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=True)


_Dumper.add_representer(list, _one_line)


def _relative(path: Path, base: Path) -> str:
    try:
        return Path(os.path.relpath(path, base)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()
