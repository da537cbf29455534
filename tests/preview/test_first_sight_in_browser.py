"""What the page shows at first, in a real browser: sizes, and what is left to the fold."""

import base64
import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from tests.preview.browser import OPEN_DETAILS, Browser, assert_quiet, built, painted

LOOK = ("look",)
SHOWN = """(() => {
  const picture = document.getElementById("picture"), box = picture.getBoundingClientRect();
  const rendering = getComputedStyle(picture).imageRendering;
  return [box.left, box.top, box.width, box.height, rendering];
})()"""


def glow(width: int, height: int) -> Bytes:
    """Return a picture of soft light."""
    y, x = np.mgrid[:height, :width]
    light = np.clip(1 - np.hypot(x / width - 0.5, y / height - 0.5) * 2.2, 0, 1)
    return np.stack([255 * light**0.5, 200 * light, 90 * light, 255 * light], -1).astype(np.uint8)


def blocks() -> Bytes:
    """Return pixel art of 4 colours on nothing, 16 x 24 px."""
    art = np.zeros((24, 16, 4), np.uint8)
    chance = np.random.default_rng(4)
    colours = np.array([[200, 30, 20], [250, 150, 30], [255, 240, 160], [90, 10, 40]], np.uint8)
    art[2:22, 2:14, :3] = colours[chance.integers(0, 4, (20, 12))]
    art[2:22, 2:14, 3] = 255
    return art


@pytest.mark.parametrize(
    ("size", "window", "stated"),
    [
        ((255, 120), (1200, 800), "200 %"),
        ((120, 256), (1200, 800), "100 %"),
        ((400, 300), (1200, 800), "100 %"),
        ((200, 120), (420, 800), "100 %"),  # twice as large it would not fit
        ((744, 300), (420, 800), "50 %"),  # 372 px are left between the rims
    ],
)
def test_pictures_open_at_their_size_or_twice_as_large_if_that_fits(
    size: tuple[int, int], window: tuple[int, int], stated: str, browser: Browser, tmp_path: Path
) -> None:
    page = painted(tmp_path, glow(*size), glow(*size), atlas={"trim": "none"})
    seen = browser.visit(page, LOOK, ("run", SHOWN), ("press", "0"), LOOK, size=window)
    assert_quiet(seen, page)
    opened, (_, _, width, height, rendering), fitted = seen.results
    scale = int(stated.split()[0]) / 100
    assert (opened["zoom"], opened["fit"], rendering) == (stated, "false", "auto")
    assert [width, height] == [scale * opened["size"][0], scale * opened["size"][1]]
    assert fitted["fit"] == "true"


def test_pixel_art_opens_in_whole_hard_pixels(browser: Browser, tmp_path: Path) -> None:
    page = painted(tmp_path, blocks(), blocks()[:, ::-1], atlas={"trim": "none"})
    seen = browser.visit(page, LOOK, ("run", SHOWN), ("screenshot",))
    assert_quiet(seen, page)
    look, (left, top, width, height, rendering), shot = seen.results
    assert (look["zoom"], look["pixels"], rendering) == ("800 %", True, "pixelated")
    assert [width, height] == [8 * 16, 8 * 24]
    with Image.open(io.BytesIO(base64.b64decode(shot))) as image:
        seen_pixels = np.asarray(image.convert("RGB"))
    x, y = round(left), round(top)
    squares = seen_pixels[y : y + 192, x : x + 128].reshape(24, 8, 16, 8, 3)
    assert (squares == squares[:, :1, :, :1]).all(), "each pixel is a square of one colour"
    art = blocks()
    assert np.abs(squares[:, 0, :, 0].astype(int) - art[..., :3])[art[..., 3] > 0].max() <= 1


def test_soft_light_is_no_pixel_art_however_small(browser: Browser, tmp_path: Path) -> None:
    page = painted(tmp_path, glow(24, 32), glow(24, 32))
    (look,) = browser.visit(page, LOOK).results
    assert (look["zoom"], look["pixels"]) == ("200 %", False)


TEXT = ("run", "document.body.innerText")
OF_EXPERTS = r"alpha|kappa|sigma|residual|mip|formula|candidates|seam step|heights/s|blended"


def test_what_experts_read_is_folded(browser: Browser, tmp_path: Path) -> None:
    page = built(tmp_path, count=48, maps={"motion": "unity"}, atlas={"layout": "grid"})
    seen = browser.visit(page, TEXT, OPEN_DETAILS, TEXT)
    assert_quiet(seen, page)
    opened, unfolded = seen.results
    assert not re.search(OF_EXPERTS, opened, re.IGNORECASE)
    for word in ("straight alpha", "safe mip level", "seam step", "heights/s", "mv = "):
        assert word in unfolded
    for word in ("48 frames", "Speed", "Repeat", "fire.png", " MB"):
        assert word in opened, "what an artist needs lies open"


def test_a_page_with_the_analysis_shows_it(browser: Browser, tmp_path: Path) -> None:
    built(tmp_path)
    assert main(["preview", "--field", str(tmp_path / "fire.yaml"), "-q", "--overwrite"]) == 0
    page = tmp_path / "build" / "fire.preview.html"
    (opened,) = browser.visit(page, TEXT).results
    assert "Candidates" in opened
