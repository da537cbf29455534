"""``inspect``: what it says of flakes, with tracks and without."""

from pathlib import Path
from typing import Any

from tests.support.repo import Repo


def inspected(repo: Repo, **recipe: Any) -> str:
    repo.clip()
    repo.built(repo.recipe(**recipe))
    return repo.run("inspect", repo.build / "fire.json").out


def test_flakes_have_their_figures(repo: Repo) -> None:
    said = inspected(repo, flakes={"rate": 200}, tracks=["json"])
    assert "speed, median" in said and "should be" in said


def test_without_tracks_inspect_says_what_they_are_for(repo: Repo) -> None:
    said = inspected(repo, flakes={"rate": 200}, tracks=[])
    assert "speed, median" not in said
    assert "in all" in said and "tracks: [json]" in said


def test_the_class_of_the_fire_is_said(repo: Repo) -> None:
    said = inspected(repo, flakes={"class": "wall"})
    assert "at a time; class: wall" in said


def test_without_flakes_nothing_is_said_of_them(repo: Repo) -> None:
    assert "flakes" not in inspected(repo, flakes="none", motion_blur="none")


def test_an_atlas_without_its_manifest_is_described(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(tracks=["json"]))
    Path(repo.build / "fire.manifest.json").unlink()
    ran = repo.run("inspect", repo.build / "fire.json")
    assert ran.code == 0 and "speed, median" in ran.out
