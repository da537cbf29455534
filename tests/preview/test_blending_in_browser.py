"""The page passes from frame to frame as engines do: held, blended, along motion vectors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.pixels import decode_bytes, encode_bytes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.preview.cut_frames import aligned_frames
from tests.preview.browser import OPEN_DETAILS, Browser, Seen, assert_quiet, built, picture
from tests.support.flipbook import ENGINES, Picture, plain, read_flipbook, tent

LOOK, PIXELS = ("look",), ("pixels", "#picture")
THREE_WAYS = [each for _ in range(3) for each in (PIXELS, LOOK, ("press", "m"))]
GRID = {"layout": "grid", "alpha": "premultiplied"}
GROUND = np.array([16, 16, 20])
COARSE = {"loop": "none", "fps": 12}
"""Of the sample's frames every other one, so that they lie far apart."""
CHANGES = """new Promise((done) => {
  const picture = document.getElementById("picture"), changes = [];
  const copy = new OffscreenCanvas(picture.width, picture.height)
    .getContext("2d", {willReadFrequently: true});
  let last = null;
  requestAnimationFrame(function look(time) {
    if (changes.length === 4 || time > 60000) return done(changes);
    requestAnimationFrame(look);
    if (last && time < last.time + 60) return;
    copy.drawImage(picture, 0, 0);
    const { data } = copy.getImageData(0, 0, picture.width, picture.height);
    const frame = Math.floor(document.getElementById("now").textContent);
    if (last?.frame === frame) {
      changes.push(data.reduce((most, v, i) => Math.max(most, Math.abs(v - last.data[i])), 0));
    }
    last = {time, frame, data};
  });
})"""
"""How much the picture changes in 60 ms or more within the time of one frame, four times."""


