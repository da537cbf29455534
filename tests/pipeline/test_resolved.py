"""``check --resolved`` prints a valid recipe that builds the same files."""

from pathlib import Path
from typing import Any

import pytest

from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.inherit import presets
from fire_atlas.recipe.load import LoadedRecipe, resolved_yaml
from fire_atlas.recipe.output import Maps
from fire_atlas.recipe.tree import read_tree
from tests.support.repo import Repo, contents

VARIATIONS: dict[str, tuple[str, ...]] = {
    "as shipped": (),
    "grid": ("atlas.layout=grid",),
    "motion vectors": ("atlas.layout=grid", "maps.motion=unity"),
    "layers": ("flakes={}", "maps.flame=true", "maps.flakes=true"),
    "without flakes": ("flakes=none", "motion_blur=none", "tracks=[]"),
    "paper": ("features.preset=paper", "buoyancy.drag=2", "flakes.class=auto", "flakes.style=auto"),
    "engines": ("exports=[godot, {unity: {flakes: false}}, json]", "tracks=[json, light]"),
    "sizes": ("atlas.scales=[1, 0.5]", "atlas.pivot=[0.5, 1]", "timeline.fps=12"),
}


@pytest.mark.parametrize("variation", VARIATIONS)
@pytest.mark.parametrize("preset", presets())
def test_a_resolved_recipe_is_valid_and_means_the_same(
    preset: str, variation: str, tmp_path: Path
) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text(f"extends: {preset}")
    loaded = load_checked(read_tree(path, VARIATIONS[variation]))
    text = resolved_yaml(loaded)
    path.write_text(text)
    again = load_checked(read_tree(path))
    assert values_of(again) == values_of(loaded)
    assert again.source_files == loaded.source_files
    assert resolved_yaml(again) == text


def values_of(loaded: LoadedRecipe) -> dict[str, Any]:
    """Return what a recipe says, but for places that frames share: grids and maps have none."""
    values = loaded.recipe.model_dump(exclude={"source"})
    if loaded.recipe.atlas.layout == "grid" or loaded.recipe.maps != Maps():
        del values["atlas"]["dedupe"]
    return values


@pytest.mark.parametrize(
    "keys",
    [
        {"atlas": {"layout": "grid"}, "maps": {"motion": "unity"}},
        {"maps": {"flame": True, "flakes": True}},
        {"exports": ["json", "unity"], "atlas": {"scales": [1, 0.5]}},
    ],
)
def test_a_resolved_recipe_builds_the_same_files(repo: Repo, keys: dict[str, Any]) -> None:
    repo.clip(count=4, height=40)
    recipe = repo.recipe(**keys)
    before = repo.built(recipe)
    recipe.write_text(repo.run("check", recipe, "--resolved").out)
    after = repo.built(recipe, "--force")
    manifests = (before.pop("fire.manifest.json"), after.pop("fire.manifest.json"))
    assert all(manifests) and after == before == {
        name: data for name, data in contents(repo.build).items() if name in before
    }
