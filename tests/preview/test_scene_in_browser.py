"""A scene behind the fire, lit by it, in a real browser."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.pixels import decode_bytes, linear_to_srgb
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import as_seen
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.preview.lamps import lamps_of
from tests.preview.browser import Browser, assert_quiet, built, painted, picture, previewed
from tests.support.wind import SILK, recipe_in

SCENE, PIXELS = ("click", "[name=backdrop][value=scene]"), ("pixels", "#picture")
NEXT = ("click", "#on")
DARK = {"intensity": 0.0, "r": 1.0, "g": 1.0, "b": 1.0}
LIGHTS: list[dict[str, float]] = [
    DARK,
    {"intensity": 0.4, "r": 1.0, "g": 0.5, "b": 0.25},
    {"intensity": 0.8, "r": 1.0, "g": 0.5, "b": 0.25},
    {"intensity": 0.4, "r": 0.25, "g": 0.5, "b": 1.0},
    {"intensity": 0.4, "r": 1.0, "g": 0.5, "b": 0.25, "x": -60.0},
    DARK,
]
"""Of frames of a track; in the last but one the light is far on the left."""


def lit_page(folder: Path, **atlas: Any) -> Path:
    """Build a page whose light is that of ``LIGHTS``."""
    built(folder, tracks=["light"], flakes="none", atlas={"trim": "none", **atlas})
    track = folder / "build" / "fire.light.json"
    document = json.loads(track.read_text())
    middle = {"x": document["size"][0] / 2, "y": 0.7 * document["size"][1]}
    assert len(document["frames"]) == len(LIGHTS)
    for frame, light in zip(document["frames"], LIGHTS, strict=True):
        frame.update({**middle, **light})
    track.write_text(json.dumps(document))
    return previewed(folder / "build" / "fire.json")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lit_page(tmp_path_factory.mktemp("lit"))


@pytest.fixture(scope="module")
def rooms(page: Path, browser: Browser) -> list[NDArray[np.float64]]:
    """The picture of each frame in the scene, in linear light."""
    seen = browser.visit(page, SCENE, *[PIXELS, NEXT] * len(LIGHTS))
    assert_quiet(seen, page)
    return [decode_bytes(picture(each)[..., :3]).astype(float) for each in seen.results]


WALL, FLOOR = np.s_[130:200, 90:160], np.s_[262:290, 90:150]
"""Parts of the picture, px, that no fire and no person hides."""


@pytest.mark.parametrize("part", [WALL, FLOOR], ids=["wall", "floor"])
def test_wall_and_floor_have_the_light_of_the_track(
    part: Any, rooms: list[NDArray[np.float64]]
) -> None:
    dark, dim, bright, blue, _, _ = (room[part] for room in rooms)
    assert dark.max() < 0.02
    light, twice, cold = dim - dark, bright - dark, blue - dark
    assert light[..., 0].mean() > 0.002, "the fire lights it"
    ratio = twice.mean(axis=(0, 1)) / light.mean(axis=(0, 1))
    assert np.abs(ratio - 2).max() < 0.1, "twice the intensity, twice the light"
    warm = light.mean(axis=(0, 1)) / cold.mean(axis=(0, 1))
    assert np.abs(warm / [4, 1, 0.25] - 1).max() < 0.1, "in the colour of the frame"


def test_light_comes_from_where_the_track_has_it(rooms: list[NDArray[np.float64]]) -> None:
    dark, middle, _, _, left, _ = rooms
    for part in (WALL, FLOOR):
        assert (left - dark)[part].mean() > 1.3 * (middle - dark)[part].mean()
    wall = (middle - dark)[50:84, :, 0].mean(axis=0)  # over the person's head
    smooth = np.convolve(wall, np.ones(41) / 41, "valid")
    assert abs(int(smooth.argmax()) + 20 - foot_of(rooms[0])[0]) < 40


def foot_of(dark: NDArray[np.float64]) -> tuple[int, int]:
    """Return the middle and the lowest row of the fire in a dark scene, px."""
    rows, columns = np.nonzero(dark.max(axis=2) > 0.3)
    return round(float(columns.mean())), int(rows.max())


def test_a_dark_person_stands_beside_the_fire(rooms: list[NDArray[np.float64]], page: Path) -> None:
    bright, dark = rooms[2], rooms[0]
    height = read_atlas(page.with_name("fire.json")).frames[0].frame_height
    is_person = (bright.max(axis=2) < 0.003) & (dark.max(axis=2) < 0.003)
    rows, columns = np.nonzero(is_person)
    assert 1.5 * height < np.ptp(rows) < 1.65 * height, "for scale, well over the frame's height"
    x, bottom = foot_of(dark)
    assert columns.min() > x
    assert abs(int(rows.max()) - bottom) < 0.2 * height, "on the same floor"


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
def test_the_fire_is_blended_over_the_scene_as_its_client_does(
    alpha: str, blend_space: str, browser: Browser, tmp_path: Path
) -> None:
    empty = np.zeros((60, 40, 4), np.uint8)
    veil = np.full((60, 40, 4), (200, 90, 20, 0), np.uint8)
    veil[10:58, 5:35, 3] = np.linspace(0, 250, 48)[:, None]
    veil[40:44, 18:22] = 255  # a mark that is white over everything
    packing = {"trim": "none", "alpha": alpha, "blend_space": blend_space}
    page = painted(tmp_path, veil, empty, tracks=["light"], atlas=packing)
    track = page.with_name("fire.light.json")
    document = json.loads(track.read_text())
    for frame in document["frames"]:
        frame.update(intensity=1.0, r=1.0, g=0.5, b=0.2, x=20.0, y=40.0)
    track.write_text(json.dumps(document))
    previewed(page.with_name("fire.json"))
    seen = browser.visit(page, SCENE, PIXELS, NEXT, PIXELS)
    assert_quiet(seen, page)
    shown, behind = (picture(each)[..., :3] for each in seen.results)
    stored = next(iter(cut_frames(read_atlas(page.with_name("fire.json")))))
    (y, x), (own_y, own_x) = (
        np.argwhere((each == 255).all(axis=2))[0] for each in (shown, stored[..., :3])
    )
    top, left = y - own_y, x - own_x
    height, width = stored.shape[:2]
    box = np.s_[top : top + height, left : left + width]
    cover = stored[..., 3:] / 255 if alpha != "additive" else np.zeros((height, width, 1))
    is_linear = blend_space == "linear"
    colour, ground = (
        decode_bytes(each) if is_linear else each / 255 for each in (stored[..., :3], behind[box])
    )
    light = (colour * cover if alpha == "straight" else colour) + ground * (1 - cover)
    expected = 255 * (linear_to_srgb(light.clip(0, 1)) if is_linear else light.clip(0, 1))
    off = np.abs(shown[box] - expected)
    assert off.max() <= 3
    shown_outside, behind_outside = shown.copy(), behind.copy()
    shown_outside[box], behind_outside[box] = 0, 0
    assert (shown_outside == behind_outside).all(), "nothing changes beside the frame"


def test_without_a_track_the_light_is_that_of_the_frames(browser: Browser, tmp_path: Path) -> None:
    page = built(tmp_path)
    html = page.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', html)
    assert found
    lamp = np.array(json.loads(found[1])["animations"][0]["light"])
    seen = [as_seen(f, "straight", "srgb")[..., :3] for f in cut_frames(read_atlas(atlas(page)))]
    sums = np.array([frame.sum(axis=(0, 1)) for frame in seen])
    assert np.abs(lamp[:, :3] - sums / sums.mean(axis=0).max()).max() < 1e-3
    weights = seen[0] @ np.array([0.2126, 0.7152, 0.0722])
    y, x = np.mgrid[: weights.shape[0], : weights.shape[1]] + 0.5
    middle = (weights * x).sum() / weights.sum(), (weights * y).sum() / weights.sum()
    assert np.abs(lamp[0, 3:] - middle).max() < 0.06
    look = browser.visit(page, SCENE, ("look",), PIXELS)
    assert_quiet(look, page)
    assert look.results[0]["backdrop"] == "scene"


def atlas(page: Path) -> Path:
    return page.with_name("fire.json")


def test_the_scene_fills_the_window_and_is_behind_every_view(
    browser: Browser, tmp_path: Path
) -> None:
    keys = {**SILK, "wind": {}, "views": {"count": 2}, "timeline": {"frames": 6, "fps": 6}}
    recipe = recipe_in(tmp_path, keys, tracks=["light"])
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    page = previewed(tmp_path / "build" / "fire.json")
    rooms = "[stage, picture].map((each) => each.getBoundingClientRect().toJSON())"
    stays = "getComputedStyle(stage).overflow"
    for size in ((420, 900), (1280, 800)):
        seen = browser.visit(page, SCENE, ("run", rooms), ("run", stays), PIXELS, size=size)
        assert_quiet(seen, page)
        (stage, shown), overflow, _ = seen.results
        assert shown["width"] >= stage["width"] - 1 and shown["height"] >= stage["height"] - 1
        assert overflow == "hidden"
    room = picture(seen.results[-1])[..., :3].astype(float)
    for half in np.array_split(room, 2, axis=1):
        assert half.max() > 200, "a fire in each"
        assert (half.max(axis=2) < 8).sum() > 300, "a person in each"


@pytest.mark.parametrize(
    ("spoil", "stated"),
    [
        (lambda text: "{}", "fire.light.json: is not a file of light that fire-atlas wrote"),
        (lambda text: text.replace('"r": ', '"r": -'), "build the recipe again"),
        (
            lambda text: json.dumps(json.loads(text) | {"frames": json.loads(text)["frames"][1:]}),
            "has the light of 5 frames, but fire has 6",
        ),
    ],
)
def test_a_track_of_light_that_is_damaged_is_refused(
    spoil: Callable[[str], str],
    stated: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    track = built(tmp_path, tracks=["light"]).with_name("fire.light.json")
    track.write_text(spoil(track.read_text()))
    assert main(["preview", str(tmp_path / "build" / "fire.json"), "-q"]) == 1
    assert stated in capsys.readouterr().err


def test_an_atlas_at_half_size_has_its_light_at_half_size(tmp_path: Path) -> None:
    built(tmp_path, tracks=["light"], atlas={"scales": [1, 0.5]})
    whole, half = (
        lamps_of(read_atlas(tmp_path / "build" / f"fire{end}.json"))[0][0] for end in ("", "@0.5x")
    )
    assert half[:3] == whole[:3]
    assert np.abs(np.array(half[3:]) - np.array(whole[3:]) / 2).max() < 0.11
