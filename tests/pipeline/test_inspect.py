"""``inspect``: flakes beside filmed embers, where there are tracks to measure them in."""

from pathlib import Path
from typing import Any

import pytest

from fire_atlas.effect.flakes.filmed import ROWS
from tests.support.repo import Repo

TITLE = "flakes beside filmed embers"


def inspected(repo: Repo, **recipe: Any) -> str:
    repo.clip()
    repo.built(repo.recipe(**recipe))
    return repo.run("inspect", repo.build / "fire.json").out


def test_inspect_has_flakes_beside_filmed_embers(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    repo.clip(count=24)
    repo.built(repo.recipe(flakes={"rate": 200}, tracks=["json"]))
    said = repo.run("inspect", repo.build / "fire.json").out
    table = said[said.index(TITLE) :]
    assert all(f"  {row.label} " in table for rows in ROWS.values() for row in rows.values())
    rise = next(line for line in table.splitlines() if "fly up" in line).split()
    assert rise[3:9] == ["0.79", "to", "1", "at", "most", "0.88"], rise
    assert (rise[9:] == ["outside"]) == (float(rise[2]) > 0.88)
    assert max(map(len, table.splitlines())) <= 80


def test_what_is_brighter_is_brighter_in_the_table(repo: Repo) -> None:
    repo.clip()
    peaks = []
    for intensity in (0.2, 2.0):
        recipe = repo.recipe(flakes={"rate": 200, "intensity": intensity}, tracks=["json"])
        repo.built(recipe)
        said = repo.run("inspect", repo.build / "fire.json").out
        line = next(line for line in said.splitlines() if "peak, median" in line)
        peaks.append(float(line.split()[2]))
    assert peaks[1] > 1.5 * peaks[0]


def test_without_tracks_inspect_says_what_they_are_for(repo: Repo) -> None:
    said = inspected(repo, flakes={"rate": 200}, tracks=[])
    assert TITLE not in said
    assert "in all" in said and "tracks: [json]" in said


def test_the_class_of_the_fire_is_said(repo: Repo) -> None:
    said = inspected(repo, flakes={"class": "wall"})
    assert "at a time; class: wall" in said


def test_without_flakes_nothing_is_said_of_them(repo: Repo) -> None:
    assert "flakes" not in inspected(repo, flakes="none", motion_blur="none")


def test_square_flakes_have_no_filmed_ranges(repo: Repo) -> None:
    said = inspected(repo, flakes={"rate": 200, "sprite": "pixel"}, tracks=["json"])
    assert "speed, median" in said and TITLE not in said


def test_an_atlas_without_its_manifest_is_described(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(tracks=["json"]))
    Path(repo.build / "fire.manifest.json").unlink()
    ran = repo.run("inspect", repo.build / "fire.json")
    assert ran.code == 0 and TITLE in ran.out
