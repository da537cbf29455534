"""Exports by name, with options, and as templates."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import GodotExport, GodotOptions, TemplateExport
from fire_atlas.recipe.schema import recipe_schema
from fire_atlas.recipe.tree import read_tree

Write = Callable[..., Path]
SOURCE = "source: {path: x}\n"


def exports(write: Write, text: str) -> Recipe:
    return load_tree(read_tree(write(f"{SOURCE}{text}"))).recipe


def test_an_engine_is_named_alone_or_with_options(write: Write) -> None:
    recipe = exports(write, "exports: [json, godot, {godot: {version: 3}}, {template: a, to: b}]")
    assert recipe.exports == (
        "json",
        "godot",
        GodotExport(godot=GodotOptions(version=3)),
        TemplateExport(template="a", to="b"),
    )
    assert exports(write, "exports: [{godot: {}}]").exports == (GodotExport(godot=GodotOptions()),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("exports: [{godot: {version: 5}}]", "exports.0.godot.version: must be 4 or 3; got 5"),
        ("exports: [{godot: {version: '4'}}]", "exports.0.godot.version: must be 4 or 3"),
        ("exports: [{godot: {verson: 3}}]", "unknown key; did you mean exports.0.godot.version?"),
        ("exports: [{godot: 3}]", "exports.0.godot: must be a block of settings; got 3"),
        ("exports: [{godot: }]", "exports.0.godot: has no value"),
        (
            "exports: [{godto: {version: 3}}]",
            "exports.0: must be the name of a format",
        ),
        ("exports: [godto]", "did you mean godot?"),
        ("exports: [{}]", "exports.0: must be the name of a format"),
        ("exports: [3]", "exports.0: must be the name of a format"),
        ("exports: [{template: a}]", "exports.0.to: is missing"),
        (
            "exports: [{template: a, too: b}]",
            "exports.0.too: unknown key; did you mean exports.0.to?",
        ),
        (
            "exports: [{template: a, to: b, godot: {}}]",
            "exports.0.to: unknown key; it cannot be combined",
        ),
    ],
)
def test_mistakes_are_reported_where_they_are(text: str, message: str, write: Write) -> None:
    with pytest.raises(RecipeError) as caught:
        exports(write, text)
    assert message in str(caught.value)
    assert "<" not in str(caught.value)


def test_the_schema_knows_words_options_and_templates() -> None:
    schema = recipe_schema()
    forms = schema["properties"]["exports"]["items"]["oneOf"]
    words = next(form["enum"] for form in forms if "enum" in form)
    assert {"json", "godot"} <= set(words)
    mappings = next(form["oneOf"] for form in forms if "oneOf" in form)
    assert {form["$ref"].rpartition("/")[2] for form in mappings} == {
        "GodotExport", "TemplateExport", "UnityExport",
    }  # fmt: skip
    version = schema["$defs"]["GodotOptions"]["properties"]["version"]
    assert (version["enum"], version["default"]) == ([4, 3], 4)
