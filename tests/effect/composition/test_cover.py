"""What light hides: little where it is thin. What things hide stays hidden."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.core.pixels import Bytes, Pixels, as_plane, linear_to_srgb, srgb_to_linear
from fire_atlas.effect.composition.cover import thin_cover
from fire_atlas.effect.composition.smoke import hidden_by_smoke
from fire_atlas.preview.blend import blend
from fire_atlas.sources.matte import luminance_of_light
from tests.support.cover import hidden_by_light

SKY, NIGHT, BLACK = (168, 206, 204), (16, 16, 20), (0, 0, 0)
SPACES = ["srgb", "linear"]


def light(*colours: tuple[float, float, float], space: str = "srgb") -> Pixels:
    """Fire on black in these colours, sRGB in 0..1, one a pixel."""
    rgb = srgb_to_linear(np.array([colours]))
    pixels = np.dstack([rgb, np.ones(rgb.shape[:2], np.float32)])
    return luminance_of_light(as_plane(pixels), space)


def luminance(shown: Bytes) -> np.ndarray:
    linear = srgb_to_linear(shown / 255) @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    return 255 * linear_to_srgb(linear)


def both(pixels: Pixels, space: str, hidden: float = 0.0) -> tuple[Bytes, Bytes]:
    """The pixels as they are stored with full and with thin cover."""
    cover = thin_cover(pixels, np.full(pixels.shape[:2], hidden, np.float32), space)
    full = encode_frame(pixels, "premultiplied", space)  # type: ignore[arg-type]
    return full, encode_frame(pixels, "premultiplied", space, cover)  # type: ignore[arg-type]


FIRE = st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1)).map(
    lambda rgb: (rgb[0], rgb[0] * rgb[1], rgb[0] * rgb[1] * rgb[2])
)


@settings(max_examples=60, deadline=None)
@given(st.lists(FIRE, min_size=1, max_size=20), st.sampled_from(SPACES))
def test_over_black_nothing_changes_and_over_night_hardly(
    colours: list[tuple[float, float, float]], space: str
) -> None:
    full, thin = both(light(*colours, space=space), space)
    assert (full[..., :3] == thin[..., :3]).all()
    dark = [blend(page, BLACK, "premultiplied", space) for page in (full, thin)]
    assert (dark[0] == dark[1]).all()
    night = [blend(page, NIGHT, "premultiplied", space).astype(int) for page in (full, thin)]
    assert (night[1] >= night[0]).all(), "what is hidden less is never darker"
    assert np.abs(night[1] - night[0]).max() <= 6, "20 (F - F²) is 5; three bytes are rounded"


@pytest.mark.parametrize("level", [0.05, 0.1, 0.15, 0.2, 0.25])
@pytest.mark.parametrize("hue", [(1, 0.1, 0), (1, 0.5, 0.05), (1, 1, 1), (0.1, 0.4, 1)])
def test_thin_fire_brightens_the_sky(hue: tuple[float, float, float], level: float) -> None:
    red, green, blue = (level * channel for channel in hue)
    sky, pages = luminance(np.array(SKY)), both(light((red, green, blue)), "srgb")
    full, thin = (luminance(blend(page, SKY, "premultiplied", "srgb")) for page in pages)
    assert thin.min() >= sky - 1
    if hue != (1, 1, 1):
        assert full.max() < sky - 1, "as much cover as light darkens it"


def test_white_light_covers_as_it_shines_and_red_light_less_where_it_is_thin() -> None:
    levels = np.linspace(0, 1, 256)
    for hue, share in ((np.ones(3), 1.0), (np.array([1.0, 0, 0]), 0.2126 / 0.88)):
        full, thin = both(light(*(tuple(level * hue) for level in levels)), "srgb")
        needed = full[..., 3] / 255
        wanted = 255 * hidden_by_light(needed, 0.88 * share * needed)
        assert np.abs(thin[..., 3] - wanted).max() <= 0.6


@pytest.mark.parametrize("hidden", [0.0, 0.3, 0.8, 1.0])
def test_things_hide_as_they_did_however_much_light_there_is(hidden: float) -> None:
    for needed in (0.0, 0.2, 0.9, 1.0):
        coverage = 1 - (1 - hidden) * (1 - needed)
        pixels = np.array([[[coverage, 0, 0, coverage]]], np.float32)
        cover = thin_cover(pixels, np.full((1, 1), hidden, np.float32), "srgb")[0, 0]
        covers = hidden_by_light(needed, coverage * 0.2126, hidden)
        assert cover == pytest.approx(1 - (1 - hidden) * (1 - covers), abs=1e-4)
        assert hidden - 1e-6 <= cover <= coverage + 1e-6


def test_smoke_hides_and_the_fire_in_it_does_not() -> None:
    # A dull grey that covers 0.6; light alone that needs as much.
    smoke = np.array([[[0.05, 0.05, 0.05, 0.6]]], np.float32)
    fire = light((0.6, 0.3, 0.05))
    assert hidden_by_smoke(smoke, "srgb")[0, 0] == pytest.approx(0.6, abs=0.01)
    assert hidden_by_smoke(fire, "srgb")[0, 0] == pytest.approx(0, abs=0.01)
