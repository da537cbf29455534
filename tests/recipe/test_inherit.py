"""``extends`` and ``--set``: layers of a recipe."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe import inherit
from fire_atlas.recipe.tree import RecipeTree, read_tree

Write = Callable[..., Path]


@pytest.fixture
def presets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "shipped" / "recipes"
    folder.mkdir(parents=True)
    monkeypatch.setattr(inherit, "shipped", lambda kind: folder.parent / kind)
    return folder


def refusal(path: Path, *overrides: str) -> str:
    with pytest.raises(RecipeError) as caught:
        read_tree(path, overrides)
    return str(caught.value)


def origin(tree: RecipeTree, key: str) -> tuple[str | None, int]:
    found = tree.origin(tuple(key.split(".")))
    return (found.file.name if found.file else None), found.line


def test_blocks_merge_key_by_key_and_all_else_replaces(write: Write) -> None:
    write("source: {path: a}\nflakes:\n  rate: 1\n  life: [1, 2]\nexports: [json]\n", "base.yaml")
    path = write("extends: base.yaml\nflakes:\n  life: [3]\nexports: []\n")
    tree = read_tree(path)
    assert tree.values == {
        "source": {"path": "a"},
        "flakes": {"rate": 1, "life": [3]},
        "exports": [],
    }
    assert [file.name for file in tree.files] == ["campfire.yaml", "base.yaml"]


def test_each_key_remembers_the_file_that_stated_it(write: Write) -> None:
    write("source: {path: a}\nflakes:\n  rate: 1\n  life: [1, 2]\n", "base.yaml")
    tree = read_tree(write("extends: base.yaml\nflakes:\n  life: [3]\n"), ["flakes.rate=5"])
    assert origin(tree, "source.path") == ("base.yaml", 1)
    assert origin(tree, "flakes.life") == ("campfire.yaml", 3)
    assert origin(tree, "flakes.rate") == (None, 0)
    assert ("flakes", "life", 1) not in tree.origins


def test_a_block_can_be_replaced_by_a_word_and_back(write: Write) -> None:
    write("source: {path: a}\nflakes: {rate: 1}\n", "one.yaml")
    write("extends: one.yaml\nflakes: none\n", "two.yaml")
    assert read_tree(write("extends: two.yaml")).values["flakes"] == "none"
    back = read_tree(write("extends: two.yaml\nflakes: {max: 3}"))
    assert back.values["flakes"] == {"max": 3}


def test_paths_are_relative_to_the_file_that_states_them(write: Write, tmp_path: Path) -> None:
    write("source: {path: ../clips/fire.gif}", "studio/base.yaml")
    tree = read_tree(write("extends: ../studio/base.yaml", "game/campfire.yaml"))
    path = tree.file_at(("source", "path"), "../clips/fire.gif")
    assert path == (tmp_path / "clips" / "fire.gif").resolve()


def test_a_path_of_set_is_relative_to_the_recipe(write: Write, tmp_path: Path) -> None:
    write("source: {path: x}", "studio/base.yaml")
    recipe = write("extends: ../studio/base.yaml", "game/campfire.yaml")
    tree = read_tree(recipe, ["source.path=mine.gif"])
    assert tree.file_at(("source", "path"), "mine.gif") == (tmp_path / "game/mine.gif").resolve()


def test_a_preset_is_found_by_name(write: Write, presets: Path) -> None:
    (presets / "torch.yaml").write_text("source: {path: ../samples/torch.gif}\nseed: 3\n")
    tree = read_tree(write("extends: torch\nseed: 4"))
    assert tree.values["seed"] == 4
    assert tree.file_at(("source", "path"), "../samples/torch.gif").name == "torch.gif"


def test_a_misspelt_preset_is_guessed(write: Write, presets: Path) -> None:
    (presets / "torch.yaml").write_text("source: {path: x}")
    path = write("seed: 1\nextends: torhc")
    assert refusal(path) == f"{path}:2: extends: there is no preset torhc; did you mean torch?"


def test_a_file_named_like_a_preset_is_pointed_out(write: Write, presets: Path) -> None:
    write("source: {path: x}", "mine.yaml")
    assert "did you mean the file ./mine.yaml?" in refusal(write("extends: mine"))


def test_a_recipe_that_extends_a_misspelt_name_of_its_own_is_not_sent_to_itself(
    write: Write, presets: Path
) -> None:
    (presets / "torch.yaml").write_text("source: {path: x}")
    assert "; did you mean torch?" in refusal(write("extends: torhc", "torhc.yaml"))


@pytest.mark.parametrize("file", ["mine.yaml", "paper.yaml"])
def test_the_paper_is_no_preset_but_keys(write: Write, file: str) -> None:
    path = write("seed: 1\nextends: paper", file)
    assert refusal(path) == (
        f"{path}:2: extends: there is no preset paper; write `features: {{preset: paper}}` and "
        f"`atlas: {{alpha: premultiplied}}` in your recipe instead, or copy the whole one from "
        f"docs/papers.md"
    )


def test_a_circle_is_spelt_out(write: Write) -> None:
    write("extends: ./c.yaml", "b.yaml")
    write("# c\nextends: ./a.yaml", "c.yaml")
    refused = refusal(write("extends: b.yaml", "a.yaml"))
    assert (
        "c.yaml:2: extends: goes round in a circle (a.yaml -> b.yaml -> c.yaml -> a.yaml)"
        in refused
    )


def test_a_row_of_51_recipes_is_followed_and_one_more_refused(write: Write) -> None:
    write("source: {path: x}\nseed: 7", "r0.yaml")
    for i in range(1, 52):
        write(f"extends: ./r{i - 1}.yaml", f"r{i}.yaml")
    folder = write("extends: ./r49.yaml").parent
    assert read_tree(folder / "campfire.yaml").value(("seed",)) == 7
    assert refusal(folder / "r51.yaml").endswith(
        "r1.yaml:1: extends: is number 51 in a row of recipes that extend each other, and at most "
        "50 are followed; write some of them into one file"
    )


def test_a_recipe_that_extends_itself_is_refused(write: Write) -> None:
    assert "(campfire.yaml -> campfire.yaml)" in refusal(write("extends: campfire.yaml"))


@pytest.mark.parametrize("value", ["3", "[a]", "''", '"a\\0b"'])
def test_extends_must_be_a_name(write: Write, value: str) -> None:
    assert "extends: must be the name of a preset" in refusal(write(f"extends: {value}"))


def test_a_missing_base_is_named(write: Write) -> None:
    assert "there is no recipe file" in refusal(write("extends: ./none.yaml"))


@pytest.mark.parametrize(
    ("override", "values"),
    [
        ("flakes.rate=80", {"flakes": {"rate": 80, "max": 5}}),
        ("flakes=none", {"flakes": "none"}),
        ("flakes=off", {"flakes": False}),
        ("exports=[json]", {"flakes": {"max": 5}, "exports": ["json"]}),
        ("a.b.c={d: 1}", {"flakes": {"max": 5}, "a": {"b": {"c": {"d": 1}}}}),
        ("name=a=b", {"flakes": {"max": 5}, "name": "a=b"}),
    ],
)
def test_set_changes_one_key(write: Write, override: str, values: dict[str, object]) -> None:
    assert read_tree(write("flakes: {max: 5}"), [override]).values == values


def test_of_two_sets_the_later_wins(write: Write) -> None:
    assert read_tree(write("seed: 1"), ["seed=2", "seed=3"]).values == {"seed": 3}


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("flakes.rate", "--set flakes.rate: must be key=value"),
        ("=3", "--set =3: must be key=value"),
        ("flakes..rate=3", "--set flakes..rate=3: must be key=value"),
        ("flakes.rate=", "--set flakes.rate: has no value"),
        ("flakes.rate=[1", "--set flakes.rate: is no valid YAML"),
        ("flakes.rate=!!set {a}", "--set flakes.rate: the tag !!set has no meaning"),
        ("a=\udcff", "--set a: the value is not UTF-8"),
    ],
)
def test_a_bad_set_is_refused_by_its_name(write: Write, override: str, message: str) -> None:
    assert refusal(write("seed: 1"), override).startswith(message)
