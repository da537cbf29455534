"""From frames to pages and back: nothing is lost, nothing moves, nothing else is drawn."""

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from fire_atlas.atlas.drawing import Edges, bleed_colour
from fire_atlas.atlas.encode import encode_frame, shrink
from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.recipe.output import Atlas
from tests.atlas.frames import cut, frames, lying, owned, pages_of

atlases: st.SearchStrategy[dict[str, Any]] = st.fixed_dictionaries(
    {
        "alpha": st.sampled_from(["straight", "premultiplied", "additive"]),
        "trim": st.sampled_from(["frame", "animation", "none"]),
        "max_size": st.sampled_from([64, 4096]),
        "padding": st.integers(0, 5),
        "extrude": st.integers(0, 3),
        "scales": st.sampled_from([[1], [1, 0.5], [1, 0.5, 0.25]]),
        "pot": st.booleans(),
        "square": st.booleans(),
        "multiple_of": st.sampled_from([1, 4]),
    }
)
packed = st.fixed_dictionaries({"rotate": st.booleans(), "border": st.integers(0, 5)})
grids = st.just({"layout": "grid"})


@settings(max_examples=150, deadline=None)
@given(clip=frames(), common=atlases, layout=packed | grids)
def test_every_frame_can_be_cut_out_of_its_page_bit_for_bit(
    clip: list[Pixels], common: dict[str, Any], layout: dict[str, Any]
) -> None:
    settings = Atlas.model_validate({**common, **layout})
    for sheet, pages, _ in pages_of(clip, settings):
        for pixels, region in zip(clip, sheet.regions, strict=True):
            small = shrink(pixels, round(1 / sheet.scale))
            wanted = encode_frame(small, settings.alpha, settings.blend_space)
            whole = np.zeros((region.frame_height, region.frame_width, 4), np.uint8)
            whole[: wanted.shape[0], : wanted.shape[1]] = wanted
            np.testing.assert_array_equal(cut(region, pages), whole)


@settings(max_examples=100, deadline=None)
@given(clip=frames(), common=atlases, layout=packed | grids)
def test_what_surrounds_a_frame_repeats_its_edge_and_no_more(
    clip: list[Pixels], common: dict[str, Any], layout: dict[str, Any]
) -> None:
    settings = Atlas.model_validate({**common, **layout})
    for sheet, pages, _ in pages_of(clip, settings):
        edges = Edges.of(settings, sheet.scale)
        assert edges.extrude >= settings.extrude * sheet.scale
        for i, page in enumerate(pages):
            assert not page[owned(sheet, i, edges.extrude) == 0].any()
            assert owned(sheet, i, edges.extrude).max() == 1
        for region in sheet.regions:
            e, (width, height) = edges.extrude, region.page_size
            around = pages[region.page][
                region.y - e : region.y + height + e, region.x - e : region.x + width + e
            ]
            cell = lying(region, pages[region.page])
            wanted = np.pad(cell, ((e, e), (e, e), (0, 0)), mode="edge")
            np.testing.assert_array_equal(around, wanted)


