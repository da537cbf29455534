"""The page shows all views of a fire side by side, in step, in a real browser."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.sheet import Animation, AtlasSheet
from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.preview.views import choices_of, fires_together
from tests.preview.browser import Browser, assert_quiet, picture, previewed, watch
from tests.support.wind import SILK, recipe_in

LOOK, PIXELS = ("look",), ("pixels", "#picture")
FRAMES = 6


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    keys: dict[str, Any] = {
        **SILK, "wind": {}, "views": {"count": 4}, "timeline": {"frames": FRAMES, "fps": 6},
    }  # fmt: skip
    recipe = recipe_in(tmp_path_factory.mktemp("views"), keys)
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    return previewed(recipe.parent / "build" / "fire.json")


@pytest.fixture(scope="module")
def frames(page: Path) -> list[list[Bytes]]:
    """The frames of each view over the page's background."""
    cut = [blend(f, (16, 16, 20), "straight", "srgb") for f in cut_frames(read_atlas(atlas(page)))]
    return [cut[i : i + FRAMES] for i in range(0, len(cut), FRAMES)]


def atlas(page: Path) -> Path:
    return page.with_name("fire.json")


def boxes(drawn: dict[str, Any]) -> list[Bytes]:
    """Return the quarters of a picture, row by row."""
    shown = picture(drawn)[..., :3]
    height, width = shown.shape[0] // 2, shown.shape[1] // 2
    return [shown[y : y + height, x : x + width] for y in (0, height) for x in (0, width)]


def assert_all_show(drawn: dict[str, Any], frames: list[list[Bytes]], number: int) -> None:
    for box, view in zip(boxes(drawn), frames, strict=True):
        assert box.shape == view[number].shape
        assert np.abs(box.astype(int) - view[number]).max() <= 2


def test_it_opens_with_all_views_in_step(
    browser: Browser, page: Path, frames: list[list[Bytes]]
) -> None:
    steps = [each for _ in range(FRAMES) for each in (PIXELS, LOOK, ("press", "ArrowRight"))]
    seen = browser.visit(page, *steps, PIXELS)
    assert_quiet(seen, page)
    for number in range(FRAMES):
        drawn, look = seen.results[2 * number : 2 * number + 2]
        assert_all_show(drawn, frames, number)
        assert look["label"] == f"4 views side by side, frame {number + 1} of {FRAMES}"
    assert_all_show(seen.results[-1], frames, 0)
    assert np.abs(frames[0][0].astype(int) - frames[1][0]).max() > 50, "sides differ"


def test_playing_all_show_the_same_moment(
    browser: Browser, page: Path, frames: list[list[Bytes]]
) -> None:
    played = watch("seen.at(-1)[1] > 2")
    seen = browser.visit(page, played, ("press", "Space"), PIXELS, LOOK, moves=True)
    assert_quiet(seen, page)
    _, drawn, look = seen.results
    assert not look["playing"]
    assert_all_show(drawn, frames, look["frame"] - 1)


def test_half_way_all_pass_into_their_own_next_frames(browser: Browser, page: Path) -> None:
    seen = browser.visit(page, ("press", "m"), ("press", "End"), ("press", "."), PIXELS)
    assert_quiet(seen, page)
    cut = [frame.astype(float) / 255 for frame in cut_frames(read_atlas(atlas(page)))]
    for view, box in enumerate(boxes(seen.results[0])):
        last, first = cut[view * FRAMES + FRAMES - 1], cut[view * FRAMES]
        light = (last[..., :3] * last[..., 3:] + first[..., :3] * first[..., 3:]) / 2
        cover = (last[..., 3:] + first[..., 3:]) / 2
        expected = 255 * (light + np.array([16, 16, 20]) / 255 * (1 - cover))
        assert np.abs(box - expected).max() <= 2


