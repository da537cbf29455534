"""What is drawn against a plain rasteriser, and against what eyes on other sides see."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import encode_bytes
from fire_atlas.generators.silk import raster
from fire_atlas.generators.silk.colour import expose, unexposed
from fire_atlas.generators.silk.intruder_drawing import (
    CHAR,
    Hearth,
    IntruderBuffers,
    draw_intruders,
)
from fire_atlas.generators.silk.intruders import IntruderBody
from fire_atlas.recipe.silk import Intruder
from fire_atlas.recipe.wind import Wind
from tests.generators.silk.rasteriser import draw
from tests.generators.silk.small_fires import camera, fire, settings, source, torch
from tests.support.silk_fires import silk_fire


def test_triangles_that_share_edges_cover_every_sample_once() -> None:
    """A turned square, cut into cells whose corners and edges lie on middles of samples too."""
    for turn in (0.0, 0.3, np.pi / 4, 1.0):
        lines = np.arange(-8.0, 8.1, 1.0)
        u, v = np.meshgrid(lines, lines)
        x = 16.5 + u * np.cos(turn) - v * np.sin(turn)
        y = 16.5 + u * np.sin(turn) + v * np.cos(turn)
        mesh = np.stack([x, y], axis=-1)[None]
        covered = raster.rasterise(raster.mesh_triangles(mesh, mesh), Window(0, 0, 33, 33))
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
    made = fire(12, rows=8, columns=6, width=40, height=56, sheets={"count": 3}, soot=0.0)
    eye = camera(azimuth, elevation, width=40, height=56)
    place, opacity = made.project_nodes(frame, slice(0, 3), eye)
    place = place[..., :2]
    texel = made.textures.texel_grid(slice(0, 3), 8, 6)
    shown = opacity[..., None] ** made.textures.opacity_exponents(slice(0, 3))
    shown *= made.density(frame, slice(0, 3))[..., None]
    values = np.concatenate([texel, shown], axis=-1)
    cells = raster.mesh_triangles(place * 2, values)
    texture = made.textures.light(frame, slice(0, 3))[..., :3]
    light, edge = draw(cells.position, cells.attributes, texture, 80, 112)
    light = light.reshape(56, 2, 40, 2, 3).mean(axis=(1, 3))
    edge = np.asarray(edge.reshape(56, 2, 40, 2).any(axis=(1, 3)))
    wanted = encode_bytes(expose(light.astype(np.float32))).astype(int)
    found = encode_bytes(made.draw(frame, eye).light).astype(int)
    assert wanted.max() > 150
    assert edge.mean() < 0.02
    assert np.abs(wanted - found)[~edge].max() <= 2


def test_without_soot_the_other_side_of_a_fire_is_its_mirror_image() -> None:
    """Light that adds up does not ask what is in front."""
    clear = fire(soot=0.0)
    for azimuth in (0.0, 45.0):
        one = clear.draw(5, camera(azimuth)).light
        other = clear.draw(5, camera(azimuth + 180)).light
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
    behind, bare = (each.draw(1, camera(180.0)).light[middle] for each in (drawn, hidden))
    assert behind.max() > 0.9 * bare.max()


def difference(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return float(np.abs(one - other).mean())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
@pytest.mark.parametrize("fuel", ["wood", "candle", "gas"])
def test_in_perspective_eight_sides_are_eight_pictures(fuel: str, seed: int) -> None:
    made = silk_fire(source(fuel=fuel, sheets={"count": 5}), settings(12, True, seed=seed))
    seen = [made.draw(5, camera(45.0 * k, distance=2.5)).light for k in range(8)]
    beside = np.array([difference(seen[k], seen[(k + 1) % 8]) for k in range(8)])
    behind = np.array([difference(seen[k], seen[(k + 4) % 8][:, ::-1]) for k in range(8)])
    neighbours = (beside + np.roll(beside, 1)) / 2
    assert (behind >= 0.2 * neighbours).all()


def test_a_camera_sees_as_a_pinhole_does() -> None:
    eye = camera(30.0, 20.0, distance=3.0)
    points = np.random.default_rng(1).uniform(-0.5, 0.8, (50, 3))
    found = eye.project(points)
    # The pinhole: 3 heights before the plane of the origin, in the axis of the frame's middle.
    right, down, away = eye.axes()
    middle = ((32, 40) - np.array(eye.origin)) / 80
    hole = right * middle[0] + down * middle[1] - 3.0 * away
    from_hole = points - hole
    far = from_hole @ away
    x = 32 + 80 * 3.0 * (from_hole @ right) / far
    y = 40 + 80 * 3.0 * (from_hole @ down) / far
    assert np.allclose(found, np.stack([x, y, far - 3.0], axis=-1))
    assert np.allclose(eye.project(np.zeros(3))[:2], eye.origin)
    v = np.random.default_rng(2).normal(0, 1, (50, 3))
    moved = (eye.project(points + 1e-6 * v) - eye.project(points - 1e-6 * v))[..., :2] / 2e-6
    assert np.allclose(eye.project_velocities(points, v), moved, rtol=1e-4, atol=1e-3)
    start, change = eye.rays(found[:, 0], found[:, 1])
    assert np.allclose(start + change * found[:, 2:], eye.view_of(points))
    far_away = camera(30.0, 20.0, distance=1000.0).project(points)
    assert np.allclose(far_away, camera(30.0, 20.0).project(points), atol=0.1)


def test_a_sooty_sheet_in_front_hides_a_bright_one_behind_it() -> None:
    """Two sheets one behind the other: the more soot, the less is seen of the one behind."""
    front = {"at": [0, -0.15, 0], "width": 0.4}
    back = {"at": [0, 0.15, 0], "width": 0.4}
    seen = []
    for soot in (0.0, 1.0, 4.0):
        both, alone = (
            fire(4, sheets=sheets, soot=soot, intensity=0.2).draw(1, camera()).light
            for sheets in ([front, back], [front])
        )
        seen.append(float(both.sum() / alone.sum()))
    assert seen[0] > 1.1 * seen[1] > 1.1 * seen[2]


FLAT_ENDED = {"log", "wax", "wrap"}


@pytest.mark.parametrize("shape", ["sphere", "log", "match", "wax", "wick", "wrap"])
@pytest.mark.parametrize("distance", [None, 2.0])
def test_a_body_is_drawn_where_its_surface_is(shape: str, distance: float | None) -> None:
    """Every sample lies on the body's surface, and its normal points away from it.

    Of a sample whose middle is beside the body, any place may be the one.
    """
    keys = {"shape": shape, "at": [0.1, 0.05, 0.4], "radius": 0.1, "angle": 35, "tilt": 20}
    body = IntruderBody.of(Intruder.model_validate(keys))
    eye = camera(20.0, 15.0, distance=distance)
    hearth = Hearth((0.0, 0.0, 0.0), 0.1, 0.0, 1, (0.0,))
    found = draw_intruders([body], 0.0, eye, 2, hearth)
    at = found.covered
    start, end = body.ends(0.0)
    world = found.position @ eye.axes()
    x, y = np.asarray(at[1] + 0.5) / 2, np.asarray(at[0] + 0.5) / 2
    assert np.allclose(eye.project(world)[:, :2], np.stack([x, y], axis=-1), atol=0.2)
    inside = cv2.erode(found.coverage, np.ones((3, 3)))[at] == 1
    assert np.allclose(
        eye.project(world[inside])[:, :2], np.stack([x, y], axis=-1)[inside], atol=1e-2
    )
    normal = found.normal @ eye.axes()
    neck = start + 0.16 * (end - start) / max(math.dist(start, end), 1e-9)
    parts = [(start, neck, 0.1), (start, end, 0.066)] if shape == "match" else [(start, end, 0.1)]
    on = np.zeros((len(parts), len(world)), bool)
    for k, (one, other, radius) in enumerate(parts):
        away = world - nearest_of(one, other, world)
        reach = np.sqrt((away * away).sum(axis=1))
        on[k] = np.abs(reach - radius) < 1e-4
        if shape in FLAT_ENDED:
            assert reach.max() < radius + 1e-4
        else:
            outwards = np.einsum("nd,nd->n", normal, away)
            alone = on[k] & ~on[:k].any(axis=0)
            assert np.allclose(outwards[alone], radius, atol=1e-3) and alone.any()
    assert shape in FLAT_ENDED or on.any(axis=0).all()


def nearest_of(
    start: NDArray[np.float64], end: NDArray[np.float64], to: NDArray[np.floating]
) -> NDArray[np.float64]:
    along = end - start
    share = np.clip((to - start) @ along / max(float(along @ along), 1e-9), 0, 1)
    return np.asarray(start + share[:, None] * along)


@pytest.mark.parametrize("shape", ["sphere", "wax"])
def test_the_edge_of_a_body_covers_as_much_of_a_pixel_as_its_outline_does(shape: str) -> None:
    keys = {"shape": shape, "at": [0.1, 0.0, 0.4], "radius": 0.1, "tilt": 90, "length": 0.3}
    body, eye = IntruderBody.of(Intruder.model_validate(keys)), camera()
    hearth = Hearth((0.0, 0.0, 0.0), 0.1, 0.0, 1, (0.0,))
    covered = [draw_intruders([body], 0.0, eye, samples, hearth).coverage for samples in (2, 16)]
    few, many = (each.reshape(80, len(each) // 80, 64, -1).mean(axis=(1, 3)) for each in covered)
    assert ((many > 0) & (many < 1)).sum() > 20
    assert np.abs(few - many).max() < 0.13


def drawn_alone(burnt: float = 0.0, **keys: Any) -> IntruderBuffers:
    """An object beside a fire at [0, 0, 0.05]."""
    body = IntruderBody.of(Intruder.model_validate(keys))
    hearth = Hearth((0.0, 0.0, 0.05), 0.15, 0.0, 1, (burnt,))
    return draw_intruders([body], 0.0, camera(), 2, hearth)


def picture(drawn: IntruderBuffers, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return values (n, 3) of what is covered as a picture (height, width, 3), black around it."""
    found = np.zeros((*drawn.coverage.shape, 3), np.float32)
    found[drawn.covered] = values
    return found


