"""docs/recipe.md says what the models of a recipe say, and recipes shown in docs are valid."""

import runpy
from typing import Any

import pytest
import yaml

from fire_atlas.recipe.keys import all_keys
from fire_atlas.recipe.models import Recipe
from tests.docs.markdown import PAGES, ROOT, code_blocks, page_text

GENERATOR = "docs/generate_recipe_reference.py"


def test_the_reference_is_fresh() -> None:
    reference = runpy.run_path(str(ROOT / GENERATOR))["recipe_reference"]()
    assert page_text("docs/recipe.md") == reference, (
        f"docs/recipe.md is stale: run `python {GENERATOR}` and commit it"
    )


def test_the_reference_has_every_key() -> None:
    text = page_text("docs/recipe.md")
    missing = {path[-1] for path in all_keys() if f"| `{path[-1]}` |" not in text}
    assert missing <= {"css", "godot", "unity"}  # names of exports, whose options have sections


@pytest.mark.parametrize("page", PAGES)
def test_recipes_in_docs_are_valid(page: str) -> None:
    for text in code_blocks(page, "yaml"):
        recipe: dict[str, Any] = yaml.safe_load(text)
        recipe.pop("extends", None)
        Recipe.model_validate({"source": {"path": "clip"}, **recipe})
