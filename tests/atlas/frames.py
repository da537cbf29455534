"""Frames of every kind that packers trip over, and the way from them to pages and back."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames, AtlasSheet, Region, Sprite
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.recipe.output import Atlas

FPS = 24.0


@st.composite
def frames(draw: st.DrawFn, most: int = 7) -> list[Pixels]:
    """Frames of one size: empty, of one px, of the whole frame, noisy, clear, dim, and repeated."""
    height, width = draw(st.integers(1, 24)), draw(st.integers(1, 24))
    kinds = st.sampled_from(["empty", "pixel", "full", "patch", "clear", "dim", "again"])
    chance = np.random.default_rng(draw(st.integers(0, 999)))
    made: list[Pixels] = []
    for kind in draw(st.lists(kinds, min_size=1, max_size=most)):
        made.append(
            made[-1].copy() if kind == "again" and made else frame(kind, width, height, chance)
        )
    return made


def frame(kind: str, width: int, height: int, chance: np.random.Generator) -> Pixels:
    pixels = np.zeros((height, width, 4), np.float32)
    y, x = int(chance.integers(height)), int(chance.integers(width))
    if kind == "pixel":
        pixels[y, x] = 1
    elif kind == "full":
        pixels[:] = premultiplied(chance, height, width)
        pixels[..., 3] = 1
    elif kind in {"patch", "dim"}:
        patch = premultiplied(chance, height, width) * np.float32(0.03 if kind == "dim" else 1)
        pixels[y:, : x + 1] = patch[y:, : x + 1]
        pixels[chance.random((height, width)) < 0.4] = 0
    elif kind == "clear":
        pixels[..., 3] = 1e-5
    return pixels


def premultiplied(chance: np.random.Generator, height: int, width: int) -> Pixels:
    pixels = chance.random((height, width, 4), np.float32)
    pixels[..., :3] *= pixels[..., 3:]
    return pixels


def pages_of(
    clip: list[Pixels], settings: Atlas, foot: tuple[float, float] = (0, 0)
) -> list[tuple[AtlasSheet, list[Bytes], tuple[Sprite, ...]]]:
    """Each scale's sheet, its pages and its sprites."""
    encoded = [encode_sprites(pixels, settings) for pixels in clip]
    animation = AnimationFrames("fire", tuple(each[0] for each in encoded), 1000 / FPS, True, foot)
    made = []
    for sheet, sprites in zip(
        build_sheets("fire", [animation], settings), zip(*encoded, strict=True), strict=True
    ):
        edges = Edges.of(settings, sheet.scale)
        pages = [draw_page(sheet, i, sprites, edges) for i in range(len(sheet.pages))]
        made.append((sheet, pages, sprites))
    return made


def lying(region: Region, page: Bytes) -> Bytes:
    """The frame's pixels as they lie on the page."""
    width, height = region.page_size
    return page[region.y : region.y + height, region.x : region.x + width]


def cut(region: Region, pages: list[Bytes]) -> Bytes:
    """The untrimmed frame, cut out of its page by what the region says alone."""
    cell = lying(region, pages[region.page])
    if region.rotated:
        cell = np.rot90(cell)
    whole = np.zeros((region.frame_height, region.frame_width, 4), np.uint8)
    x, y = region.trim_x, region.trim_y
    whole[y : y + region.height, x : x + region.width] = cell
    return whole


def owned(sheet: AtlasSheet, page: int, reach: int) -> NDArray[np.int64]:
    """How many frames' places, grown by ``reach`` px, cover each pixel of a page."""
    count = np.zeros((sheet.pages[page].height, sheet.pages[page].width), np.int64)
    for x, y, width, height in {(r.x, r.y, *r.page_size) for r in sheet.regions_of(page)}:
        count[max(y - reach, 0) : y + height + reach, max(x - reach, 0) : x + width + reach] += 1
    return count