def test_a_glow_swells_while_all_else_of_a_log_stays() -> None:
    keys = {"shape": "log", "at": [0, 0, 0.05], "radius": 0.05, "length": 0.3}
    body = IntruderBody.of(Intruder.model_validate(keys))
    early, late = (
        draw_intruders([body], 0.0, camera(), 2, Hearth((0, 0, 0.05), 0.15, phase, 1, (0.0,)))
        for phase in (0.0, 0.25)
    )
    assert np.array_equal(early.colour, late.colour) and np.array_equal(early.depth, late.depth)
    hot = early.glow[:, 0] > 0
    assert hot.any() and (early.glow[hot, 0] != late.glow[hot, 0]).mean() > 0.9


@pytest.mark.parametrize("shape", ["log", "wick", "wrap"])
def test_what_chars_glows_in_the_fire_and_not_far_from_it(shape: str) -> None:
    def glow(x: float) -> float:
        drawn = drawn_alone(shape=shape, at=[x, 0, 0.05], radius=0.05, length=0.12)
        return float(drawn.glow.sum())

    assert glow(0.0) > 0
    assert glow(0.35) == 0


def outline(shape: str) -> NDArray[np.float64]:
    """The widths (rows,) of an upright body, radii, from below its top to above its foot."""
    body = IntruderBody.of(Intruder.model_validate(
        {"shape": shape, "at": [0, 0, 0.4], "radius": 0.12, "length": 0.6, "tilt": 90}
    ))  # fmt: skip
    hearth = Hearth((5.0, 0.0, 0.0), 0.1, 0.0, 1, (0.0,))
    eye = camera(width=200, height=200)
    width = draw_intruders([body], 0.0, eye, 2, hearth).coverage.sum(axis=1) / (2 * eye.scale)
    return np.asarray(width[width > 0][8:-8] / 0.12, np.float64)


