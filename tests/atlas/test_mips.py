"""How deep mip levels may go, beside a client that really filters."""

import cv2
import numpy as np
import pytest

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.recipe.output import Atlas
from tests.atlas.frames import pages_of


def level_of(page: Bytes, level: int) -> Pixels:
    """A mip level, by averaging blocks of 2 × 2 again and again."""
    image: Pixels = page.astype(np.float32)
    for _ in range(level):
        height, width = image.shape[0] // 2, image.shape[1] // 2
        even = image[: 2 * height, : 2 * width]
        image = even.reshape(height, 2, width, 2, 4).mean(axis=(1, 3))
    return image


def foreign(sheet: AtlasSheet, pages: list[Bytes], level: int) -> float:
    """The most of its neighbours' light that any frame shows, sampled from edge to edge."""
    worst = 0.0
    for region in sheet.regions:
        others = pages[0].copy()
        others[region.y : region.y + region.height, region.x : region.x + region.width] = 0
        mip = level_of(others, level)
        across = np.linspace(region.x, region.x + region.width, 33) / 2**level - 0.5
        down = np.linspace(region.y, region.y + region.height, 33) / 2**level - 0.5
        map_x, map_y = np.meshgrid(across.astype(np.float32), down.astype(np.float32))
        shown = cv2.remap(mip, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        worst = max(worst, float(np.max(shown)))
    return worst


def opaque_frames(count: int, side: int) -> list[Pixels]:
    return [np.full((side, side, 4), 1 - 0.01 * i, np.float32) for i in range(count)]


@pytest.mark.parametrize("padding", [1, 2, 3, 5, 8, 13, 32])
def test_no_frame_shows_another_down_to_the_level_that_is_stated(padding: int) -> None:
    settings = Atlas(padding=padding, multiple_of=4, layout="packed", pot=True, border=padding)
    ((sheet, pages, _),) = pages_of(opaque_frames(9, 30), settings)
    safe = sheet.pages[0].safe_mip
    assert safe is not None
    for level in range(safe + 1):
        assert foreign(sheet, pages, level) == 0
    assert foreign(sheet, pages, safe + 3) > 0


def test_frames_that_touch_cannot_be_filtered_at_all() -> None:
    ((sheet, pages, _),) = pages_of(opaque_frames(4, 16), Atlas(padding=0))
    assert sheet.pages[0].safe_mip is None
    assert foreign(sheet, pages, 0) > 0


def test_more_padding_is_safe_deeper() -> None:
    levels = []
    for padding in (1, 4, 12, 40):
        ((sheet, _, _),) = pages_of(opaque_frames(4, 16), Atlas(padding=padding))
        levels.append(sheet.pages[0].safe_mip)
    assert levels == sorted(levels, key=lambda level: level or 0)
    assert levels[0] == 0
    assert levels[-1] >= 4  # type: ignore[operator]


def test_a_frame_alone_is_safe_down_to_one_pixel() -> None:
    ((sheet, _, _),) = pages_of(opaque_frames(1, 16), Atlas(padding=0))
    assert sheet.pages[0].safe_mip == 4
