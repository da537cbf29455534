"""The page shows how a fire is analysed: marks over its frames, drawn by the browser."""

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.context import BuildContext
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.pipeline.animation.show_field import field_marks
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.preview.field_data import FieldData
from fire_atlas.preview.field_marks import LAYERS, SHORTEST, FieldMarks, MarkGrid, sizes_of
from fire_atlas.recipe.output import MAX_PAGE_SIDE
from fire_atlas.recipe.tree import read_tree
from tests.preview.browser import Browser, assert_quiet, built, picture

KEYS = {
    "source": {"path": str(shipped("samples") / "campfire"), "count": 4, "height": 64},
    "timeline": {"loop": "none"},
    "maps": {"flame": True, "flakes": True},
}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recipe = tmp_path_factory.mktemp("field") / "fire.yaml"
    recipe.write_text(json.dumps(KEYS), encoding="utf-8")
    assert main(["preview", "--field", str(recipe), "-q"]) == 0
    return recipe.parent / "build" / "fire.preview.html"


@pytest.fixture(scope="module")
def marks(page: Path) -> FieldMarks:
    with Workers(1) as workers:
        loaded = load_checked(read_tree(page.parents[1] / "fire.yaml"))
        (seen,) = field_marks(loaded, BuildContext.silent(workers)).values()
    return seen


def held(page: Path, name: str) -> str:
    found = re.search(rf' id="{name}">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)
    assert found
    return found[1]


def test_the_page_holds_the_marks_of_every_frame(page: Path, marks: FieldMarks) -> None:
    field = json.loads(held(page, "data"))["animations"][0]["field"]
    rows = np.frombuffer(base64.b64decode(held(page, "field-0")), "<i2").reshape(-1, 4)
    places, longest = field["units"]
    assert list(field["layers"]) == list(LAYERS)
    for layer, drawn in field["layers"].items():
        for count, frame in zip(drawn["counts"], marks.frames, strict=True):
            mine, rows = rows[:count], rows[count:]
            size = sizes_of(frame[layer]) / marks.longest[layer]
            if layer != "candidates":
                size = size[size >= SHORTEST]
            expected = np.sort(np.minimum(size, 1.0))
            assert np.allclose(np.hypot(*mine[:, 2:].T) / longest, expected, atol=0.001)
            spots = {(round(x * places), round(y * places)) for x, y, *_ in frame[layer].tolist()}
            assert {(x, y) for x, y, *_ in mine.tolist()} <= spots
    assert not len(rows)


def shown(result: dict[str, Any]) -> NDArray[np.float64]:
    """Return how much of each pixel of the canvas is a mark, (H, W): by its colour."""
    return np.asarray(np.ptp(picture(result)[..., :3].astype(float), axis=2))


def test_each_layer_is_drawn_where_its_marks_are(
    browser: Browser, page: Path, marks: FieldMarks
) -> None:
    steps = [each for _ in LAYERS for each in (("press", "a"), ("pixels", "#marks"), ("look",))]
    seen = browser.visit(
        page, ("pixels", "#marks"), ("press", "ArrowRight"), *steps, ("press", "ArrowRight"),
        ("pixels", "#marks"), ("press", "a"), ("pixels", "#marks"),
    )  # fmt: skip
    assert_quiet(seen, page)
    before, *results, moved, after = seen.results
    assert not shown(before).any() and not shown(after).any()
    drawn, looks = results[::2], results[1::2]
    assert [look["field"] for look in looks] == list(LAYERS)
    for look, text in zip(looks, LAYERS.values(), strict=True):
        assert look["label"].endswith(f"with {text.title}")
    dots, light = marks.frames[1]["candidates"], shown(drawn[1])
    zoom = light.shape[0] / 64
    rows, columns = np.nonzero(light > 60)
    reach = np.hypot(columns[:, None] / zoom - dots[:, 0], rows[:, None] / zoom - dots[:, 1])
    assert reach.min(axis=1).max() < 1.5, "no dot where there is no candidate"
    assert reach.min(axis=0).max() < 1.5, "a dot for each candidate"
    counts = [int((shown(each) > 60).sum()) for each in drawn]
    assert len(set(counts)) == len(counts) and min(counts) > 100
    assert (shown(moved) != shown(drawn[-1])).any(), "another frame has other marks"


def test_a_page_of_an_atlas_says_how_to_see_the_analysis(browser: Browser, tmp_path: Path) -> None:
    page = built(tmp_path)
    seen = browser.visit(page, ("press", "a"), ("look",), ("pixels", "#marks"))
    assert_quiet(seen, page)
    look, drawn = seen.results
    assert look["field"] == "off" and "fire-atlas preview --field RECIPE" in look["said"]
    assert not shown(drawn).any()


def test_an_atlas_alone_has_no_analysis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["preview", "--field", str(tmp_path / "fire.json")]) == 2
    assert "--field needs a recipe" in capsys.readouterr().err


def test_only_a_page_shows_the_analysis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["preview", "--field", "--gif", str(tmp_path / "fire.yaml")]) == 2
    assert "--gif: not allowed with argument --field" in capsys.readouterr().err


def test_places_in_frames_as_large_as_a_page_may_be_are_where_they_were() -> None:
    grid = MarkGrid.of(MAX_PAGE_SIDE, 64, 4)
    dots = grid.dots(np.array([3, MAX_PAGE_SIDE - 1]), np.array([5, 60]), np.array([1.0, 2.0]))
    field = FieldData({"fire": FieldMarks.of(grid, [{"candidates": dots}])})
    data = field.of("fire")
    assert data is not None
    (text,) = field.choices(["fire"])["rows"]
    rows = np.frombuffer(base64.b64decode(text), "<i2").reshape(-1, 4)
    assert np.allclose(rows[:, :2] / data["units"][0], dots[:, :2], atol=0.5)


def test_an_animation_without_a_layer_is_shown_without_it(browser: Browser, tmp_path: Path) -> None:
    members = {"blurred": KEYS, "sharp": {**KEYS, "motion_blur": "none"}}
    for name, keys in members.items():
        (tmp_path / f"{name}.yaml").write_text(json.dumps(keys), encoding="utf-8")
    recipe = tmp_path / "both.yaml"
    files = [f"{name}.yaml" for name in members]
    recipe.write_text(json.dumps({"atlas": {"members": files}, "maps": KEYS["maps"]}))
    assert main(["preview", "--field", str(recipe), "-q"]) == 0
    page = tmp_path / "build" / "both.preview.html"
    choose = """{
      const list = document.getElementById("animation");
      list.value = 1;
      list.dispatchEvent(new Event("change"));
    }"""
    seen = browser.visit(
        page, ("click", "[name=field][value=blur]"), ("pixels", "#marks"), ("run", choose),
        ("pixels", "#marks"), ("look",),
    )  # fmt: skip
    assert_quiet(seen, page)
    drawn, _, plain, look = [each for each in seen.results if each is not None]
    assert shown(drawn).any() and not shown(plain).any()
    assert "with" not in look["label"]
