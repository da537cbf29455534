"""The functions of the package, called from Python."""

import doctest
from pathlib import Path

import pytest

import fire_atlas
from fire_atlas import api
from fire_atlas.cli import main
from tests.support.repo import Repo, contents


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    repo = Repo(tmp_path / "repo")
    repo.clip()
    return repo


@pytest.mark.slow
def test_the_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "campfire"]) == 0
    assert doctest.testmod(api) == (0, 10)


def test_build_writes_what_the_command_writes(repo: Repo) -> None:
    recipe = repo.recipe(flakes={"rate": 50})
    by_command = repo.built(recipe)
    outcome = fire_atlas.build(recipe, repo.folder / "python", jobs=1)
    assert contents(repo.folder / "python") == by_command
    assert {path.name for path in outcome.files} == set(by_command) and not outcome.fresh
    again = fire_atlas.build(recipe, repo.folder / "python")
    assert again.fresh and sorted(again.files) == sorted(outcome.files)
    assert again.statistics == outcome.statistics


def test_check_returns_notes_and_raises_what_a_build_would_be_refused_for(repo: Repo) -> None:
    assert fire_atlas.check(repo.recipe()) == ()
    recipe = repo.recipe(timeline={"loop": "pingpong", "frames": 80})
    with pytest.raises(fire_atlas.RecipeError, match=r"fire\.yaml:1: timeline\.frames: asks for"):
        fire_atlas.check(recipe)
    with pytest.raises(fire_atlas.SourceError, match=r"--set source\.path: .*does not exist"):
        fire_atlas.check(recipe, overrides=["source.path=gone"])


def test_load_recipe_fills_in_the_defaults(repo: Repo) -> None:
    loaded = fire_atlas.load_recipe(repo.recipe(), overrides=["seed=7"])
    assert (loaded.recipe.seed, loaded.recipe.name, loaded.recipe.atlas.padding) == (7, "fire", 2)


def test_inspect_atlas_and_inspect_json_say_the_same(repo: Repo) -> None:
    import json

    repo.built(repo.recipe(flakes={"rate": 50}))
    atlas = repo.build / "fire.json"
    stated = json.loads(repo.run("inspect", atlas, "--json").out)
    found = fire_atlas.inspect_atlas(atlas)
    assert stated == json.loads(json.dumps(found.as_json(), default=list))
    assert [page["file"] for page in stated["pages"]] == ["fire.png"]
    assert stated["animations"][0]["frames"] == found.animations[0].frames == 6


def test_write_preview_replaces_its_own_file_alone(repo: Repo, tmp_path: Path) -> None:
    repo.built(repo.recipe(flakes="none"))
    atlas, target = repo.build / "fire.json", tmp_path / "fire.gif"
    fire_atlas.write_preview(atlas, target, kind="gif")
    first = target.read_bytes()
    fire_atlas.write_preview(atlas, target, kind="gif", background="white")
    assert target.read_bytes() != first
    target.write_bytes(b"GIF89a mine")
    with pytest.raises(fire_atlas.OutputError, match=r"fire\.gif"):
        fire_atlas.write_preview(atlas, target, kind="gif")
    fire_atlas.write_preview(atlas, target, kind="gif", overwrite=True)


def test_every_public_name_exists_and_has_a_docstring() -> None:
    for name in fire_atlas.__all__:
        assert getattr(fire_atlas, name).__doc__, name
    assert set(fire_atlas.__all__) <= set(dir(fire_atlas))
    with pytest.raises(AttributeError, match="no attribute 'bulid'"):
        getattr(fire_atlas, "bulid")  # noqa: B009
