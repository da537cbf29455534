"""Chromium shows the frames and animations of our style sheets, at any ratio of pixels."""

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_sprites, shrink
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames
from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import Bytes, Pixels, encode_bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.pipeline.files.exports import exported_files
from fire_atlas.recipe.output import Atlas, CssExport, CssOptions
from tests.support.requirements import node_modules
from tests.support.sheets import animation_of, product_of

SHOW = Path(__file__).parent / "web" / "show_css.mjs"
WIDTH, HEIGHT, COUNT, FPS = 40, 56, 3, 20
APART = 60
"""Distance of elements on a page, px of CSS: whole pixels of the screen at each ratio."""

RATIOS = (1, 1.25, 1.5, 2, 3)

pytestmark = pytest.mark.browser


@dataclass(frozen=True)
class Sheet:
    """A style sheet: its density, the scale of its page, and the ending of its file's name."""

    density: float = 1
    scale: float = 1

    @property
    def stem(self) -> str:
        return "fire" if self.scale == 1 else f"fire@{self.scale:g}x"

    @property
    def ending(self) -> str:
        return "" if self.scale == 1 else f"-at-{self.scale:g}x".replace(".", "-")


SHEETS = Sheet(), Sheet(density=2), Sheet(scale=0.5)


def frames() -> list[Pixels]:
    """Soft spots of changing colour that wander: half a pixel beside its place changes little."""
    down, across = np.mgrid[:HEIGHT, :WIDTH]
    made = []
    for i in range(COUNT):
        cover = np.clip(1.2 - np.hypot(across - 14 - 5 * i, down - 18 - 8 * i) / 13, 0, 1)
        colour = np.array([1.0, 0.2 + 0.15 * i, 0.6 - 0.12 * i])
        made.append(np.dstack([cover[..., None] * colour, cover]).astype(np.float32))
    return made


def straight(pixels: Pixels) -> Bytes:
    """A frame as a PNG of its own has it."""
    cover = np.maximum(pixels[..., 3:], 1e-6)
    image = encode_bytes(np.dstack([pixels[..., :3] / cover, pixels[..., 3]]).astype(np.float32))
    image[..., 3] = np.rint(pixels[..., 3] * 255)
    return image


def write(folder: Path, density: float) -> None:
    """Write the pages of the animation in two sizes, with style sheets of a density."""
    settings = Atlas.model_validate({"max_size": 64, "scales": [1, 0.5]})
    drawn = [encode_sprites(pixels, settings) for pixels in frames()]
    sprites = tuple(each[0] for each in drawn)
    animation = AnimationFrames("fire", sprites, 1000 / FPS, True, (20, 50))
    sheets = build_sheets("fire", [animation], settings)
    assert len(sheets[0].pages) > 1
    for sheet, shown in zip(sheets, zip(*drawn, strict=True), strict=True):
        for i, page in enumerate(sheet.pages):
            with Workers(1) as workers, (folder / page.file).open("wb") as file:
                image = draw_page(sheet, i, shown, Edges.of(settings, sheet.scale))
                write_page(file, image, settings, workers)
    export = CssExport(css=CssOptions(density=density))
    for description in exported_files([export], product_of(*sheets), {}):
        (folder / description.name).write_bytes(description.data)


SHOWN = ("frame", "played", "delayed", "own")
"""What stands beside each other: our classes, one that begins elsewhere, and a picture of the frame
alone, as large."""


@pytest.fixture(scope="module")
def shots(node: str, chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Pictures by sheet, ratio, frame, and what shows it."""
    root, jobs, keys = tmp_path_factory.mktemp("css"), list[dict[str, Any]](), []
    for sheet in SHEETS:
        folder = root / f"{sheet.density}-{sheet.scale}"
        folder.mkdir()
        write(folder, sheet.density)
        width, height = (side * sheet.scale / sheet.density for side in (WIDTH, HEIGHT))
        for i, pixels in enumerate(frames()):
            own = straight(shrink(pixels, round(1 / sheet.scale)))
            Image.fromarray(own).save(folder / f"own-{i}.png")
            image = f"background: url(own-{i}.png) 0 0 / 100% 100%"
            elements = (
                f'<i class="fire-{i:04}{sheet.ending}"></i>',
                f'<i class="fire{sheet.ending}"></i>',
                f'<i class="fire{sheet.ending}" style="--delay: -{1 / FPS}s"></i>',
                f'<div style="width: {width}px; height: {height}px; {image}"></div>',
            )
            places = (
                f'<div style="position: absolute; top: 0; left: {k * APART}px">{element}</div>'
                for k, element in enumerate(elements)
            )
            link = f'<link rel="stylesheet" href="{sheet.stem}.css">'
            style = "<style>body { margin: 0; line-height: 0 }</style>"
            (folder / f"{i}.html").write_text(f"<!doctype html>{link}{style}{''.join(places)}")
            for ratio in RATIOS:
                keys.append((sheet, ratio, i))
                jobs.append({
                    "html": f"{folder.name}/{i}.html", "ratio": ratio,
                    "time": (i + 0.5) * 1000 / FPS, "size": [len(SHOWN) * APART, HEIGHT],
                    "file": str(root / f"{len(jobs)}.png"),
                })  # fmt: skip
    (root / "shots.json").write_text(json.dumps(jobs))
    done = subprocess.run(
        [node, SHOW, node_modules(), root / "shots.json"],
        capture_output=True, text=True, timeout=240, check=False,
        env={**os.environ, "CHROMIUM": str(chromium)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert not any(json.loads(done.stdout))
    pictures = dict[tuple[Any, ...], Any]()
    for key, job in zip(keys, jobs, strict=True):
        seen = np.array(Image.open(job["file"]).convert("RGBA"), np.float64)
        seen[..., :3] *= seen[..., 3:] / 255
        pictures |= {
            (*key, k): each for k, each in zip(SHOWN, np.split(seen, len(SHOWN), 1), strict=True)
        }
    return pictures


@pytest.mark.parametrize("kind", ["frame", "played"])
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("sheet", SHEETS, ids=str)
def test_a_class_shows_what_a_picture_of_the_frame_alone_would(
    sheet: Sheet, ratio: float, kind: str, shots: Any
) -> None:
    for i in range(COUNT):
        seen, own = shots[sheet, ratio, i, kind], shots[sheet, ratio, i, "own"]
        assert own.max() > 200
        # Where a pixel of the page is no whole number of the screen's, boxes begin between them.
        is_whole = ratio == sheet.density
        assert np.abs(seen - own).max() <= (2 if is_whole else 10)
        assert np.abs(seen - own).mean() <= (0.2 if is_whole else 0.3)


def test_two_names_of_one_class_are_refused_with_both() -> None:
    for one, other in (("a.b", "a-b"), ("a/b", "a-b"), ("a b", "a.b")):
        animations = [animation_of([(8, 8)], one), animation_of([(9, 9)], other, seed=3)]
        sheet = build_sheets("fire", animations, Atlas())[0]
        with pytest.raises(OutputError, match=f"animation {one} and the animation {other} apart"):
            list(exported_files(["css"], product_of(sheet), {}))


@pytest.mark.parametrize("sheet", SHEETS, ids=str)
def test_a_loop_may_begin_elsewhere(sheet: Sheet, shots: Any) -> None:
    """One is a frame ahead of the others, and goes round the end of the loop."""
    for i in range(COUNT):
        ahead, shown = shots[sheet, 1, i, "delayed"], shots[sheet, 1, (i + 1) % COUNT, "played"]
        np.testing.assert_array_equal(ahead, shown)
