"""How a camera exposes the light of silk: dim fire keeps its colour, dense fire is nearly white."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.core.pixels import encode_bytes
from fire_atlas.generators.silk.colour import expose, unexposed

ORANGE = np.array([1.0, 0.2, 0.008], np.float32)
"""Light of dense fire of wood, relative to its red."""

CHANNEL = st.floats(0, 3, width=32)


def shown(brightness: float) -> list[int]:
    return [int(byte) for byte in encode_bytes(expose(ORANGE * np.float32(brightness))[None])[0]]


@pytest.mark.parametrize("brightness", [0.05, 0.3, 0.6])
def test_dim_fire_keeps_the_colour_of_each_channel_alone(brightness: float) -> None:
    alone = encode_bytes((1 - np.exp(-ORANGE * np.float32(brightness)))[None])[0]
    assert np.abs(np.array(shown(brightness)) - alone).max() <= 3


def test_the_brighter_the_paler_up_to_white() -> None:
    paleness = [min(shown(brightness)) for brightness in (1, 3, 5, 8, 12, 30)]
    assert paleness == sorted(paleness)
    assert paleness[0] < 30 and paleness[-1] >= 250
    assert min(shown(8)) > 160, "each channel alone: 64"
    greens = [shown(brightness)[1] for brightness in np.linspace(0, 20, 60)]
    assert greens == sorted(greens)


@settings(max_examples=200, deadline=None)
@given(st.tuples(CHANNEL, CHANNEL, CHANNEL))
def test_what_was_exposed_is_found_again(light: tuple[float, float, float]) -> None:
    pixels = np.array([light], np.float32)
    again = unexposed(np.minimum(expose(pixels), np.float32(0.9999)))
    assert np.abs(expose(again) - expose(pixels)).max() < 2e-3
