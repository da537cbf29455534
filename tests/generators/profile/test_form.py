"""The form of a fire that burns in a round column, against columns whose form is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface
from fire_atlas.generators.profile.generate.axis import BentAxis
from fire_atlas.generators.profile.generate.round_form import Column, column_front

SIDE, SCALE = 200, 160.0
CAMERA = Camera(0.0, 0.0, SIDE, SIDE, (SIDE / 2, SIDE - 20.0), SCALE)
ROWS = (CAMERA.origin[1] - np.arange(SIDE) - 0.5) / SCALE
"""Heights of the rows above the foot."""

WIDE, DEEP, APEX = 0.3, 0.2, 1.4


RIGHT = (np.arange(SIDE) + 0.5 - SIDE / 2) / SCALE
"""Places of the columns to the right of the axis."""


def form(
    slope: float,
    deep: float = WIDE,
    behind: float = 0.0,
    lean: tuple[float, float] = (0.0, 0.0),
    camera: Camera = CAMERA,
) -> FrontSurface:
    """Return the form of a column whose size falls by ``slope`` per flame height."""
    axis = BentAxis.of(
        lean, camera.elevation, (-0.3, 1.4), WIDE, lambda heights: np.full_like(heights, behind)
    )
    even = np.ones_like(axis.heights)
    taper = np.maximum(1 - slope * axis.heights, 0.0)
    column = Column(WIDE * even, 0 * even, deep * even, taper)
    return column_front(column, axis, axis.frame_places(RIGHT, ROWS), camera)


def angles(found: NDArray[np.float32], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    unit = wanted / np.linalg.norm(wanted, axis=-1, keepdims=True)
    return np.asarray(np.degrees(np.arccos(np.clip((found * unit).sum(axis=-1), -1, 1))))


def test_a_cone_has_the_depth_and_the_normals_of_a_cone() -> None:
    """Of elliptic section: x²/WIDE² + z²/DEEP² = (1 − h/APEX)²."""
    size = 1 - ROWS / APEX
    cone = form(1 / APEX, DEEP)
    x = (np.arange(SIDE) + 0.5 - SIDE / 2)[None] / SCALE
    inside = np.abs(x) / WIDE < 0.95 * size[:, None]
    front = np.sqrt(np.clip(size[:, None] ** 2 - (x / WIDE) ** 2, 0, None)) * DEEP
    assert np.abs(cone.depth - front * SCALE)[inside].max() < 1e-3
    wanted = np.stack(
        [x / WIDE**2 + 0 * front, np.broadcast_to(-size[:, None] / APEX, front.shape),
         front / DEEP**2],
        axis=-1,
    )  # fmt: skip
    inside[[0, -1]] = False  # one-sided differences
    assert angles(cone.normal, wanted)[inside].max() < 0.5


def test_a_column_further_away_is_as_much_deeper() -> None:
    near, far = form(0.0), form(0.0, behind=0.25)
    assert np.allclose(near.depth - far.depth, 0.25 * SCALE, atol=1e-3)
    assert np.allclose(near.normal, far.normal, atol=1e-5)


def test_a_column_that_leans_away_is_the_deeper_the_higher_and_faces_up() -> None:
    still, away = form(0.0), form(0.0, lean=(0.0, 0.5))
    deeper = (still.depth - away.depth)[:, SIDE // 2] / SCALE
    high, low = SIDE - 20 - 150, SIDE - 20 - 10
    assert 0.4 < deeper[high] < 0.6 and abs(deeper[low]) < 0.02
    assert away.normal[high, SIDE // 2, 1] < -0.3


def test_a_column_that_leans_to_the_right_turns_with_its_axis() -> None:
    leaning = form(0.0, lean=(0.5, 0.0))
    axis = BentAxis.of((0.5, 0.0), 0.0, (-0.3, 1.4), WIDE)
    node = int(np.argmin(np.abs(axis.heights - 0.9)))
    right, up = axis.placed(np.array(0.9), np.array(WIDE * 0.9))
    column, row = int(right * SCALE + SIDE / 2), int(CAMERA.origin[1] - up * SCALE)
    turn = axis.turn[node]
    edge = np.array([math.cos(turn), math.sin(turn), 0.5])
    assert angles(leaning.normal[row, column], edge) < 8


def test_from_above_a_column_faces_up() -> None:
    above = replace(CAMERA, elevation=math.radians(30))
    seen = form(0.0, camera=above)
    middle = seen.normal[SIDE // 2, SIDE // 2]
    assert angles(middle, np.array([0, math.sin(above.elevation), math.cos(above.elevation)])) < 1


@pytest.mark.parametrize("down", [0, 1])
def test_beside_the_column_the_form_goes_on_as_at_its_edge(down: int) -> None:
    cone = form(down / APEX)
    assert np.isfinite(cone.depth).all() and np.isfinite(cone.normal).all()
    assert (cone.normal[SIDE // 2, :4, 0] < -0.9).all()
    assert (cone.normal[SIDE // 2, -4:, 0] > 0.9).all()
