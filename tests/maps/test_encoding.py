"""What bytes mean to each engine."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.recipe.output import Engine

ENGINES: tuple[Engine, ...] = ("unity", "unreal", "godot")


@pytest.mark.parametrize("engine", ENGINES)
def test_no_motion_decodes_to_next_to_nothing(engine: Engine) -> None:
    reads = motion_encoding(engine)
    still = reads.encode(np.zeros((1, 1, 2), np.float32))
    assert still.tolist() == [[[128, 128]]]
    assert reads.neutral == 128
    assert np.abs(reads.decoded(still)).max() <= 1 / 255 + 1e-6


def test_godot_knows_no_motion_exactly() -> None:
    reads = motion_encoding("godot")
    assert not reads.decoded(reads.encode(np.zeros((3, 2, 2), np.float32))).any()


@pytest.mark.parametrize(("engine", "up"), [("unity", 1), ("unreal", -1), ("godot", -1)])
@given(x=st.floats(-1, 1, width=32), y=st.floats(-1, 1, width=32))
def test_a_vector_comes_back_in_the_engines_axes(
    engine: Engine, up: int, x: float, y: float
) -> None:
    """R is right for all; G is up for Unity only. Half a step of 255 may be lost."""
    reads = motion_encoding(engine)
    rise = np.float32(-y)  # the tool's y points down
    decoded = reads.decoded(reads.encode(np.array([[[x, y]]], np.float32)))[0, 0]
    assert decoded == pytest.approx([x, up * rise], abs=0.5 / 127 + 1e-5)
