"""The JSON Schema that editors use."""

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.schema import recipe_schema
from fire_atlas.recipe.tree import read_tree

READY = sorted(shipped("recipes").glob("*.yaml"))


class Yaml12(yaml.SafeLoader):
    """Reads as editors do: in YAML 1.2 only true and false are booleans, and ``on`` is a word."""

    yaml_implicit_resolvers = {  # noqa: RUF012 - PyYAML's own name
        first: [
            (tag, pattern)
            for tag, pattern in resolvers
            if tag != "tag:yaml.org,2002:bool" or first in "tTfF"
        ]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


@cache
def validator() -> Draft202012Validator:
    """Return what judges recipes by the schema, which takes a second to make."""
    return Draft202012Validator(recipe_schema())


def properties(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], bool]]:
    """Yield each key, its schema and whether it is required."""
    for owner in (schema, *schema["$defs"].values()):
        required = owner.get("required", [])
        for key, value in owner["properties"].items():
            yield key, value, key in required


def test_the_schema_names_its_draft_and_has_no_id() -> None:
    schema = recipe_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert "$id" not in schema
    assert json.loads(json.dumps(schema)) == schema


def test_every_key_says_what_it_is_and_what_it_is_by_default() -> None:
    may_lack_default = {"source", "extends", "path"}
    schema = recipe_schema()
    for key, value, required in properties(schema):
        assert value.get("description"), key
        assert required or "default" in value or key in may_lack_default, key


def test_a_recipe_needs_a_source_or_something_to_extend() -> None:
    schema = recipe_schema()
    assert list(schema["properties"])[:2] == ["version", "extends"]
    assert {"required": ["extends"]} in schema["anyOf"]
    assert schema["required"] == []


def test_unknown_keys_are_marked_in_every_block() -> None:
    schema = recipe_schema()
    assert all(
        block["additionalProperties"] is False for block in (schema, *schema["$defs"].values())
    )


@pytest.mark.parametrize("path", READY, ids=[path.stem for path in READY])
def test_every_ready_recipe_fits_the_schema(path: Path) -> None:
    validator().validate(yaml.load(path.read_text(encoding="utf-8"), Yaml12))


@pytest.mark.parametrize(
    "recipe",
    [
        {"source": {"path": "clip"}, "wind": {"level": 2, "direction": "left"}},
        {"source": {"path": "clip"}, "wind": {"keyframes": [{"t": 0, "direction": "right"}]}},
        {"extends": "endless_candle", "source": {"slices": 3}},
        {"extends": "silk_campfire", "source": {"foot": 0.3, "sheets": {"on": 0}}},
        {"source": {"kind": "silk"}},
        {"atlas": {"members": ["torch.yaml"]}},
    ],
)
def test_what_the_tool_takes_fits_the_schema(recipe: dict[str, Any]) -> None:
    validator().validate(recipe)


@pytest.mark.parametrize("word", ["none", "off", "no", "~", '"off"'])
@pytest.mark.parametrize(
    "block",
    ["flakes", "motion_blur", "timeline.loop", "source.matte", "source.crop", "atlas.trim",
     "atlas.mesh", "maps.motion", "maps.emission", "composite.palette"],
)  # fmt: skip
def test_what_means_none_to_the_tool_does_to_editors(tmp_path: Path, block: str, word: str) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text("source: {path: clip}\n")
    loaded = load_tree(read_tree(path, [f"{block}={word}"]))
    value: Any = loaded.recipe
    for name in block.split("."):
        value = getattr(value, name)
    assert value == "none"
    *blocks, key = block.split(".")
    # Editors read YAML 1.2, in which `off` and `no` are words; PyYAML reads 1.1.
    for read in (word.strip('"') if word != "~" else None, yaml.safe_load(word)):
        recipe: dict[str, Any] = {"source": {"path": "clip"}}
        at = recipe
        for name in blocks:
            at = at.setdefault(name, {})
        at[key] = read
        validator().validate(recipe)


@pytest.mark.parametrize(
    "recipe",
    [
        {},
        {"source": {}},
        {"source": {"foot": 0.3}},
        {"source": {"path": "clip", "hight": 3}},
        {"source": {"path": "clip"}, "wind": {"direction": "up"}},
        {"source": {"path": "clip"}, "wind": {"direction": 400}},
    ],
)
def test_what_the_tool_refuses_does_not_fit_the_schema(recipe: dict[str, Any]) -> None:
    assert not validator().is_valid(recipe)
