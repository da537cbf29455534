"""Make the JSON Schema of recipes, by which editors complete and check keys."""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from fire_atlas.recipe.inherit import EXTENDS
from fire_atlas.recipe.keys import key_docs
from fire_atlas.recipe.models import Recipe

_EXTENDS_SCHEMA = {
    "type": "string",
    "minLength": 1,
    "description": "Another recipe to start from: the name of a preset, or a path relative to this"
    " file. Blocks are merged key by key; any other value replaces the inherited one.",
}


class _RecipeSchema(GenerateJsonSchema):
    """Describes keys by their docstrings.

    It leaves out the titles that pydantic derives from key names: editors show the keys anyway.
    """

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Never set a title."""
        return False

    def model_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema of a block, with the docstrings of its keys as descriptions."""
        block = super().model_schema(schema)
        for key, doc in key_docs(schema["cls"]).items():
            block["properties"][key]["description"] = doc
        return block


def recipe_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a recipe file."""
    schema = Recipe.model_json_schema(schema_generator=_RecipeSchema)
    # All kinds of source are allowed: the recipe that this one extends may state `kind`.
    one_kind, none = schema["properties"]["source"]["anyOf"]
    schema["properties"]["source"]["anyOf"] = [*one_kind["oneOf"], none]
    needed = [
        schema["$defs"][kind].pop("required")
        for kind in ("FramesSource", "ProfileSource", "SpritesSource")
    ]
    path_needed = {
        "if": {"properties": {"kind": {"enum": ["frames", "profile", "sprites"]}}},
        "then": {"required": needed[0]},
    }
    properties = {"version": schema["properties"].pop("version"), EXTENDS: _EXTENDS_SCHEMA}
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        **schema,
        "title": "fire-atlas recipe",
        "properties": {**properties, **schema["properties"]},
        # Nothing is required with `extends`: that recipe may supply `source` or `source.path`.
        "required": [],
        "anyOf": [
            {"required": [EXTENDS]},
            {"required": ["source"], "properties": {"source": path_needed}},
            {"required": ["atlas"], "properties": {"atlas": {"required": ["members"]}}},
        ],
    }
