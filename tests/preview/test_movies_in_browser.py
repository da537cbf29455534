"""A WebM of VP9 with alpha plays transparent in Chromium, frame by frame."""

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.formats.movies.write import write_movie
from tests.preview.browser import Browser

pytestmark = pytest.mark.browser

BACKDROPS = ((0, 0, 255), (0, 255, 0))
COLOURS = ((255, 96, 0, 255), (255, 255, 255, 128))
"""Of a square in the middle of both frames; around it nothing is visible."""

PAGE = """<!DOCTYPE html><style>* { margin: 0; font-size: 0 } video { width: 64px; height: 64px }
</style><body>%s<script>
const videos = [...document.querySelectorAll("video")];
const show = (time) => Promise.all(videos.map((video) => new Promise((done) => {
  video.requestVideoFrameCallback(() => requestAnimationFrame(() => requestAnimationFrame(done)));
  video.currentTime = time;
})));
Promise.all(videos.map((video) => new Promise((done, failed) => {
  video.onloadeddata = done;
  video.onerror = () => failed(video.error.message);
}))).then(() => { document.body.dataset.ready = ""; });
</script>"""
VIDEO = '<video style="background: rgb%s" src="fire.webm" muted preload="auto"></video>'


def frame(i: int) -> Bytes:
    pixels = np.zeros((64, 64, 4), np.uint8)
    pixels[16:48, 16:48] = COLOURS[i]
    return pixels


def test_a_webm_plays_transparent(browser: Browser, tmp_path: Path) -> None:
    movie = Movie(64, 64, (200.0, 300.0), True, frame)
    (tmp_path / "fire.webm").write_bytes(write_movie("webm", movie))
    page = tmp_path / "page.html"
    page.write_text(PAGE % "".join(VIDEO % (backdrop,) for backdrop in BACKDROPS))
    steps = [(("run", f"show({time})"), ("screenshot",)) for time in (0.1, 0.35)]
    seen = browser.visit(
        page, *(step for pair in steps for step in pair), ("run", "videos[0].duration")
    )
    assert seen.errors == []
    assert seen.results[-1] == pytest.approx(0.5, abs=0.002)
    for (*colour, alpha), shot in zip(COLOURS, seen.results[1::2], strict=False):
        with Image.open(io.BytesIO(base64.b64decode(shot))) as image:
            pixels = np.array(image.convert("RGB"), np.float64)
        for column, backdrop in enumerate(BACKDROPS):
            shown = pixels[:64, 64 * column : 64 * (column + 1)]
            mixed = np.array(colour) * (alpha / 255) + np.array(backdrop) * (1 - alpha / 255)
            assert np.abs(shown[24:40, 24:40] - mixed).max() <= 6
            assert np.abs(shown[:8] - backdrop).max() <= 2
