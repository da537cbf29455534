"""The polygon of a frame holds all that is visible, and covers little else."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_sprite
from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.outline import outline
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.polygon import Point, Triangle, convex_hull, doubled_area, triangulated
from fire_atlas.atlas.sheet import AnimationFrames, Sprite
from fire_atlas.atlas.trim import trimmed
from fire_atlas.recipe.output import Atlas
from tests.support.clips import open_clip, real

ROUND = 16 / math.pi * math.tan(math.pi / 16)
"""Area of the smallest polygon of 16 vertices around a circle: 1.013 of the circle's."""

Visible = NDArray[np.bool_]


@st.composite
def shapes(draw: st.DrawFn) -> Visible:
    """Noise, sparse or dense, in small or large pixels; sparks; round and hollow shapes."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    height, width = draw(st.integers(1, 26)), draw(st.integers(1, 26))
    visible = rng.random((height, width)) < draw(st.sampled_from([0, 0.02, 0.2, 0.6, 0.97, 1]))
    if draw(st.booleans()):
        y, x = np.mgrid[:height, :width]
        radius = np.hypot(x - rng.uniform(0, width), y - rng.uniform(0, height))
        visible |= (radius < rng.uniform(1, 14)) & (radius > rng.uniform(0, 8))
    zoom = draw(st.sampled_from([1, 1, 2]))
    return visible.repeat(zoom, axis=0).repeat(zoom, axis=1)


def times_drawn(
    polygon: Sequence[Point], triangles: Sequence[Triangle], shape: tuple[int, int], parts: int
) -> NDArray[np.int64]:
    """How often the triangles draw each of ``parts`` × ``parts`` places in every pixel.

    Half-planes, another way than the one that finds the polygon; no place lies on an edge.
    """
    y, x = np.mgrid[: shape[0] * parts, : shape[1] * parts] + 0.5
    x, y = (x + 0.01 * math.e) / parts, (y + 0.01 * math.pi) / parts
    drawn = np.zeros(x.shape, np.int64)
    for corners in triangles:
        a, b, c = (polygon[i] for i in corners)
        inside = np.ones(x.shape, np.bool_)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (q[0] - p[0]) * (y - p[1]) > (q[1] - p[1]) * (x - p[0])
        drawn += inside
    return drawn


@settings(max_examples=60)
@given(visible=shapes(), vertices=st.integers(4, 20))
def test_every_visible_pixel_is_drawn_once_and_no_other_place_twice(
    visible: Visible, vertices: int
) -> None:
    height, width = visible.shape
    polygon = outline(visible, vertices)
    assert 3 <= len(polygon) <= vertices
    assert all(0 <= x <= width and 0 <= y <= height for x, y in polygon)
    drawn = times_drawn(polygon, triangulated(polygon), visible.shape, parts=5)
    assert drawn.max() == 1
    seen = visible.repeat(5, axis=0).repeat(5, axis=1)
    assert drawn[seen].all()


@pytest.mark.parametrize("visible", [np.zeros((5, 7), np.bool_), np.ones((5, 7), np.bool_)])
def test_the_frame_itself_is_the_polygon_of_nothing_and_of_everything(visible: Visible) -> None:
    assert set(outline(visible, 8)) == {(0, 0), (7, 0), (7, 5), (0, 5)}


def test_known_polygons_are_found() -> None:
    """A staircase, around which two edges suffice; an L, whose hollow is cut out."""
    stairs = np.tri(20, dtype=np.bool_)
    # From (0, 0) the hull leads along the stairs' outer corners: (1, 0), (20, 19).
    assert set(outline(stairs, 5)) == {(0, 0), (1, 0), (20, 19), (20, 20), (0, 20)}
    angle = np.zeros((30, 24), np.bool_)
    angle[:, :4] = angle[26:] = True
    assert set(outline(angle, 6)) == {(0, 0), (4, 0), (4, 26), (24, 26), (24, 30), (0, 30)}


def hull_of(visible: Visible) -> list[Point]:
    """The convex hull of all four corners of every visible pixel."""
    y, x = (each.tolist() for each in np.nonzero(visible))
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    return convex_hull((a + i, b + j) for a, b in zip(x, y, strict=True) for i, j in corners)


@pytest.mark.parametrize("name", [
    "campfire", "candle", "torch", "fireball", "explosion", "cartoon", "pixel_art",
    real("sim_unity_flame02"), real("sim_unity_flame03"), real("cartoon_wesnoth_campfire"),
    real("cartoon_wesnoth_fireball_impact"), real("cartoon_freedoom_fire"),
])  # fmt: skip
def test_few_vertices_come_close_to_the_convex_hull(name: str) -> None:
    """8 cover at most 1.08 of it. 16 cover no more than it, unless frames are round, as those of an
    explosion: no polygon of 16 vertices around a circle covers less than 1.013 of it."""
    clip = open_clip(name)
    ratios = []
    for i in np.linspace(0, clip.count - 1, 5).astype(int):
        sprite = encode_sprite(clip.read(int(i)), "straight", "srgb")
        visible = sprite.image[..., 3] > 0
        if sprite.visible is None:
            continue
        hull = doubled_area(hull_of(visible))
        ratios.append([doubled_area(outline(visible, most)) / hull for most in (8, 16)])
    eight, sixteen = np.array(ratios).T
    assert eight.max() <= 1.08
    assert sixteen.max() <= ROUND
    assert sixteen.mean() <= (1.005 if name == "explosion" else 1)


def test_a_mesh_holds_what_every_map_shows_and_the_margin_around_it() -> None:
    def sprite(rows: slice, columns: slice, value: int = 90) -> Sprite:
        image = np.zeros((20, 20, 4), np.uint8)
        image[rows, columns] = value
        return trimmed(image, 0, 0, (20, 20))

    frame = AnimationFrames("fire", (sprite(slice(0, 20), slice(0, 20)),), 40.0, True, None)
    (sheet,) = build_sheets("fire", [frame], Atlas())
    page, layer = sprite(slice(8, 10), slice(8, 10)), sprite(slice(12, 14), slice(8, 10))
    dim = sprite(slice(0, 20), slice(0, 2), value=3)
    (region,) = with_meshes(sheet, [[page, layer, dim]], 8, threshold=3, margin=2).regions
    assert region.mesh is not None
    assert set(region.mesh.vertices) == {(6, 6), (12, 6), (12, 16), (6, 16)}
    assert region.drawn_area == 60
