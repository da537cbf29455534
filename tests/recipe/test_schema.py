"""The JSON Schema editors use."""

import json
from collections.abc import Iterator
from typing import Any

from fire_atlas.recipe.schema import recipe_schema


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