@pytest.fixture(scope="module")
def grids(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Pages of grids that play once."""
    return {
        engine: built(
            tmp_path_factory.mktemp(engine), count=12, maps={"motion": engine, "flame": True},
            atlas=GRID, timeline=COARSE,
        )
        for engine in ENGINES
    }  # fmt: skip


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a grid that goes round."""
    return built(
        tmp_path_factory.mktemp("loop"), count=48, maps={"motion": "unity"}, atlas=GRID,
    )  # fmt: skip


def over(premultiplied: Picture) -> Picture:
    """Lay a picture (h, w, 4), 0..255, over the page's background."""
    return premultiplied[..., :3] + GROUND * (1 - premultiplied[..., 3:] / 255)


def shown(seen: Seen, number: int) -> NDArray[np.float64]:
    return picture(seen.results[number])[..., :3].astype(np.float64)


def staged(page: Path, part: Picture) -> Picture:
    """Lay what a grid's cell shows where its frame is cut from, over the background."""
    region = read_atlas(page.with_name("fire.json")).frames[0]
    stage = np.zeros((region.frame_height, region.frame_width, 4))
    y, x = region.trim_y, region.trim_x
    stage[y : y + region.height, x : x + region.width] = part
    return over(stage)


@pytest.mark.parametrize("engine", ENGINES)
def test_half_a_step_on_each_way_shows_what_its_formula_says(
    engine: str, grids: dict[str, Path], browser: Browser
) -> None:
    page = grids[engine]
    book = read_flipbook(page.parent, "fire")
    count = len(book.places)
    seen = browser.visit(page, *[("press", "ArrowRight")] * 2, ("press", "."), *THREE_WAYS, LOOK)
    assert_quiet(seen, page)
    expected = [
        staged(page, book.frame_part(cell))
        for cell in (
            plain(book, 2, 0.0), plain(book, 2, 0.5), ENGINES[engine](book, 2, 0.5, (1, 1)),
        )
    ]  # fmt: skip
    for way in range(3):
        difference = np.abs(shown(seen, 2 * way) - expected[way])
        # Rounded to a byte, a vector may lead some hundredths of a px beyond the frame's edge,
        # where the page shows nothing and the reader goes on.
        assert difference.max() <= 5 and np.quantile(difference, 0.99) <= 1
    assert np.abs(expected[1] - expected[2]).max() > 20, "vectors do something"
    stated = [look["label"] for look in seen.results[1::2]]
    there = f"fire, between frames 3 and 4 of {count}"
    assert stated == [f"fire, frame 3 of {count}", f"{there}, blend", f"{there}, vectors"]
    assert seen.results[-1]["between"] == "hold"


def test_paused_anywhere_it_shows_what_belongs_there(
    grids: dict[str, Path], browser: Browser
) -> None:
    page = grids["unity"]
    book = read_flipbook(page.parent, "fire")
    keys = [("press", key) for key in ("[", "[", "[", "m", "m", "Space")]
    for wait in (300, 700):
        steps = [("wait", wait), ("press", "Space"), LOOK, PIXELS]
        look, _ = (seen := browser.visit(page, *keys, *steps)).results
        index, part = divmod(look["frame"] - 1, 1)
        expected = staged(page, book.frame_part(ENGINES["unity"](book, int(index), part, (1, 1))))
        off = np.abs(shown(seen, 1) - expected)
        assert off.max() <= 8 and off.mean() < 0.2, "the time is stated to a hundredth of a frame"


def test_the_flame_alone_moves_along_the_vectors(grids: dict[str, Path], browser: Browser) -> None:
    page = grids["godot"]
    book = read_flipbook(page.parent, "fire")
    with Image.open(page.with_name("fire.flame.png")) as image:
        book.pages[0][:] = np.asarray(image.convert("RGBA"), np.float64)
    seen = browser.visit(page, *[("press", key) for key in ("l", "m", "m", ".")], PIXELS, LOOK)
    expected = staged(page, book.frame_part(ENGINES["godot"](book, 0, 0.5, (1, 1))))
    assert np.abs(shown(seen, 0) - expected).max() <= 3
    assert seen.results[1]["label"].endswith(", vectors, flame alone")


def test_the_last_frame_passes_into_the_first_of_what_goes_round(
    loop: Path, browser: Browser
) -> None:
    book = read_flipbook(loop.parent, "fire")
    count = len(book.places)
    assert book.loop
    seen = browser.visit(
        loop, *[("press", key) for key in ("m", "m", "End", ".")], LOOK, PIXELS,
        ("press", "r"), LOOK, PIXELS, ("press", "r"), ("press", "."), LOOK,
    )  # fmt: skip
    assert_quiet(seen, loop)
    assert seen.results[0]["label"] == f"fire, between frames {count} and 1 of {count}, vectors"
    passing = staged(loop, book.frame_part(ENGINES["unity"](book, count - 1, 0.5, (1, 1))))
    assert np.abs(shown(seen, 1) - passing).max() <= 3
    last = staged(loop, book.frame_part(plain(book, count - 1, 0.0)))
    assert np.abs(shown(seen, 3) - last).max() <= 2, "without Repeat it stays"
    assert np.abs(passing - last).max() > 20
    assert seen.results[-1]["frame"] == 1


def test_the_last_frame_of_what_plays_once_stays(grids: dict[str, Path], browser: Browser) -> None:
    page = grids["unity"]
    book = read_flipbook(page.parent, "fire")
    last = staged(page, book.frame_part(plain(book, len(book.places) - 1, 0.0)))
    keys = [("press", key) for key in ("m", "m", "End", ".")]
    seen = browser.visit(page, *keys, PIXELS, ("press", "r"), PIXELS, LOOK)
    for number in (0, 1):
        assert np.abs(shown(seen, number) - last).max() <= 2
    count = len(book.places)
    assert seen.results[2]["label"] == f"fire, frame {count} of {count}"


@pytest.mark.parametrize(
    "atlas",
    [{"alpha": a, "blend_space": s} for a, s in
     (("straight", "srgb"), ("straight", "linear"), ("premultiplied", "linear"),
      ("additive", "srgb"))],
    ids=lambda atlas: "-".join(atlas.values()),
)  # fmt: skip
def test_packed_frames_pass_into_one_another_through_their_own_boxes(
    atlas: dict[str, Any], browser: Browser, tmp_path: Path
) -> None:
    """In px of the untrimmed frame: no vector and nothing to see outside of a frame's box."""
    page = built(tmp_path, count=12, maps={"motion": "godot"}, atlas=atlas, timeline=COARSE)
    file = read_atlas(page.with_name("fire.json"))
    reading = file.sheet.map("motion").vectors
    assert reading is not None
    with Image.open(page.with_name("fire.png")) as image:
        colours = np.asarray(image.convert("RGBA"))
    with Image.open(page.with_name("fire.motion.png")) as image:
        motion = np.asarray(image.convert("RGBA"), np.float64)
    is_linear = atlas["blend_space"] == "linear"

    def decoded(stored: NDArray[np.uint8]) -> NDArray[np.float64]:
        return np.asarray(decode_bytes(stored) if is_linear else stored / 255, np.float64)

    def sampled(number: int, way: float) -> Picture:
        r = file.frames[number]
        box = np.s_[r.trim_y : r.trim_y + r.height, r.trim_x : r.trim_x + r.width]
        place = np.s_[r.y : r.y + r.height, r.x : r.x + r.width]
        edge = 8  # beyond the frame there is nothing
        frame = np.zeros((r.frame_height + 2 * edge, r.frame_width + 2 * edge, 4))
        inside = frame[edge:-edge, edge:-edge]
        inside[box][..., :3] = decoded(colours[place][..., :3])
        inside[box][..., 3] = colours[place][..., 3] / 255
        mv = np.zeros((*inside.shape[:2], 2))
        mv[box] = (motion[place][..., :2] - 128) / 127 * reading.scale
        y, x = np.mgrid[: r.frame_height, : r.frame_width] + edge
        seen = tent(frame, np.stack([x, y], axis=-1) + mv * way)
        covered = np.zeros(mv.shape[:2], np.bool_)
        covered[box] = True
        seen[~covered] = 0
        if atlas["alpha"] == "straight":
            seen[..., :3] *= seen[..., 3:]
        return seen

    seen = browser.visit(page, *[("press", key) for key in ("m", "m", "End", ",")], PIXELS, LOOK)
    assert_quiet(seen, page)
    last = len(file.frames) - 1
    mixed = (sampled(last - 1, -0.5) + sampled(last, 0.5)) / 2
    behind = decoded(GROUND.astype(np.uint8))
    light = mixed[..., :3] + behind * (1 if atlas["alpha"] == "additive" else 1 - mixed[..., 3:])
    expected = encode_bytes(light.astype(np.float32)) if is_linear else np.clip(light, 0, 1) * 255
    assert np.abs(shown(seen, 0) - expected).max() <= 3


def test_rotated_frames_blend(browser: Browser, tmp_path: Path) -> None:
    page = built(tmp_path, atlas={"rotate": True, "alpha": "premultiplied", "max_size": 120})
    file = read_atlas(page.with_name("fire.json"))
    frames = [frame.astype(np.float64) for frame in aligned_frames(file)]
    seen = browser.visit(page, ("press", "m"), ("press", "."), PIXELS)
    assert any(region.rotated for region in file.frames)
    assert np.abs(shown(seen, 0) - over((frames[0] + frames[1]) / 2)).max() <= 2


def test_slow_play_shows_what_lies_between(loop: Path, browser: Browser) -> None:
    """Within the time of one frame the picture stays if frames are held, and moves if not."""
    slower = [("press", "[")] * 3
    for keys, moves in (([], False), ([("press", "m")], True), ([("press", "m")] * 2, True)):
        seen = browser.visit(loop, *slower, *keys, ("run", CHANGES), moves=True)
        assert_quiet(seen, loop)
        assert [each > 2 for each in seen.results[0]] == [moves] * 4


def test_the_bar_has_half_steps_where_frames_pass_into_one_another(
    loop: Path, browser: Browser
) -> None:
    focus = ("run", "document.getElementById('scrub').focus()")
    seen = browser.visit(
        loop, focus, ("press", "ArrowRight"), LOOK, ("press", "m"), ("press", "ArrowRight"), LOOK,
        ("press", "End"), LOOK,
    )  # fmt: skip
    frames = [each["frame"] for each in seen.results if each]
    last = len(read_atlas(loop.with_name("fire.json")).frames)
    assert frames == [2, 2.5, last + 0.5]


def test_a_page_says_how_its_vectors_are_read(grids: dict[str, Path], browser: Browser) -> None:
    for engine, page in grids.items():
        motion = read_atlas(page.with_name("fire.json")).sheet.motion
        assert motion is not None
        encoding = motion_encoding(motion.engine)
        unfolded = browser.visit(page, OPEN_DETAILS, ("run", "document.body.innerText"))
        (text,) = unfolded.results
        for word in (engine.capitalize(), encoding.decode, encoding.this, str(motion.scale)):
            assert word in text