def test_one_view_is_chosen_by_mouse_by_key_and_in_the_list(
    browser: Browser, page: Path, frames: list[list[Bytes]]
) -> None:
    middle = """(() => {
      const { width, height } = document.getElementById("marks").getBoundingClientRect();
      return [0.75 * width, 0.25 * height];
    })()"""
    (place,) = browser.visit(page, ("run", middle)).results
    pick = """(value) => {
      const list = document.getElementById("animation");
      list.value = value;
      list.dispatchEvent(new Event("change"));
    }"""
    seen = browser.visit(
        page, ("press", "ArrowRight"), ("press_at", "#marks", *place), PIXELS, LOOK,
        ("press", "v"), PIXELS, LOOK, ("press", "v"), LOOK, ("run", f"({pick})('2')"), PIXELS, LOOK,
        ("run", f"({pick})('0 on')"), PIXELS,
    )  # fmt: skip
    assert_quiet(seen, page)
    alone, told, together, all_told, first, _, chosen, chosen_told, _, again = seen.results
    assert np.abs(picture(alone)[..., :3].astype(int) - frames[1][1]).max() <= 2
    assert told["label"] == f"view_1, frame 2 of {FRAMES}", "from where all of them were"
    assert_all_show(together, frames, 1)
    assert all_told["said"] == "all 4 views"
    assert first["said"] == "view_1"
    assert np.abs(picture(chosen)[..., :3].astype(int) - frames[2][1]).max() <= 2
    assert chosen_told["label"] == f"view_2, frame 2 of {FRAMES}"
    assert_all_show(again, frames, 1)


def test_flakes_and_layers_of_all_views_are_shown(browser: Browser, page: Path) -> None:
    seen = browser.visit(page, ("pixels", "#marks"), ("press", "f"), ("pixels", "#marks"))
    assert_quiet(seen, page)
    before, marked = (picture(each)[..., 3] > 0 for each in seen.results)
    for y in (0, 1):
        for x in (0, 1):
            height, width = before.shape[0] // 2, before.shape[1] // 2
            box = np.s_[y * height : (y + 1) * height, x * width : (x + 1) * width]
            assert marked[box].sum() > before[box].sum(), "rings around flakes in every box"


def test_the_seam_and_a_page_show_one(browser: Browser, page: Path) -> None:
    seen = browser.visit(page, ("press", "2"), LOOK, ("press", "3"), LOOK, ("press", "1"), LOOK)
    seam, whole, back = seen.results
    sheet = read_atlas(atlas(page)).sheet
    assert seam["size"] == [56, 64] and seam["label"].startswith("view_0, last and first")
    assert whole["size"] == [sheet.pages[0].width, sheet.pages[0].height]
    assert back["size"] == [112, 128]


@pytest.mark.parametrize(("window", "columns"), [((1200, 800), 2), ((420, 1200), 2)])
def test_views_fit_the_window(
    window: tuple[int, int], columns: int, browser: Browser, page: Path
) -> None:
    wide = "[document.scrollingElement.scrollWidth, innerWidth]"
    seen = browser.visit(page, LOOK, ("run", wide), size=window)
    look, (content, inner) = seen.results
    assert look["size"] == [56 * columns, 64 * (4 // columns)]
    assert content <= inner


def renamed(sheet: AtlasSheet, names: list[str]) -> AtlasSheet:
    animations = zip(names, sheet.animations, strict=True)
    return replace(
        sheet,
        animations=tuple(Animation(name, each.frames, each.loop) for name, each in animations),
    )


@pytest.mark.parametrize(
    ("names", "fires", "choices"),
    [
        (
            ["soul/view_0", "soul/view_1", "gas/view_0", "gas/view_1"],
            [[0, 1], [2, 3]],
            ["soul: all 2 views", "soul/view_0", "soul/view_1", "gas: all 2 views", "gas/view_0",
             "gas/view_1"],
        ),
        (["walk", "run", "view_0", "jump"], [], ["walk", "run", "view_0", "jump"]),
    ],
)  # fmt: skip
def test_views_of_one_fire_are_called_alike(
    names: list[str], fires: list[list[int]], choices: list[str], page: Path
) -> None:
    sheet = renamed(read_atlas(atlas(page)).sheet, names)
    assert fires_together(sheet) == fires
    assert list(choices_of(sheet, fires).values()) == choices


def test_animations_of_other_times_are_no_views(page: Path) -> None:
    sheet = read_atlas(atlas(page)).sheet
    first, *others = sheet.animations
    shorter = replace(sheet, animations=(replace(first, frames=first.frames[:-1]), *others))
    assert fires_together(shorter) == [[1, 2, 3]]
    slow = tuple(
        replace(region, duration=999.0) if region.name in others[0].frames else region
        for region in sheet.regions
    )
    assert fires_together(replace(sheet, regions=slow)) == [[0, 2, 3]]
