"""Pages that are compressed for GPUs: cells on whole blocks, and mip levels that mix no frames."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st

from fire_atlas.atlas.encode import encode_frame, shrink
from fire_atlas.atlas.gpu import mip_levels, with_textures
from fire_atlas.atlas.sheet import AtlasSheet, Rect, Region
from fire_atlas.core.pixels import Bytes, srgb_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.blocks import FORMATS, decode_blocks
from fire_atlas.formats.textures.encode import encode_images
from fire_atlas.recipe.output import Atlas
from tests.atlas.frames import cut, frames, pages_of
from tests.support.clips import campfire

BC7 = ("bc7.dds",)
ASTC = ("astc-6x6.ktx2",)


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with Workers(2) as pool:
        yield pool


def settings_of(**atlas: Any) -> Atlas:
    return Atlas.model_validate(atlas)


def page_of_fire(**atlas: Any) -> tuple[AtlasSheet, Bytes]:
    clip = campfire(height=90, count=6)
    ((sheet, (page,), _),) = pages_of([clip.read(i) for i in range(6)], settings_of(**atlas))
    return sheet, page


def texels_read(region: Region, level: int) -> tuple[slice, slice]:
    """The texels of a mip level that a bilinear filter reads for a whole frame."""
    width, height = region.page_size

    def span(start: int, length: int) -> slice:
        first = np.floor(start / 2**level - 0.5)
        last = np.floor((start + length) / 2**level - 0.5) + 1
        return slice(max(int(first), 0), int(last) + 1)

    return span(region.y, height), span(region.x, width)


LAYOUTS: list[dict[str, Any]] = [
    {"gpu": BC7},
    {"gpu": BC7, "rotate": True, "extrude": 1},
    {"gpu": BC7, "layout": "grid"},
    {"gpu": BC7, "layout": "grid", "pot": True, "mips": 4},
    {"gpu": BC7, "mips": 5, "alpha": "premultiplied"},
    {"gpu": ASTC, "alpha": "premultiplied"},
    {"gpu": ("astc-5x5.ktx2",), "mips": 2},
    {"gpu": ("astc-8x8.ktx2", "etc2.ktx2"), "mips": 2},
    {"gpu": ("astc-8x8.ktx2", "astc-5x5.ktx2"), "pot": True},
    {"gpu": (*BC7, *ASTC), "alpha": "premultiplied"},
    {"gpu": BC7, "alpha": "straight", "bleed": 4, "padding": 8, "border": 3, "multiple_of": 4},
]


@pytest.mark.parametrize("atlas", LAYOUTS, ids=str)
def test_no_frame_shows_its_neighbours_at_any_level_even_compressed(
    atlas: dict[str, Any], workers: Workers
) -> None:
    settings = settings_of(**atlas)
    sheet, page = page_of_fire(**atlas)
    count = with_textures(sheet, settings).gpu[0].levels
    assert count == (3 if settings.mips == "auto" else settings.mips)
    assert sheet.pages[0].safe_mip is not None and sheet.pages[0].safe_mip >= count - 1
    for format_ in (FORMATS[each.blocks] for each in with_textures(sheet, settings).gpu):
        whole = [decoded(each, format_.name, workers) for each in levels(page, count, settings)]
        for region in sheet.regions[::2]:
            alone = np.zeros_like(page)
            place = alone_on(page, region, settings)
            rows, columns = (
                slice(place.y, place.y + place.height),
                slice(place.x, place.x + place.width),
            )
            alone[rows, columns] = page[rows, columns]
            for level, each in enumerate(levels(alone, count, settings)):
                texels = texels_read(region, level)
                mine, shared = decoded(each, format_.name, workers)[texels], whole[level][texels]
                assert (
                    np.abs(shown(mine, settings.alpha) - shown(shared, settings.alpha)).max() <= 2
                ), (region.name, level)


def alone_on(page: Bytes, region: Region, settings: Atlas) -> Rect:
    """A frame with what bleeds and is extruded around it."""
    edge = settings.extrude + settings.bleed
    width, height = region.page_size
    return Rect(region.x - edge, region.y - edge, width + 2 * edge, height + 2 * edge)


def levels(page: Bytes, count: int, settings: Atlas) -> list[Bytes]:
    with Workers(1) as pool:
        return list(mip_levels(page, count, settings, pool))


def decoded(image: Bytes, name: str, workers: Workers) -> Bytes:
    """An image as a draft shows it: a final one spends its effort where the page needs it most."""
    height, width = image.shape[:2]
    ((data,),) = encode_images([image], [FORMATS[name]], False, workers, quality="draft")
    return decode_blocks(data, width, height, FORMATS[name], False, workers)


def test_pages_for_no_gpu_mix_frames_at_those_levels(workers: Workers) -> None:
    settings = settings_of(alpha="premultiplied")
    sheet, page = page_of_fire(alpha="premultiplied")
    worst = 0
    for region in sheet.regions:
        alone, place = np.zeros_like(page), alone_on(page, region, settings)
        kept = slice(place.y, place.y + place.height), slice(place.x, place.x + place.width)
        alone[kept] = page[kept]
        texels = texels_read(region, 2)
        mixed, own = (levels(each, 3, settings)[2][texels] for each in (page, alone))
        worst = max(worst, int(np.abs(mixed.astype(int) - own).max()))
    assert worst > 15


def test_cells_take_whole_blocks_at_every_level_that_is_promised() -> None:
    for gpu, mips, unit in ((BC7, "auto", 16), (ASTC, 2, 12), ((*BC7, *ASTC), "auto", 48),
                            (BC7, 5, 64), (BC7, 1, 4)):  # fmt: skip
        sheet, page = page_of_fire(gpu=gpu, mips=mips)
        edge = {1: 1, 2: 2, "auto": 4, 5: 16}[mips]
        assert page.shape[0] % unit == 0 == page.shape[1] % unit
        for region in sheet.regions:
            assert (region.x - edge) % unit == 0 == (region.y - edge) % unit


def test_without_textures_the_layout_is_as_it_was() -> None:
    sheet, _ = page_of_fire()
    apart, _ = page_of_fire(gpu=BC7)
    size, larger = sheet.pages[0], apart.pages[0]
    assert size.width * size.height < larger.width * larger.height
    assert not with_textures(sheet, settings_of()).gpu


@effort(max_examples=30)
@given(
    frames(),
    st.sampled_from([BC7, ASTC, (*BC7, *ASTC)]),
    st.sampled_from(["packed", "grid"]),
    st.booleans(),
    st.sampled_from([[1], [1, 0.5]]),
    st.integers(0, 5),
)
def test_frames_come_back_from_such_pages_exactly(
    clip: list[Any], gpu: tuple[str, ...], layout: str, pot: bool, scales: list[float], extra: int
) -> None:
    chosen = settings_of(gpu=gpu, layout=layout, pot=pot, scales=scales, padding=extra, mips=2)
    plain = settings_of(scales=scales)
    for (sheet, pages, _), (other, others, _) in zip(
        pages_of(clip, chosen), pages_of(clip, plain), strict=True
    ):
        for mine, theirs in zip(sheet.regions, other.regions, strict=True):
            assert np.array_equal(cut(mine, pages), cut(theirs, others))
        assert all(page.safe_mip is not None and page.safe_mip >= 1 for page in sheet.pages)


ENCODINGS = [(alpha, space) for alpha in ("straight", "premultiplied", "additive")
             for space in ("srgb", "linear")]  # fmt: skip


@pytest.mark.parametrize(("alpha", "space"), ENCODINGS)
def test_mips_are_those_of_a_filter_in_linear_premultiplied_light(
    alpha: str, space: str, workers: Workers
) -> None:
    settings = settings_of(alpha=alpha, blend_space=space, gpu=BC7)
    _, page = page_of_fire(alpha=alpha, blend_space=space, gpu=BC7)
    made = list(mip_levels(page, 4, settings, workers))
    for level, image in enumerate(made):
        expected = reference(page, 2**level, alpha, space)
        assert image.shape[:2] == expected.shape[:2]
        error = shown(image, alpha) - shown(expected, alpha)
        lit = shown(expected, alpha).max(axis=2) > 2
        assert 10 * np.log10(255**2 / max(np.mean(error[lit] ** 2), 1e-9)) >= 45


def reference(page: Bytes, factor: int, alpha: str, space: str) -> np.ndarray[Any, Any]:
    """A mip level at once in float64: means of blocks of light, then the formulas of ``encode``."""
    values = page.astype(np.float64) / 255
    cover = np.ones_like(values[..., 3:]) if alpha == "additive" else values[..., 3:]
    linear = srgb_to_linear(values[..., :3]).astype(np.float64)
    if alpha == "straight":
        linear *= cover
    elif space == "srgb":
        linear = srgb_to_linear(values[..., :3] / np.maximum(cover, 1e-9)) * cover
    height, width = page.shape[0] // factor, page.shape[1] // factor
    blocks = np.concatenate([linear, cover], axis=2).reshape(height, factor, width, factor, 4)
    mean = blocks.mean(axis=(1, 3))
    light, cover = mean[..., :3], mean[..., 3:]

    def srgb(each: Any) -> Any:
        return np.where(each <= 0.0031308, each * 12.92, 1.055 * each ** (1 / 2.4) - 0.055)

    colour = light / np.maximum(cover, 1e-9)
    if alpha == "straight":
        rgb = srgb(colour)
    else:
        rgb = srgb(light) if space == "linear" else srgb(colour) * cover
    return np.concatenate([rgb, np.zeros_like(cover) if alpha == "additive" else cover], 2) * 255


def shown(image: Any, alpha: str) -> Any:
    """Premultiplied values of an image, 0 to 255."""
    values = np.asarray(image, np.float64)
    if alpha != "straight":
        return values
    return np.concatenate([values[..., :3] * values[..., 3:] / 255, values[..., 3:]], axis=2)


def test_a_mip_is_the_frame_at_half_its_size(workers: Workers) -> None:
    frame = campfire(height=96, count=2).read(1)
    frame = frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
    page = encode_frame(frame, "premultiplied", "srgb")
    _, half = mip_levels(page, 2, settings_of(alpha="premultiplied"), workers)
    scaled = encode_frame(shrink(frame, 2), "premultiplied", "srgb")
    assert np.abs(half.astype(int) - scaled).max() <= 2


@given(st.integers(1, 70), st.integers(1, 70))
def test_levels_lead_down_to_one_pixel_at_any_size(width: int, height: int) -> None:
    image = np.full((height, width, 4), (120, 60, 30, 200), np.uint8)
    count = max(width, height).bit_length()
    with Workers(1) as pool:
        made = list(mip_levels(image, count, settings_of(alpha="premultiplied"), pool))
    assert [each.shape[:2] for each in made] == [
        (max(height >> level, 1), max(width >> level, 1)) for level in range(count)
    ]
    assert all(np.abs(each.astype(int) - image[0, 0]).max() <= 1 for each in made)


def test_vectors_are_averaged_as_they_are(workers: Workers) -> None:
    image = np.zeros((4, 4, 4), np.uint8)
    image[::2, :, 0], image[1::2, :, 1] = 200, 100
    _, half = mip_levels(image, 2, settings_of(), workers, is_data=True)
    assert (half[..., 0] == 100).all() and (half[..., 1] == 50).all()
