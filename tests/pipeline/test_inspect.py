"""``inspect``: what it says of flakes, with tracks and without."""

import re
from pathlib import Path
from typing import Any

import pytest

from tests.support.repo import Repo


def inspected(repo: Repo, **recipe: Any) -> str:
    repo.clip()
    repo.built(repo.recipe(**recipe))
    return repo.run("inspect", repo.build / "fire.json", "--flakes").out


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
    assert inspected(repo, flakes="none", motion_blur="none") == "flakes: none\n"


def test_an_atlas_without_its_manifest_is_described(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(tracks=["json"]))
    Path(repo.build / "fire.manifest.json").unlink()
    ran = repo.run("inspect", repo.build / "fire.json", "--flakes")
    assert ran.code == 0 and "speed, median" in ran.out


def test_a_summary_has_ten_to_twenty_plain_lines(repo: Repo) -> None:
    repo.clip()
    atlas = {"layout": "grid", "max_size": 128}
    maps = {"motion": "unity", "flame": True, "flakes": True, "haze": True}
    repo.built(repo.recipe(atlas=atlas, maps=maps, flakes={"rate": 90}))
    lines = repo.run("inspect", repo.build / "fire.json").out.splitlines()
    assert 10 <= len(lines) <= 20
    assert all(line.isprintable() and "│" not in line for line in lines)
    said = "\n".join(lines)
    pages = len(list(repo.build.glob("fire*.png"))) // 5
    assert lines[0] == f"fire.json: 6 frames, 0.25 s, 1 animation, {pages} pages"
    for label in ("pages", "memory", "frames", "overdraw", "maps", "details"):
        assert re.search(f"^{label} ", said, re.M), label


def test_no_name_is_broken_however_narrow_the_terminal(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    repo.clip()
    name = "a_name_that_is_far_longer_than_any_terminal_is_wide_" * 2
    repo.built(repo.recipe(name=name[:90], flakes="none", motion_blur="none"))
    for details in ([], ["--pages", "--memory", "--frames", "--overdraw"]):
        said = repo.run("inspect", repo.build / f"{name[:90]}.json", *details).out
        assert f"{name[:90]}.png" in said


def test_details_come_in_the_order_they_are_named_in(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(flakes="none", motion_blur="none"))
    said = repo.run("inspect", repo.build / "fire.json", "--frames", "--pages").out
    assert said.index("animation") < said.index("occupancy")
    assert "overdraw" not in said
