"""What is drawn against a plain rasteriser, and against what eyes on other sides see."""

from itertools import pairwise

import numpy as np
import pytest

from fire_atlas.core.pixels import encode_bytes
from fire_atlas.generators.silk import raster
from tests.generators.silk.rasteriser import draw
from tests.generators.silk.small_fires import camera, fire, torch


def test_triangles_that_share_edges_cover_every_sample_once() -> None:
    """A turned square, cut into cells whose corners and edges lie on middles of samples too."""
    for turn in (0.0, 0.3, np.pi / 4, 1.0):
        lines = np.arange(-8.0, 8.1, 1.0)
        u, v = np.meshgrid(lines, lines)
        x = 16.5 + u * np.cos(turn) - v * np.sin(turn)
        y = 16.5 + u * np.sin(turn) + v * np.cos(turn)
        mesh = np.stack([x, y], axis=-1)[None]
        covered = raster.rasterise(raster.mesh_triangles(mesh, mesh), 33, 33)
        count = np.bincount(covered.pixel, minlength=33 * 33)
        assert count.max() == 1
        row, column = np.divmod(np.arange(33 * 33), 33)
        x, y = column + 0.5 - 16.5, row + 0.5 - 16.5
        u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
        inside = np.maximum(np.abs(u), np.abs(v))
        assert count[inside < 7.999].min() == 1
        assert not count[inside > 8.001].any()
        # What is interpolated over a mesh that shows its own places is the place of each sample.
        shown = covered.attributes[:, :2]
        assert np.allclose(shown[:, 0], covered.pixel % 33 + 0.5, atol=1e-3)
        assert np.allclose(shown[:, 1], covered.pixel // 33 + 0.5, atol=1e-3)


@pytest.mark.parametrize(("azimuth", "elevation", "frame"), [(0.0, 0.0, 3), (40.0, 25.0, 11)])
def test_a_view_is_what_a_plain_rasteriser_draws(
    azimuth: float, elevation: float, frame: int
) -> None:
    made = fire(12, rows=8, columns=6, width=40, height=56, sheets={"count": 3})
    eye = camera(azimuth, elevation, width=40, height=56)
    place, opacity = made.project_nodes(frame, slice(0, 3), eye)
    texel = made.textures.texel_grid(slice(0, 3), 8, 6)
    values = np.concatenate(
        [texel, opacity[..., None] ** made.textures.opacity_exponents(slice(0, 3))], axis=-1
    )
    cells = raster.mesh_triangles(place * 2, values)
    texture = made.textures.light(frame, slice(0, 3))
    light, edge = draw(cells.position, cells.attributes, texture, 80, 112)
    light = light.reshape(56, 2, 40, 2, 3).mean(axis=(1, 3))
    edge = np.asarray(edge.reshape(56, 2, 40, 2).any(axis=(1, 3)))
    wanted = encode_bytes((1 - np.exp(-light)).astype(np.float32)).astype(int)
    found = encode_bytes(made.draw(frame, eye).light).astype(int)
    assert wanted.max() > 150
    assert edge.mean() < 0.02
    assert np.abs(wanted - found)[~edge].max() <= 2


def test_from_the_other_side_a_fire_is_its_mirror_image() -> None:
    """Light that adds up does not ask what is in front."""
    for azimuth in (0.0, 45.0):
        one = torch().draw(5, camera(azimuth)).light
        other = torch().draw(5, camera(azimuth + 180)).light
        assert one.max() > 0.5
        assert np.abs(one - other[:, ::-1]).mean() < 2e-3


def test_sides_differ_but_are_as_bright() -> None:
    seen = [torch().draw(5, camera(azimuth)).light for azimuth in (0.0, 30.0, 60.0, 90.0, 120.0)]
    totals = [float(light.sum()) for light in seen]
    assert max(totals) < 2 * min(totals)
    assert all(np.abs(a - b).mean() > 0.2 * a.mean() for a, b in pairwise(seen))


def test_from_above_the_fire_is_foreshortened() -> None:
    def height(elevation: float) -> int:
        lit = torch().draw(5, camera(0.0, elevation)).light.max(axis=(1, 2)) > 0.05
        return int(lit.sum())

    assert height(60.0) < 0.75 * height(0.0)


def test_no_edge_of_a_sheet_is_lit() -> None:
    textures = torch().textures
    for frame in (0, 7, 15):
        light = textures.light(frame, slice(0, 1))
        rim = [light[0], light[-1], light[:, 0], light[:, -1]]
        assert not any(side.any() for side in rim)
        assert light.max() > 0.3


def test_an_opaque_log_hides_what_is_behind_it_and_is_lit() -> None:
    log = {"shape": "log", "at": [0, -0.2, 0.2], "radius": 0.08, "length": 0.5, "strength": 0}
    drawn = fire(4, intruders=[log])
    hidden = fire(4, intruders=[{**log, "draw": False}])
    eye = camera()
    with_log, without = drawn.draw(1, eye), hidden.draw(1, eye)
    assert not without.coverage.any()
    middle = np.s_[round(80 * (1 - 0.06 - 0.2)), 32]
    assert with_log.coverage[middle] == 1
    assert with_log.light[middle].max() < 0.6 * without.light[middle].max()
    assert with_log.light[middle].min() > 0
    # From behind, the flame is in front of it.
    behind = drawn.draw(1, camera(180.0)).light[middle]
    assert behind.max() > 0.9 * without.light[middle].max()


def test_an_intensity_of_ten_stays_within_what_a_page_holds() -> None:
    light = fire(4, intensity=10.0).draw(1, camera()).light
    assert 0.95 < light.max() <= 1.0
