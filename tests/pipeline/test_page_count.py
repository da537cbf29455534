"""``atlas.max_pages`` and ``atlas.grid``, and what a build says would make one page enough."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.sources.test_framing import film
from tests.support.clips import real
from tests.support.repo import Repo, pages

PACKED = {"max_size": 150}
SETTINGS = [
    PACKED,
    {"max_size": 150, "layout": "grid"},
    {"max_size": 256, "layout": "grid", "grid": {"columns": 2, "rows": 2}},
    {"max_size": 200, "trim": "none", "multiple_of": 4},
    {"max_size": 180, "gpu": ["bc7.dds"], "mips": 2},
]


def count_of(repo: Repo, name: str = "fire") -> int:
    manifest = json.loads((repo.build / f"{name}.manifest.json").read_bytes())
    return len(manifest["statistics"]["pages"])


def advised(said: str, enough: str) -> list[list[str]]:
    """What a build says to set, each as ``--set`` takes it: ``[["source.height=48"], ...]``."""
    keys = r"[a-z_.]+(?: and [a-z_.]+)*"
    change = rf"[a-z_.]+: \w+(?: and [a-z_.]+: \w+)*(?: \(without {keys}\))?"
    found = re.search(rf"{enough} with ({change}(?:(?:, | or ){change})*)", " ".join(said.split()))
    assert found, said
    choices = []
    for each in re.split(r", | or ", found[1]):
        changes, _, without = each.strip(")").partition(" (without ")
        removed = [f"{key}=~" for key in without.split(" and ") if key]
        choices.append([pair.replace(": ", "=") for pair in changes.split(" and ")] + removed)
    return choices


@pytest.mark.parametrize(("width", "is_noted"), [(4096, False), (4100, True)])
def test_pages_that_many_phones_cannot_load_are_noted(
    width: int, is_noted: bool, tmp_path: Path
) -> None:
    repo = Repo(tmp_path / "repo")
    Image.new("RGBA", (width, 4), "orange").save(repo.folder / "bar.png")
    recipe = repo.folder / "fire.yaml"
    recipe.write_text("source: {kind: sprites, path: bar.png}\natlas: {max_size: 8192}")
    ran = repo.run("build", recipe)
    assert ran.code == 0
    noted = "4100x4 px are more than many phones load, 4096 px a side: atlas.max_size: 4096"
    assert (noted in " ".join(ran.err.split())) is is_noted


@pytest.mark.parametrize("atlas", SETTINGS, ids=str)
def test_each_change_that_is_advised_makes_one_page_enough(
    atlas: dict[str, Any], repo: Repo
) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(atlas=atlas)
    ran = repo.run("build", recipe)
    assert ran.code == 0 and count_of(repo) > 1
    choices = advised(ran.err, "one is enough")
    assert {pairs[0].partition("=")[0] for pairs in choices} >= (
        {"timeline.frames"} if "grid" in atlas else {"source.height", "timeline.frames"}
    )
    for pairs in choices:
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) == 1, pairs


def test_what_is_advised_for_generated_fire_holds_as_it_becomes_another_fire(repo: Repo) -> None:
    source = {"kind": "silk", "width": 64, "height": 96, "rows": 8, "columns": 6}
    keys: dict[str, Any] = {"source": source, "timeline": {"frames": 6}, "tracks": []}
    recipe = repo.recipe(**keys, atlas={"max_size": 160})
    choices = advised(repo.run("build", recipe).err, "one is enough")
    assert [pair.partition("=")[0] for pair in choices[0]] == ["source.height", "source.width"]
    for pairs in choices:
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) == 1, pairs


SHEETS = {"kind": "silk", "aspect": 0.5, "rows": 8, "columns": 6, "sheets": {"count": 2}}
LEARNT = {"kind": "profile", "path": "clip"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "size", "max_size", "first"),
    [
        (SHEETS, "hero", 1024, ["source.size=game"]),
        (SHEETS, "hero", 600, ["source.size=draft"]),
        (
            SHEETS,
            "draft",
            300,
            ["source.height=", "source.width=", "source.size=~", "source.aspect=~"],
        ),
        (LEARNT, "game", 640, ["source.size=draft"]),
        (LEARNT, "draft", 200, ["source.height=", "source.size=~"]),
    ],
)
def test_of_fire_with_a_size_a_smaller_one_is_advised_or_the_sides_in_its_place(
    source: dict[str, Any], size: str, max_size: int, first: list[str], repo: Repo
) -> None:
    repo.clip(count=8)
    keys: dict[str, Any] = {"flakes": "none", "tracks": []}
    keys["timeline"] = {"frames": 4 if source is SHEETS else 6}
    atlas = {"max_size": max_size, "trim": "none"}
    recipe = repo.recipe(source={**source, "size": size}, **keys, atlas=atlas)
    choices = advised(repo.run("build", recipe).err, "one is enough")
    for wanted, pair in zip(first, choices[0], strict=True):
        assert pair.startswith(wanted), choices
    for pairs in choices:
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) == 1, pairs


def test_a_large_video_is_as_high_as_it_is_with_each_change_that_is_advised(repo: Repo) -> None:
    film(repo.folder / "tall.mp4", 24)
    keys: dict[str, Any] = {"flakes": "none", "motion_blur": "none", "timeline": {"loop": "none"}}
    recipe = repo.recipe(path="tall.mp4", atlas={"max_size": 1024, "trim": "none"}, **keys)
    choices = advised(repo.run("build", recipe).err, "one is enough")
    assert "source.height=256" in choices[1] and "source.height=256" in choices[2]
    for pairs in choices:
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) == 1, pairs


def test_more_pages_than_allowed_are_an_error_and_what_is_advised_makes_them_few_enough(
    repo: Repo,
) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(atlas={**PACKED, "max_pages": 2})
    assert "enough with" not in repo.run("build", recipe).err
    recipe = repo.recipe(atlas={**PACKED, "max_size": 100, "max_pages": 2})
    refused = repo.run("build", recipe, "--out", repo.folder / "other")
    assert refused.code == 1 and not (repo.folder / "other/fire.png").exists()
    assert re.match(r"error: \S*fire.yaml:1: atlas.max_pages: the build needs \d pages; 2 are",
                    refused.err.splitlines()[-1])  # fmt: skip
    for pairs in advised(refused.err, "2 are enough"):
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) <= 2, pairs
    assert "enough with" not in repo.run("build", recipe, "--set", "atlas.max_pages=9").err


def test_a_grid_has_the_cells_that_are_asked_for_and_says_how_many_stay_empty(repo: Repo) -> None:
    repo.clip(count=6)
    keys = {"layout": "grid", "grid": {"columns": 4, "rows": 3}}
    ran = repo.run("build", repo.recipe(atlas=keys, timeline={"loop": "none"}))
    assert "atlas.grid: 6 of 12 cells stay empty" in ran.err
    ((page, image),) = pages(repo.build, "fire")
    grid = page["meta"]["fireAtlas"]["grid"]
    assert (grid["columns"], grid["rows"]) == (4, 3)
    height, width = image.shape[0] // 3, image.shape[1] // 4
    assert (4 * width, 3 * height) == (image.shape[1], image.shape[0])
    seen = [
        bool(image[r * height : (r + 1) * height, c * width : (c + 1) * width, 3].any())
        for r in range(3)
        for c in range(4)
    ]
    assert seen == [True] * 6 + [False] * 6
    whole = repo.run("build", repo.folder / "fire.yaml", "--set", "atlas.grid.rows=2", "--set",
                     "atlas.grid.columns=3")  # fmt: skip
    assert whole.code == 0 and "stay empty" not in whole.err


def test_a_grid_too_large_for_a_page_is_refused_with_sizes_that_fit(repo: Repo) -> None:
    repo.clip(count=6)
    keys = {"layout": "grid", "grid": {"columns": 4, "rows": 4}, "max_size": 200}
    refused = repo.run("build", recipe := repo.recipe(atlas=keys))
    assert refused.code == 1
    found = re.search(r"max_size` to (\d+), ask .* (\d+) % as high", refused.err)
    assert found, refused.err
    repo.built(recipe, "--set", f"atlas.max_size={found[1]}")
    repo.built(recipe, "--set", f"source.height={80 * int(found[2]) // 100}")


@pytest.mark.parametrize(
    ("atlas", "key"),
    [
        ({"grid": {"columns": 4, "rows": 4}}, "atlas.grid"),
        ({"layout": "grid", "grid": {"columns": 4}}, "atlas.grid.rows"),
        ({"layout": "grid", "pot": True, "grid": {"columns": 6, "rows": 4}}, "atlas.grid.columns"),
        ({"max_pages": 0}, "atlas.max_pages"),
        ({"max_pages": "one"}, "atlas.max_pages"),
    ],
)
def test_what_contradicts_itself_is_refused_by_check(
    atlas: dict[str, Any], key: str, repo: Repo
) -> None:
    ran = repo.run("check", repo.recipe(atlas=atlas))
    assert ran.code == 2 and f"fire.yaml:1: {key}" in ran.err


def test_a_height_above_that_of_the_footage_is_noted(repo: Repo) -> None:
    repo.clip(count=3)
    keys = {"flakes": "none", "motion_blur": "none"}
    for height, sampling, is_noted in (
        (80, "smooth", False), (81, "smooth", True), (160, "nearest", False),
        (161, "nearest", True),
    ):  # fmt: skip
        source = {"path": "clip", "height": height, "sampling": sampling}
        ran = repo.run("build", repo.recipe(source=source, **keys))
        assert (f"source.height: {height} enlarges frames that are 80 px high" in ran.err) == (
            is_noted
        )


@pytest.mark.parametrize("clip", [real("cartoon_fluent_fire"), real("real_candle_red")])
@pytest.mark.parametrize("layout", ["packed", "grid"])
def test_what_is_advised_for_real_clips_holds(
    clips: Path, repo: Repo, clip: str, layout: str
) -> None:
    source = {"path": str(clips / clip / "frames"), "height": 96, "count": 24}
    recipe = repo.recipe(source=source, atlas={"max_size": 200, "layout": layout})
    ran = repo.run("build", recipe)
    for pairs in advised(ran.err, "one is enough"):
        changes = [argument for pair in pairs for argument in ("--set", pair)]
        repo.built(recipe, *changes)
        assert count_of(repo) == 1, pairs
