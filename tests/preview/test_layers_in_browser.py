"""The page shows the layers alone, where a build wrote them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import aligned_frames
from tests.preview.browser import COUNT, Browser, assert_quiet, built, picture, previewed
from tests.support.wind import SILK, recipe_in

GROUND = 16, 16, 20
PACKINGS: list[dict[str, Any]] = [
    {"alpha": "straight", "blend_space": "linear", "rotate": True},
    {"alpha": "premultiplied", "blend_space": "srgb", "max_size": 90},
    {"alpha": "additive", "blend_space": "srgb", "format": "webp", "layout": "grid"},
]


def layer(atlas: AtlasFile, kind: str) -> AtlasFile:
    """Return an atlas whose pages are the maps of that kind."""
    files = atlas.sheet.map(kind).files
    pages = zip(atlas.sheet.pages, files, strict=True)
    return replace(
        atlas,
        sheet=replace(atlas.sheet, pages=tuple(replace(page, file=file) for page, file in pages)),
    )


@pytest.mark.parametrize("packing", PACKINGS, ids=lambda atlas: atlas["alpha"])
def test_each_layer_is_shown_as_its_page_has_it(
    packing: dict[str, Any], browser: Browser, tmp_path: Path
) -> None:
    page = built(tmp_path, atlas=packing, maps={"flame": True, "flakes": True})
    atlas = read_atlas(page.with_name("fire.json"))
    looks = [("pixels", "#picture"), ("look",), ("press", "l")] * 3
    steps = [each for _ in range(COUNT) for each in (*looks, ("press", "ArrowRight"))]
    seen = browser.visit(page, *steps)
    assert_quiet(seen, page)
    sheets = [list(aligned_frames(a)) for a in (atlas, *(layer(atlas, k) for k in KINDS))]
    for i in range(COUNT):
        shown = [picture(r)[..., :3].astype(int) for r in seen.results[6 * i : 6 * i + 6 : 2]]
        for drawn, frames in zip(shown, sheets, strict=True):
            expected = blend(frames[i], GROUND, packing["alpha"], packing["blend_space"])
            assert np.abs(drawn - expected).max() <= 2
        stated = [look["label"] for look in seen.results[6 * i + 1 : 6 * i + 6 : 2]]
        plain = f"fire, frame {i + 1} of {COUNT}"
        assert stated == [plain, f"{plain}, flame alone", f"{plain}, flakes alone"]
    assert np.abs(shown[1] - shown[2]).max() > 50, "layers are not one and the same"


KINDS = "flame", "flakes"


def test_layers_are_chosen_by_mouse_and_shown_as_pages_too(
    browser: Browser, tmp_path: Path
) -> None:
    page = built(tmp_path, maps={"flame": True, "flakes": True})
    seen = browser.visit(
        page, ("press", "3"), ("click", "[name=layer][value=flakes]"), ("pixels", "#picture"),
        ("look",), ("click", "[name=layer][value=composed]"), ("pixels", "#picture"),
    )  # fmt: skip
    assert_quiet(seen, page)
    flakes, stated, composed = seen.results
    assert stated["layer"] == "flakes" and stated["label"].endswith(", flakes alone")
    for drawn, file in ((flakes, "fire.flakes.png"), (composed, "fire.png")):
        with Image.open(page.with_name(file)) as image:
            expected = blend(np.asarray(image.convert("RGBA")), GROUND, "straight", "srgb")
        assert np.abs(picture(drawn)[..., :3].astype(int) - expected).max() <= 2


OFFER = """[...document.querySelectorAll("[name=layer], [name=between], [name=flakes]")]
  .filter((each) => each.offsetParent !== null).map((each) => each.value)"""
KEYS = "[...document.querySelectorAll('#more code')].map((each) => each.textContent)"
ALWAYS = {"views.count: 4", "wind.levels: [0, 2, 5]", "composite.ramp: [campfire, soul]",
          "fire-atlas preview --field RECIPE", "tracks: [light]"}  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "offered", "missing"),
    [
        (
            {"flakes": "none"},
            ["hold", "blend"],
            {"maps.flame: true", "maps.flakes: true", "maps.motion: godot", "tracks: [json]"},
        ),
        (
            {"maps": {"flakes": True}},
            ["hold", "blend", "composed", "flakes", "off", "marks", "light"],
            {"maps.flame: true", "maps.motion: godot"},
        ),
        (
            {"maps": {"motion": "godot", "flame": True}},
            ["hold", "blend", "vectors", "composed", "flame", "off", "marks", "light"],
            {"maps.flakes: true"},
        ),
    ],
)
def test_what_a_build_did_not_write_stands_behind_one_folded_line(
    keys: dict[str, Any], offered: list[str], missing: set[str], browser: Browser, tmp_path: Path
) -> None:
    page = built(tmp_path, **keys)
    shown = ("run", "document.querySelector('#more dl').checkVisibility()")
    seen = browser.visit(
        page, ("run", OFFER), ("run", KEYS), shown, ("press", "l"), ("press", "l"), ("look",),
        ("run", "document.querySelectorAll(':disabled').length"), ("click", "#more summary"), shown,
    )  # fmt: skip
    assert_quiet(seen, page)
    offer, listed, is_shown, stated, greyed, is_unfolded = seen.results
    assert (offer, set(listed), greyed) == (offered, missing | ALWAYS, 0)
    assert not is_shown and is_unfolded
    assert stated["layer"] in ("composed", *offered)
    for key in ("maps.flame: true", "maps.flakes: true"):
        assert (key in stated["said"]) == (key in missing)


def test_what_a_fire_in_winds_or_views_has_is_not_proposed(
    browser: Browser, tmp_path: Path
) -> None:
    small = {**SILK, "timeline": {"frames": 6}, "flakes": "none"}
    for name, keys in {"wind": {}, "views": {"wind": {}, "views": {"count": 2}}}.items():
        (tmp_path / name).mkdir()
        recipe = recipe_in(tmp_path / name, {**small, **keys})
        assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
        page = previewed(recipe.parent / "build" / "fire.json")
        (listed,) = browser.visit(page, ("run", KEYS)).results
        other = {"views.count: 4", "wind.levels: [0, 2, 5]", "phases: {ignite: 1, extinguish: 1.5}"}
        assert not other & set(listed), name
        assert "maps.flame: true" in listed


def test_a_layer_that_is_missing_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = built(tmp_path, maps={"flame": True})
    page.with_name("fire.flame.png").unlink()
    with pytest.raises(AssertionError):
        previewed(page.with_name("fire.json"))
    assert "fire.flame.png: the page cannot be read" in capsys.readouterr().err
