"""Loading: names, paths, every default, and folders of recipes."""

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.find import find_recipes, refuse_same_outputs
from fire_atlas.recipe.load import load_tree, resolved_yaml
from fire_atlas.recipe.tree import read_tree

Write = Callable[..., Path]
SOURCE = "source: {path: clips/fire.gif}\n"


def test_the_name_is_the_stem_of_the_recipe_unless_it_is_given(write: Write) -> None:
    assert load_tree(read_tree(write(SOURCE, "torch.v2.yaml"))).recipe.name == "torch.v2"
    assert load_tree(read_tree(write(SOURCE + "name: hearth"))).recipe.name == "hearth"
    assert load_tree(read_tree(write(SOURCE), ["name=hearth"])).recipe.name == "hearth"


def test_a_stem_that_is_no_good_name_is_refused_with_a_better_one(write: Write) -> None:
    with pytest.raises(RecipeError, match=r"add a line `name: my_camp_fire`"):
        load_tree(read_tree(write(SOURCE, "my camp fire!.yaml")))


def test_the_source_is_found_beside_the_recipe(write: Write, tmp_path: Path) -> None:
    loaded = load_tree(read_tree(write(SOURCE, "game/campfire.yaml")))
    assert loaded.source_files[("source", "path")] == (tmp_path / "game/clips/fire.gif").resolve()
    assert loaded.base == tmp_path / "game"


def test_the_resolved_recipe_builds_the_same(write: Write) -> None:
    write(SOURCE + "flakes: {rate: 7, life: [1, 2]}", "studio/base.yaml")
    loaded = load_tree(read_tree(write("extends: studio/base.yaml\nmotion_blur: off\nseed: 5")))
    text = resolved_yaml(loaded)
    again = load_tree(read_tree(write(text, "campfire.yaml")))
    assert again.recipe.model_dump(exclude={"source"}) == loaded.recipe.model_dump(
        exclude={"source"}
    )
    assert again.source_files[("source", "path")] == loaded.source_files[("source", "path")]


def test_the_resolved_recipe_has_every_key_in_model_order(write: Write) -> None:
    loaded = load_tree(read_tree(write(SOURCE)))
    values = yaml.safe_load(resolved_yaml(loaded))
    assert list(values) == list(type(loaded.recipe).model_fields)
    assert list(values["flakes"])[:3] == ["class", "style", "bake"]
    assert values["features"]["sigma"] == [1.0, 1.6]


def test_a_folder_stands_for_its_recipes_in_natural_order(write: Write, tmp_path: Path) -> None:
    for name in ("fire10.yaml", "fire2.yml", "Fire1.yaml", "fire3.fire"):
        write(SOURCE, name)
    write("services: {web: 1}", "docker-compose.yaml")
    write("extends: torch", "child.yaml")
    write(SOURCE, ".hidden.yaml")
    write(SOURCE, "notes.txt")
    write("source: [", "zz-broken.yaml")
    names = [path.name for path in find_recipes([tmp_path])]
    in_order = ["child.yaml", "Fire1.yaml", "fire2.yml", "fire3.fire", "fire10.yaml"]
    assert names == [*in_order, "zz-broken.yaml"]


@pytest.mark.parametrize("ending", ["yaml", "yml", "fire"])
def test_a_recipe_may_have_any_of_three_endings(write: Write, ending: str) -> None:
    write(SOURCE + "seed: 7", f"base.{ending}")
    tree = read_tree(write(f"extends: base.{ending}", f"torch.{ending}"))
    assert tree.name == "torch" and tree.values["seed"] == 7


def test_of_one_stem_a_folder_has_one_recipe(write: Write, tmp_path: Path) -> None:
    write(SOURCE, "torch.yaml")
    write(SOURCE, "torch.fire")
    trees = [read_tree(path) for path in find_recipes([tmp_path])]
    with pytest.raises(RecipeError, match=r"would write the same files .* another `name`"):
        refuse_same_outputs(trees, lambda tree: tree.path.parent / "build")


def test_a_recipe_named_twice_is_built_once(write: Write, tmp_path: Path) -> None:
    path = write(SOURCE)
    assert find_recipes([path, tmp_path]) == [path]


def test_a_folder_without_recipes_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match="no recipe in this folder"):
        find_recipes([tmp_path])


def test_two_recipes_cannot_write_the_same_files(write: Write) -> None:
    trees = [read_tree(write(SOURCE, "A.yaml")), read_tree(write(SOURCE + "name: a", "b.yaml"))]
    with pytest.raises(RecipeError, match=r"b\.yaml: would write the same files .* as .*A\.yaml"):
        refuse_same_outputs(trees, lambda tree: tree.path.parent / "build")
    refuse_same_outputs(trees, lambda tree: tree.path.parent / tree.path.stem)
