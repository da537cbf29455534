"""The page shows the variants of a fire side by side, in step, in a real browser."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from tests.preview.browser import Browser, assert_quiet, picture, previewed
from tests.support.wind import SILK, recipe_in

LOOK, PIXELS = ("look",), ("pixels", "#picture")
FRAMES = 6
PICK = """((value) => {
  const list = document.getElementById("animation");
  list.value = value;
  list.dispatchEvent(new Event("change"));
})"""
CHOICES = '[...document.getElementById("animation").options].map((each) => each.textContent)'
NODES = '[...document.querySelectorAll("#graph text")].map((each) => each.textContent)'


def page_of(folder: Path, **keys: Any) -> Path:
    recipe = recipe_in(
        folder, {**SILK, "wind": {}, "timeline": {"frames": FRAMES, "fps": 6}, **keys}
    )
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    return previewed(folder / "build" / "fire.json")


def frames_of(page: Path) -> dict[str, list[Bytes]]:
    """Return the frames of each animation over the page's background."""
    atlas = read_atlas(page.with_name("fire.json"))
    cut = cut_frames(atlas)
    return {
        each.name: [blend(next(cut), (16, 16, 20), "straight", "srgb") for _ in each.frames]
        for each in atlas.sheet.animations
    }


def boxes(drawn: dict[str, Any], columns: int, rows: int) -> list[Bytes]:
    """Return the parts of a picture, row by row."""
    shown = picture(drawn)[..., :3]
    height, width = shown.shape[0] // rows, shown.shape[1] // columns
    corners = [(y * height, x * width) for y in range(rows) for x in range(columns)]
    return [shown[top : top + height, left : left + width] for top, left in corners]


def test_it_opens_with_all_variants_in_step_and_one_may_be_chosen(
    browser: Browser, tmp_path: Path
) -> None:
    page = page_of(tmp_path, variants=4)
    frames = [*frames_of(page).values()]
    steps = [each for _ in range(FRAMES) for each in (PIXELS, LOOK, ("press", "ArrowRight"))]
    seen = browser.visit(
        page, *steps, ("run", CHOICES), ("run", f"{PICK}('2')"), PIXELS, LOOK, ("press", "v"), LOOK
    )
    assert_quiet(seen, page)
    *together, choices, _, alone, told, again = seen.results
    for number, (drawn, look) in enumerate(zip(together[::2], together[1::2], strict=True)):
        for box, variant in zip(boxes(drawn, 2, 2), frames, strict=True):
            assert np.abs(box.astype(int) - variant[number]).max() <= 2
        assert look["label"] == f"4 variants side by side, frame {number + 1} of {FRAMES}"
    assert all(np.abs(a[0].astype(int) - b[0]).max() > 50 for a, b in pairwise(frames)), "differ"
    assert choices == ["all 4 variants", "v0", "v1", "v2", "v3"]
    assert np.abs(picture(alone)[..., :3].astype(int) - frames[2][0]).max() <= 2
    assert told["label"] == f"v2, frame 1 of {FRAMES}"
    assert again["said"] == "all 4 variants"


def test_a_chosen_variant_is_put_out_by_its_own_animation(browser: Browser, tmp_path: Path) -> None:
    page = page_of(tmp_path, variants=2, phases={"extinguish": 1})
    names = [*frames_of(page)]
    for stem in ("v0", "v1"):
        pick = ("run", f"{PICK}('{names.index(f'{stem}/burn')}')")
        steps = [LOOK, ("press", "e"), *[("press", "ArrowRight"), LOOK] * 14]
        seen = browser.visit(page, pick, ("run", NODES), *steps)
        assert_quiet(seen, page)
        _, nodes, *looks = seen.results
        labels = list(dict.fromkeys(look["label"].partition(",")[0] for look in looks))
        assert labels[0] == f"{stem}/burn" and labels[-1] == f"{stem}/extinguish"
        assert all(label.startswith(f"{stem}/") for label in labels)
        assert len(nodes) == len({*nodes}) > 1, "the graph of one fire"