def test_logs_and_wraps_have_rough_outlines() -> None:
    wax, log, wrap = (outline(shape) for shape in ("wax", "log", "wrap"))
    assert np.ptp(wax) < 0.02 and np.allclose(wax, 2, atol=0.05)
    for rough in (log, wrap):
        assert 0.05 < np.ptp(rough) < 1.2 and rough.max() < 2.02 and rough.min() > 1.2
    # Cloth is wound in bands: as many dents as turns of it, 5 radii at 0.62 a band.
    smooth = np.convolve(wrap - wrap.mean(), np.ones(5) / 5, mode="same")
    dents = np.count_nonzero(np.diff(np.signbit(smooth).astype(int)) == 1)
    assert 5 <= dents <= 18, "two sides of seven or eight bands"


def test_a_log_is_charred_farther_than_it_glows() -> None:
    log = drawn_alone(shape="log", at=[0.3, 0, 0.05], radius=0.05, length=0.6, strength=0)
    covered = log.coverage.sum(axis=0)
    colour = picture(log, log.colour).sum(axis=(0, 2)) / np.maximum(covered, 1)
    bark = np.median(colour[covered > 0][-20:])
    glows = picture(log, log.glow).any(axis=(0, 2))
    assert ((covered > 0) & ~glows & (colour < 0.5 * bark)).sum() > 3