@settings(max_examples=100, deadline=None)
@given(
    clip=frames(),
    bleed=st.integers(1, 9),
    padding=st.integers(0, 6),
    extrude=st.integers(0, 2),
    border=st.integers(0, 3),
)
def test_bleeding_changes_no_alpha_and_no_colour_that_shows(
    clip: list[Pixels], bleed: int, padding: int, extrude: int, border: int
) -> None:
    plain = Atlas(padding=padding, extrude=extrude, border=border)
    ((sheet, before, _),) = pages_of(clip, plain)
    ((_, after, _),) = pages_of(clip, plain.model_copy(update={"bleed": bleed}))
    for i, (old, new) in enumerate(zip(before, after, strict=True)):
        np.testing.assert_array_equal(new[..., 3], old[..., 3])
        shows = old[..., 3] > 0
        np.testing.assert_array_equal(new[shows], old[shows])
        beyond = owned(sheet, i, extrude + min(padding // 2, bleed)) == 0
        assert not new[beyond].any()


@settings(deadline=None)
@given(clip=frames(most=1), reach=st.integers(1, 30))
def test_hidden_pixels_take_the_colour_of_the_nearest_that_shows(
    clip: list[Pixels], reach: int
) -> None:
    image = encode_frame(clip[0], "straight", "srgb")
    new = bleed_colour(image, reach)
    shown = np.argwhere(image[..., 3] > 0)
    for y, x in np.argwhere(image[..., 3] == 0):
        if not len(shown):
            assert not new[y, x].any()
            continue
        distance = np.hypot(*(shown - (y, x)).T)
        # OpenCV's distances are exact to a few percent.
        near = shown[distance <= distance.min() * 1.05 + 0.01]
        colours = {tuple(image[b, a, :3]) for b, a in near}
        if distance.min() <= reach * 0.95:
            assert tuple(new[y, x, :3]) in colours
        elif distance.min() > reach * 1.05 + 0.5:
            assert not new[y, x].any()


@settings(max_examples=60, deadline=None)
@given(
    clip=frames(), threshold=st.integers(1, 254), alpha=st.sampled_from(["straight", "additive"])
)
def test_a_threshold_cuts_only_what_is_fainter(
    clip: list[Pixels], threshold: int, alpha: Any
) -> None:
    ((sheet, pages, _),) = pages_of(clip, Atlas(trim_threshold=threshold, alpha=alpha))
    for pixels, region in zip(clip, sheet.regions, strict=True):
        image = encode_frame(pixels, alpha, "srgb")
        lost = image.astype(int) - cut(region, pages)
        seen = image[..., 3] if alpha == "straight" else image.max(axis=2)
        assert not lost[seen > threshold].any()
        if not (seen > threshold).any():
            assert (region.width, region.height) == (1, 1)
        else:
            rows, columns = np.nonzero(seen > threshold)
            size = int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
            assert (region.width, region.height) == size


def test_a_frame_that_trims_to_nothing_costs_a_pixel() -> None:
    ((sheet, pages, _),) = pages_of([np.zeros((40, 30, 4), np.float32)] * 3, Atlas())
    assert (sheet.pages[0].width, sheet.pages[0].height) == (1, 1)
    assert not pages[0].any()


def test_frames_with_the_same_pixels_share_a_place_wherever_they_were() -> None:
    one, other = np.zeros((2, 40, 30, 4), np.float32)
    one[5:15, 3:9], other[20:30, 12:18] = 1, 1
    ((sheet, _, _),) = pages_of([one, other, one], Atlas())
    assert len({(region.x, region.y) for region in sheet.regions}) == 1
    assert [region.trim_y for region in sheet.regions] == [5, 20, 5]
    ((sheet, _, _),) = pages_of([one, other, one], Atlas(dedupe=False))
    assert len({(region.x, region.y) for region in sheet.regions}) == 3
    ((sheet, _, _),) = pages_of([one, other, one], Atlas(layout="grid"))
    assert len({(region.x, region.y) for region in sheet.regions}) == 3


def test_all_scales_share_one_layout() -> None:
    clip = [np.random.default_rng(i).random((33, 21, 4), np.float32) for i in range(5)]
    whole, half, quarter = (s for s, _, _ in pages_of(clip, Atlas(scales=(1.0, 0.5, 0.25))))
    assert [sheet.name for sheet in (whole, half, quarter)] == ["fire", "fire@0.5x", "fire@0.25x"]
    assert half.pages[0].file == "fire@0.5x.png"
    for one, two in zip(whole.regions, half.regions, strict=True):
        assert (one.x, one.y, one.width, one.height) == (
            2 * two.x, 2 * two.y, 2 * two.width, 2 * two.height,
        )  # fmt: skip
        assert one.anchor == two.anchor
    assert whole.pages[0].width == 4 * quarter.pages[0].width


def test_smaller_scales_are_filtered_in_linear_light() -> None:
    stripes = np.zeros((8, 8, 4), np.float32)
    stripes[..., 3] = 1
    stripes[:, ::2, :3] = 1
    _, (sheet, pages, _) = pages_of([stripes], Atlas(scales=(1.0, 0.5)))
    grey = cut(sheet.regions[0], pages)
    assert (grey[..., :3] == 188).all()  # half of white light; 128 would be half of its encoding


@pytest.mark.parametrize(
    ("pivot", "anchor"),
    [
        ("base", (8 / 20, 27 / 30)),
        ("bottom", (0.5, 1)),
        ("center", (0.5, 0.5)),
        ("top", (0.5, 0)),
        ((0.25, 1.5), (0.25, 1.5)),
    ],
)
def test_the_pivot_is_where_the_recipe_says(pivot: Any, anchor: tuple[float, float]) -> None:
    clip = [np.ones((30, 20, 4), np.float32)]
    ((sheet, _, _),) = pages_of(clip, Atlas(pivot=pivot), foot=(8, 27))
    assert sheet.regions[0].anchor == pytest.approx(anchor)


def test_a_pivot_stays_on_its_pixel_where_the_frame_had_to_grow() -> None:
    clip = [np.ones((31, 21, 4), np.float32)]
    whole, half = (s for s, _, _ in pages_of(clip, Atlas(pivot="center", scales=(1.0, 0.5))))
    region = whole.regions[0]
    assert (region.frame_width, region.frame_height) == (22, 32)
    assert region.anchor[0] * region.frame_width == pytest.approx(10.5)
    small = half.regions[0]
    assert small.anchor[1] * small.frame_height == pytest.approx(15.5 / 2)


@pytest.mark.parametrize("compression", ["fast", "small"])
@pytest.mark.parametrize("image_format", ["png", "webp"])
@pytest.mark.parametrize("kind", ["noisy", "opaque", "hidden", "grey"])
def test_files_hold_every_byte_of_the_page(kind: str, image_format: Any, compression: Any) -> None:
    if (image_format, compression) == ("png", "small"):
        pytest.importorskip("oxipng", reason="needs the extra `small`")
    page: Bytes = np.random.default_rng(4).integers(0, 256, (50, 70, 4), np.uint8)
    if kind == "opaque":
        page[..., 3] = 255
    elif kind == "hidden":  # light without alpha, as on additive pages
        page[..., 3] = 0
    elif kind == "grey":
        page[:] = page[..., :1]
        page[..., 3] = 255
    file = io.BytesIO()
    with Workers(2) as workers:
        write_page(file, page, Atlas(format=image_format, compression=compression), workers)
    with Image.open(file) as opened:
        assert opened.format == image_format.upper()
        np.testing.assert_array_equal(np.asarray(opened.convert("RGBA")), page)


@pytest.mark.parametrize(
    ("atlas", "advice"),
    [
        (
            {"max_size": 64},
            r"frame fire/0001 is 70 × 8 px.*be 64 px.*to 70.*source\.height",
        ),
        ({"max_size": 72, "border": 2}, r"plus 2 px of border on each side.*to 74 or more"),
        ({"max_size": 70, "extrude": 1}, r"plus 1 px of border on each side.*to 72 or more"),
        ({"max_size": 100, "pot": True}, r"only be 64 px"),
        ({"max_size": 71, "multiple_of": 4, "layout": "grid"}, r"only be 68 px"),
    ],
)
def test_a_frame_larger_than_a_page_is_refused_with_advice(
    atlas: dict[str, Any], advice: str
) -> None:
    clip = [np.ones((8, 8, 4), np.float32), np.ones((8, 70, 4), np.float32)]
    with pytest.raises(OutputError, match=advice):
        pages_of(clip, Atlas.model_validate({**atlas, "trim": "none"}))


def test_frames_are_named_timed_and_played_in_order() -> None:
    clip = [np.full((8, 8, 4), 0.1 * i + 0.1, np.float32) for i in range(3)]
    ((sheet, _, _),) = pages_of(clip, Atlas())
    names = ("fire/0000", "fire/0001", "fire/0002")
    assert tuple(region.name for region in sheet.regions) == names
    assert [(a.name, a.frames, a.loop) for a in sheet.animations] == [("fire", names, True)]
    assert {region.duration for region in sheet.regions} == {1000 / 24}
    assert [sheet.file(i, ".json") for i in range(3)] == ["fire.json", "fire-1.json", "fire-2.json"]


def test_all_cells_of_a_grid_show_the_same_part_of_the_frame() -> None:
    clip = [np.zeros((30, 20, 4), np.float32) for _ in range(3)]
    for i, pixels in enumerate(clip):
        pixels[5 + i : 10 + 2 * i, 4:9] = 1
    ((sheet, _, _),) = pages_of(clip, Atlas(layout="grid", trim="frame"))
    assert len({(r.trim_x, r.trim_y, r.width, r.height) for r in sheet.regions}) == 1
