"""A recipe with every default filled in, as YAML."""

import os
from pathlib import Path
from typing import Any

import yaml

from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.output import Maps


class _Dumper(yaml.SafeDumper):
    """Writes lists on one line, blocks on lines of their own, in the order they come."""


def _one_line(dumper: _Dumper, items: list[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", items, flow_style=True)


_Dumper.add_representer(list, _one_line)


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


def _relative(path: Path, base: Path) -> str:
    try:
        return Path(os.path.relpath(path, base)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()