def test_the_end_of_a_wick_glows() -> None:
    wick = drawn_alone(shape="wick", at=[0, 0, 0], tilt=90, radius=0.02, length=0.1)
    by_row = picture(wick, wick.glow).sum(axis=(1, 2))
    rows = np.flatnonzero(wick.coverage.any(axis=1))
    upper, lower = np.array_split(rows, 2)
    assert by_row[upper].sum() > 0
    assert by_row[lower[len(lower) // 2 :]].sum() == 0


def test_a_match_chars_from_its_head_on_and_its_head_glows() -> None:
    match: dict[str, Any] = {"shape": "match", "at": [-0.2, 0, 0.3], "radius": 0.02, "length": 0.6}
    seen = [drawn_alone(burnt, **match) for burnt in (0.0, 0.5, 3.0)]
    assert not seen[0].glow.any()
    dark = [int((each.colour.max(axis=-1) < 1.2 * CHAR.max()).sum()) for each in seen]
    assert dark[0] == 0 < dark[1] < 0.8 * dark[2]
    glow = picture(seen[2], seen[2].glow)
    glowing, stick = (
        np.flatnonzero(glow.sum(axis=(0, 2))),
        np.flatnonzero(seen[2].coverage.any(axis=0)),
    )
    assert glowing.min() == stick.min() and np.ptp(glowing) < 0.3 * np.ptp(stick)
    # Its head stays: black, with a red gleam far below a flame's light, and thicker than the stick.
    head = glow[:, stick.min() : stick.min() + 6]
    assert 0 < head.max() < 0.2 and head[..., 0].sum() > 5 * head[..., 1].sum()
    thick = seen[2].coverage.sum(axis=0)
    assert thick[: stick.min() + 6].max() > 1.3 * np.median(thick[stick])


def test_cracks_glow_where_wood_is_hot_and_not_at_its_outline() -> None:
    """Seen at a slant a crack's walls hide it; thin lines there would be dots."""
    log = drawn_alone(shape="log", at=[0, 0, 0.05], radius=0.08, length=0.6)
    middle = picture(log, log.glow)[:, 64 - 20 : 64 + 20].sum(axis=2).max(axis=1)
    rows = np.flatnonzero(log.coverage[:, 64])
    assert middle[rows[3:-3]].max() > max(0.3, 8 * float(middle[rows[[0, -1]]].max()))
    unheated = drawn_alone(shape="log", at=[0.4, 0, 0.05], radius=0.05, length=0.12)
    seen = unheated.colour[unheated.coverage[unheated.covered] == 1]
    assert (seen[:, 0] > 3.2 * seen[:, 2]).all(), "nothing of it is charred, which is grey"


def test_each_of_two_fires_lights_from_its_own_place() -> None:
    """Where a fire is that is out of sight hardly matters; light from between them would."""
    stone = {"shape": "sphere", "at": [0.28, 0, 0.2], "radius": 0.08, "strength": 0}
    lit = []
    for x in (-1.2, 9.0):
        far = {"width": 0.3, "at": [x, 0, 0], "fuel": "gas"}
        seen = fire(4, sheets=[{"width": 0.3}, far], intruders=[stone]).draw(1, camera())
        lit.append(float(seen.light[seen.coverage > 0].sum()))
    assert lit[1] == pytest.approx(lit[0], rel=0.15)


def lit_by(
    lights: list[tuple[NDArray[np.float64], NDArray[np.float64]]], drawn: IntruderBuffers
) -> NDArray[np.float32]:
    """Return the light (height, width, 3) of what was drawn, black around it."""
    return picture(drawn, drawn.lit_by(lights, camera()))


def test_where_no_fire_is_the_sky_lights_what_faces_up() -> None:
    """A sphere is lit by half as much at its middle, which faces the camera, as at its top."""
    drawn = drawn_alone(shape="sphere", at=[0, 0, 0.2], radius=0.1, strength=0)
    light = lit_by([], drawn)[:, 64, 0] / np.maximum(picture(drawn, drawn.colour)[:, 64, 0], 1e-6)
    rows = np.flatnonzero(drawn.coverage[:, 64] == 1)
    light = light[rows]
    assert (np.diff(light) <= 1e-4).all()
    assert light[len(rows) // 2] == pytest.approx(0.5 * light[0], rel=0.1)
    assert light[-1] < 0.1 * light[0]


def test_the_flame_lights_wax_from_within() -> None:
    """The side of a candle is lit below its flame, where a log's is not, and less further down."""

    def side(shape: str) -> NDArray[np.float32]:
        drawn = drawn_alone(shape=shape, at=[0, 0, -0.2], tilt=90, radius=0.1, length=0.5)
        lit = lit_by([(np.ones(3), np.array([0.0, -0.3, 0.0]))], drawn) - picture(drawn, drawn.glow)
        rows = np.flatnonzero(drawn.coverage[:, 64])
        below_rim = rows[2 * len(rows) // 5 :]
        return np.asarray((lit / np.maximum(picture(drawn, drawn.colour), 1e-6))[below_rim, 64, 0])

    wax, log = side("wax"), side("log")
    assert (np.diff(wax) < 0).all()
    assert wax[0] > 1.3 * wax[-1]
    assert wax[0] > 2 * log[0]


def test_an_intensity_of_ten_stays_within_what_a_page_holds() -> None:
    light = fire(4, intensity=10.0).draw(1, camera()).light
    assert 0.95 < light.max() <= 1.0


def test_a_folded_sheet_fades_towards_its_fold() -> None:
    """Where a cell that shows one side meets one that shows the other, a sheet ends for the eye: as
    a straight line in the air, if it were seen there."""
    made, eye = fire(12, wind={"level": 2}, turbulence=2.0), camera(30.0, 8.0, 3.0)
    seen, folds = [], 0
    for i in range(0, 12, 3):
        place, opacity = made.project_nodes(i, slice(None), eye)
        seen.append(opacity)
        one = place[:, 1:, 1:, :2] - place[:, :-1, :-1, :2]
        other = place[:, 1:, :-1, :2] - place[:, :-1, 1:, :2]
        front = one[..., 0] * other[..., 1] > one[..., 1] * other[..., 0]
        ends = front[:, :, 1:] != front[:, :, :-1]
        folds += int(ends.sum())
        for edge in (opacity[:, :-1, 1:-1][ends], opacity[:, 1:, 1:-1][ends]):
            assert edge.max() < 0.01
    assert folds > 50
    assert np.mean(seen) > 0.04


@pytest.mark.parametrize(("fuel", "own", "other"), [("wood", 0, 2), ("gas", 2, 0)])
def test_flame_behind_flame_has_the_tint_of_thin_flame(fuel: str, own: int, other: int) -> None:
    """Dimmed alike in red, green and blue, it would be mud before the bright core of a fire."""
    shed = []
    for soot in (0.0, 1.0):
        drawn = fire(6, fuel=fuel, soot=soot, glow=0.0, intensity=0.5).draw(3, camera()).light
        light = -np.log1p(-np.minimum(drawn.astype(np.float64), 0.999)).sum(axis=(0, 1))
        shed.append(light)
    passed = shed[1] / shed[0]
    assert passed[other] < 0.9 * passed[own] < 0.9


# Thin gas, and sheets that cross


@pytest.mark.slow
def test_a_black_body_is_hotter_where_wind_makes_sheets_faster() -> None:
    """On pixels: less red over green than in calm air. A fuel's own colours hardly change. Before
    exposure, which makes dense fire paler, and calm fire is denser."""

    def red_over_green(grading: str, level: float) -> float:
        red = green = 0.0
        for seed in (1, 2, 3):
            keys = source(grading=grading, width=140, sheets={"count": 5})
            wind = Wind.model_validate({"level": level})
            made = silk_fire(keys, settings(12, True, wind, seed))
            for i in range(0, 12, 3):
                light = unexposed(np.minimum(made.draw(i, camera(width=140)).light, 0.99))
                red, green = red + light[..., 0].sum(), green + light[..., 1].sum()
        return red / green

    calm, blown, stormy = (red_over_green("blackbody", level) for level in (0.0, 2.0, 5.0))
    assert blown < 0.95 * calm
    assert stormy < 0.95 * calm
    assert red_over_green("fuel", 5.0) < 1.35 * red_over_green("fuel", 0.0)


def test_fast_gas_is_thinner_alike_for_all_colours() -> None:
    made = fire(6, sheets={"count": 1}, soot=0.0)
    fast = replace(made, recording=replace(made.recording, v_rms=made.recording.v_rms * 2))
    drawn = [each.draw(2, camera()).light for each in (made, fast)]
    shown = [unexposed(np.minimum(each, 0.999)) for each in drawn]
    lit = (shown[0] > 0.05) & (drawn[0] < 0.99).all(axis=-1, keepdims=True)
    ratio = (shown[1] / np.maximum(shown[0], 1e-6))[lit]
    wanted = fast.density(2, slice(0, 1)) / made.density(2, slice(0, 1))
    assert np.allclose(ratio, float(wanted.squeeze()), rtol=0.03)


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("thickness", [0.1, 0.5, 2.0])
def test_sheets_that_coincide_let_the_mean_over_their_orders_pass(
    count: int, thickness: float
) -> None:
    """Seen in every order, n alike sheets show (1 - T**n) / (n (1 - T)) of their light."""
    medium = raster.Medium(1)
    pixel, depth = np.zeros(count, np.intp), np.full(count, 1.5, np.float32)
    each = np.full(count, thickness, np.float32)
    medium.add(pixel, depth, each)
    one = np.ones((1, count), np.float32)
    found = float(medium.before().let_through(one, pixel, depth, each, one).mean())
    passing = math.exp(-thickness)
    assert found == pytest.approx((1 - passing**count) / (count * (1 - passing)), abs=0.02)


def test_a_sheet_hides_nothing_of_itself_and_all_behind_it() -> None:
    medium = raster.Medium(1)
    pixel, depth = np.zeros(2, np.intp), np.array([1.0, 2.0], np.float32)
    thickness = np.array([0.8, 0.8], np.float32)
    medium.add(pixel, depth, thickness)
    dimming = np.array([[0.5], [1.0], [2.0]], np.float32)
    light = np.ones((3, 2), np.float32)
    front, back = medium.before().let_through(light, pixel, depth, thickness, dimming).T
    assert np.allclose(front, 1, atol=0.08)
    assert np.allclose(back, np.exp(-0.8 * dimming[:, 0]), atol=0.12)


def test_no_line_is_dark_where_two_sheets_cross() -> None:
    """A candle of two sheets at right angles, seen from between them: it is as bright in the
    middle, where they meet, as a little to the side."""
    made = fire(
        12, fuel="candle", turbulence=0.0, rows=24, columns=16, width=200, height=200,
        sheets=[{"width": 0.4, "height": 0.9, "angle": angle} for angle in (45, 135)],
    )  # fmt: skip
    light = np.mean([made.draw(i, camera(width=200, height=200)).light for i in (0, 4, 8)], axis=0)
    across = light[80:150].mean(axis=(0, 2))
    middle = int(np.average(np.arange(200), weights=across).round())
    beside = max(across[middle - 5 : middle - 1].max(), across[middle + 2 : middle + 6].max())
    assert across[middle - 1 : middle + 2].min() > 0.95 * beside
