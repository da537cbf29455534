"""From sprites to pages and back: nothing is lost, nothing moves."""

import io

import numpy as np
import pytest
from PIL import Image

from fire_atlas.atlas.encode import encode_frame, encode_sprite
from fire_atlas.atlas.layout import AtlasSheet, Sprite
from fire_atlas.atlas.pages import draw_page, lay_out, page_file
from fire_atlas.atlas.png import write_png
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.output import Atlas

WIDTH, HEIGHT = 48, 64


def flickering_frames(count: int = 9) -> list[Pixels]:
    """Frames with a noisy patch that moves and changes its size; one frame is empty."""
    rng = np.random.default_rng(11)
    frames = []
    for index in range(count):
        frame = np.zeros((HEIGHT, WIDTH, 4), np.float32)
        x, y = rng.integers(1, 20, 2)
        patch = rng.random((*rng.integers(5, 40, 2), 4), np.float32)
        if index != 4:
            frame[y : y + patch.shape[0], x : x + patch.shape[1]] = patch[:, : WIDTH - x]
        frames.append(frame)
    return frames


def written_pages(sheet: AtlasSheet, sprites: list[Sprite]) -> list[Bytes]:
    """Every page, written to a PNG and read back."""
    pages = []
    for index in range(len(sheet.pages)):
        file = io.BytesIO()
        with Workers(2) as workers:
            write_png(file, draw_page(sheet, index, sprites), workers)
        with Image.open(file) as opened:
            pages.append(np.asarray(opened))
    return pages


def lay_out_fire(sprites: list[Sprite], settings: Atlas) -> AtlasSheet:
    return lay_out("fire", sprites, frame_size=(WIDTH, HEIGHT), fps=24, settings=settings)


@pytest.mark.parametrize("max_size", [64, 4096])
@pytest.mark.parametrize("trim", ["frame", "animation", "none"])
@pytest.mark.parametrize("layout", ["packed", "grid"])
@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_every_frame_can_be_cut_out_of_its_page_bit_for_bit(
    alpha: str, layout: str, trim: str, max_size: int
) -> None:
    settings = Atlas.model_validate(
        {"alpha": alpha, "layout": layout, "trim": trim, "max_size": max_size}
    )
    frames = flickering_frames()
    sprites = [encode_sprite(frame, settings.alpha, settings.blend_space) for frame in frames]
    sheet = lay_out_fire(sprites, settings)
    pages = written_pages(sheet, sprites)
    for frame, region in zip(frames, sheet.regions, strict=True):
        across = slice(region.trim_x, region.trim_x + region.width)
        down = slice(region.trim_y, region.trim_y + region.height)
        restored = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
        restored[down, across] = pages[region.page][
            region.y : region.y + region.height, region.x : region.x + region.width
        ]
        np.testing.assert_array_equal(
            restored, encode_frame(frame, settings.alpha, settings.blend_space)
        )


def test_frames_are_named_timed_and_played_in_order() -> None:
    sprites = [encode_sprite(frame, "straight", "srgb") for frame in flickering_frames(3)]
    sheet = lay_out_fire(sprites, Atlas())
    names = ("fire/0000", "fire/0001", "fire/0002")
    assert tuple(region.name for region in sheet.regions) == names
    assert sheet.animations == {"fire": names}
    assert {region.duration for region in sheet.regions} == {1000 / 24}


def test_all_cells_of_a_grid_show_the_same_part_of_the_frame() -> None:
    sprites = [encode_sprite(frame, "straight", "srgb") for frame in flickering_frames()]
    regions = lay_out_fire(sprites, Atlas(layout="grid", trim="frame")).regions
    assert len({(r.trim_x, r.trim_y, r.width, r.height) for r in regions}) == 1


def test_pages_after_the_first_are_numbered() -> None:
    names = [page_file("fire", 0), page_file("fire", 1), page_file("fire", 2, ".json")]
    assert names == ["fire.png", "fire-1.png", "fire-2.json"]
