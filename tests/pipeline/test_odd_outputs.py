"""Files of a build that were edited, damaged or made up: ``inspect`` and ``preview`` say which."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.support.repo import Ran, Repo

Edit = Callable[[Any], None]


@pytest.fixture
def build(repo: Repo) -> Path:
    """Return the folder of a build with maps and tracks."""
    repo.clip()
    repo.built(repo.recipe(maps={"motion": "godot"}))
    return repo.build


def set_to(value: Any, *path: str) -> Edit:
    """Return what sets the value at ``path`` of a document; ``*`` is the first key."""

    def edit(document: Any) -> None:
        *way, last = path
        for key in way:
            document = next(iter(document.values())) if key == "*" else document[key]
        document[last] = value

    return edit


def looked_at(repo: Repo, atlas: Path) -> list[Ran]:
    """Look at an atlas in each way that reads its pages and its tracks."""
    ways: tuple[list[str | Path], ...] = (
        ["inspect", atlas],
        ["preview", atlas],
        ["preview", atlas, "--sheet"],
    )
    return [repo.run(*way) for way in ways]


def assert_refused(repo: Repo, atlas: Path, edited: Path, edit: Edit) -> None:
    document = json.loads(edited.read_bytes())
    edit(document)
    edited.write_text(json.dumps(document), encoding="utf-8")
    before = {path.name for path in atlas.parent.iterdir()}
    for ran in looked_at(repo, atlas):
        assert ran.code == 1 and "bug in fire-atlas" not in ran.err, ran
        assert str(edited) in ran.err and "fire-atlas wrote" in ran.err
    assert {path.name for path in atlas.parent.iterdir()} == before


@pytest.mark.parametrize(
    "edit",
    [
        set_to(-4, "frames", "*", "frame", "w"),
        set_to(2**40, "frames", "*", "sourceSize", "h"),
        set_to(-1, "meta", "size", "w"),
        set_to("64", "meta", "size", "h"),
        set_to(1e9, "frames", "*", "duration"),
        set_to(float("nan"), "frames", "*", "duration"),
        set_to(1e300, "frames", "*", "anchor", "x"),
        set_to("a\ud800.png", "meta", "image"),
        set_to("a\0.png", "meta", "image"),
        set_to({"\ud800": ["fire/0000"]}, "animations"),
        set_to("half", "meta", "fireAtlas", "alpha"),
        set_to(["srgb"], "meta", "fireAtlas", "blendSpace"),
        set_to(1e-200, "meta", "fireAtlas", "fps"),
        lambda document: document["meta"].pop("fireAtlas"),
        lambda document: document["meta"]["maps"][0].pop("strength"),
        lambda document: document["meta"]["maps"][0].update(scale=1e300),
    ],
)
def test_an_atlas_of_values_that_no_build_writes_is_refused(
    repo: Repo, build: Path, edit: Edit
) -> None:
    assert_refused(repo, build / "fire.json", build / "fire.json", edit)


@pytest.mark.parametrize(
    "edit",
    [
        set_to("12", "fps"), set_to(0, "fps"), set_to(1e308, "fps"), set_to([[80], 64], "size"),
        set_to([-64, 80], "size"), set_to([10**9, 80], "size"), set_to("\ud800", "seed"),
        lambda document: document.pop("columns"),
        lambda document: next(f for f in document["frames"] if f["rows"])["rows"][0].insert(5, -1),
    ],
)  # fmt: skip
def test_tracks_of_values_that_no_build_writes_are_refused(
    repo: Repo, build: Path, edit: Edit
) -> None:
    assert_refused(repo, build / "fire.json", build / "fire.flakes.json", edit)


def test_a_page_whose_header_is_cut_short_is_refused(repo: Repo, build: Path) -> None:
    page = build / "fire.png"
    page.write_bytes(page.read_bytes()[:11] + b"\5" + page.read_bytes()[12:])  # the length of IHDR
    for ran in looked_at(repo, build / "fire.json"):
        assert "bug in fire-atlas" not in ran.err
        assert ran.code == 0 or f"{page}: " in ran.err


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "a\nb", "x\x1b[2J"])
def test_a_manifest_that_names_what_no_file_is_called_is_not_valid(
    repo: Repo, build: Path, name: str
) -> None:
    manifest = build / "fire.manifest.json"
    document = json.loads(manifest.read_bytes())
    document["outputs"][0]["path"] = name
    manifest.write_text(json.dumps(document), encoding="utf-8")
    plan = repo.run("build", repo.folder / "fire.yaml", "--dry-run")
    assert plan.code == 0 and "holds no valid fire.manifest.json" in plan.out
    assert repo.run("clean", repo.folder / "fire.yaml").code == 1
    shown = repo.run("inspect", build / "fire.json")
    assert shown.code == 1 and "is not a manifest that fire-atlas wrote" in shown.err
    assert "\x1b" not in shown.err and "\0" not in shown.err
