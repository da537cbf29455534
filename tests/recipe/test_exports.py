"""Exports by name, with options, and as templates."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import TemplateExport, UnityExport, UnityOptions
from fire_atlas.recipe.schema import recipe_schema
from fire_atlas.recipe.tree import read_tree

Write = Callable[..., Path]
SOURCE = "source: {path: x}\n"


def exports(write: Write, text: str) -> Recipe:
    return load_tree(read_tree(write(f"{SOURCE}{text}"))).recipe


def test_an_engine_is_named_alone_or_with_options(write: Write) -> None:
    recipe = exports(
        write, "exports: [json, unity, {unity: {flakes: false}}, {template: a, to: b}]"
    )
    assert recipe.exports == (
        "json",
        "unity",
        UnityExport(unity=UnityOptions(flakes=False)),
        TemplateExport(template="a", to="b"),
    )
    assert exports(write, "exports: [{unity: {}}]").exports == (UnityExport(unity=UnityOptions()),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("exports: [{unity: {flakes: 5}}]", "exports.0.unity.flakes: must be true or false; got 5"),
        ("exports: [{unity: {flaks: true}}]", "did you mean exports.0.unity.flakes?"),
        ("exports: [{unity: 3}]", "exports.0.unity: must be a block of settings; got 3"),
        ("exports: [{unity: }]", "exports.0.unity: has no value"),
        ("exports: [{untiy: {flakes: true}}]", "exports.0: must be the name of a format"),
        ("exports: [godto]", "did you mean godot?"),
        ("exports: [{}]", "exports.0: must be the name of a format"),
        ("exports: [3]", "exports.0: must be the name of a format"),
        ("exports: [{template: a}]", "exports.0.to: is missing"),
        (
            "exports: [{template: a, too: b}]",
            "exports.0.too: unknown key; did you mean exports.0.to?",
        ),
        (
            "exports: [{template: a, to: b, unity: {}}]",
            "exports.0.to: unknown key; it cannot be combined",
        ),
    ],
)
def test_mistakes_are_reported_where_they_are(text: str, message: str, write: Write) -> None:
    with pytest.raises(RecipeError) as caught:
        exports(write, text)
    assert message in str(caught.value)
    assert "<" not in str(caught.value)


@pytest.mark.parametrize("exports", ["[[json]]", "[{}]", "[json, [godot]]", "[[[]]]", "[null]"])
def test_what_is_no_export_is_refused_at_its_key(exports: str, write: Write) -> None:
    path = write(f"{SOURCE}exports: {exports}\n")
    with pytest.raises(RecipeError, match=r"exports\.[01]"):
        load_tree(read_tree(path))


@pytest.mark.parametrize(
    ("options", "key", "advice"),
    [
        ("{version: 3}", "godot.version", "Godot 3 is not supported any more; write `godot` alone"),
        ("{version: 4}", "godot", "has no options, as Godot 4 is the only version; leave them out"),
        ("{}", "godot", "has no options"),
        ("4", "godot", "has no options"),
    ],
)
def test_a_version_of_godot_is_refused_at_its_line_and_key(
    options: str, key: str, advice: str, write: Write
) -> None:
    path = write(f"{SOURCE}exports:\n- json\n- godot: {options}\n")
    with pytest.raises(RecipeError) as caught:
        load_tree(read_tree(path))
    assert str(caught.value).startswith(f"{path}:4: exports.1.{key}: {advice}")


def test_the_schema_knows_words_options_and_templates() -> None:
    schema = recipe_schema()
    forms = schema["properties"]["exports"]["items"]["oneOf"]
    words = next(form["enum"] for form in forms if "enum" in form)
    assert {"json", "godot"} <= set(words)
    mappings = next(form["oneOf"] for form in forms if "oneOf" in form)
    assert {form["$ref"].rpartition("/")[2] for form in mappings} == {
        "CssExport", "TemplateExport", "UnityExport",
    }  # fmt: skip
    player = schema["$defs"]["UnityOptions"]["properties"]["player"]
    assert (player["enum"], player["default"]) == (["own", "package"], "own")
