"""What ``wind.levels`` cannot be combined with, and the advice."""

from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.tree import read_tree

SILK = "source: {kind: silk}\n"
LEVELS = "wind: {levels: [0, 2]}\n"


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        (SILK + "wind: {levels: [2]}", "levels must be two or more that increase"),
        (SILK + "wind: {levels: [2, 0]}", "levels must be two or more that increase"),
        (SILK + "wind: {levels: [0, 6]}", "at most 5"),
        (SILK + "wind: {levels: [0, 2], level: 1}", "has both level and levels"),
        ("source: {path: clip}\n" + LEVELS, "source.kind: profile"),
        (SILK + LEVELS + "views: {count: 2}", "remove views.count"),
        (SILK + LEVELS + "timeline: {loop: none}", "remove loop: none"),
        (SILK + LEVELS + "timeline: {frames: 5}", "at least 6 frames"),
        (SILK + LEVELS + "flakes: {bake: false, rounds: 2}", "flakes.rounds"),
    ],
)
def test_what_cannot_be_built_is_refused_with_advice(
    text: str, advice: str, tmp_path: Path
) -> None:
    recipe = tmp_path / "fire.yaml"
    recipe.write_text(text)
    with pytest.raises(RecipeError) as caught:
        load_checked(read_tree(recipe))
    assert advice in str(caught.value)


def test_pages_are_not_shared(tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text(SILK + LEVELS)
    recipe = tmp_path / "fire.yaml"
    recipe.write_text("atlas: {members: [other.yaml]}")
    with pytest.raises(RecipeError, match="need pages of their own"):
        load_checked(read_tree(recipe))
