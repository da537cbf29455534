"""The form of a silk fire, against bodies whose form is known."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface
from fire_atlas.generators.silk.renderer import SilkRenderer
from fire_atlas.generators.silk.sheet_textures import SheetTextures
from tests.generators.silk.small_fires import camera, fire, torch

RADIUS, SIDE = 0.3, 192
"""Of the sphere, in heights; of the frame, px."""

INSIDE = 0.9
"""Part of the radius within which fronts are compared: at the rim one pixel sees all directions."""


@dataclass(frozen=True, slots=True)
class EvenTextures(SheetTextures):
    """A sheet that is as bright everywhere, if it burns."""

    def light(self, i: int, sheets: slice) -> NDArray[np.float32]:
        return np.full_like(SheetTextures.light(self, i, sheets), self.burning[i, 0])


def shaped(points: NDArray[np.float64]) -> SilkRenderer:
    """A fire whose one sheet (rows, columns, 3) is where the points are, in heights."""
    made = fire(2, rows=4, columns=4, sheets={"count": 1})  # of any mesh, as it is replaced
    x = np.broadcast_to(points.astype(np.float32), (*made.recording.x.shape[:2], *points.shape))
    recording = replace(made.recording, x=x, v=np.zeros_like(x))
    known = {name: getattr(made.textures, name) for name in SheetTextures.__slots__}
    return replace(made, recording=recording, textures=EvenTextures(**known))


@cache
def sphere() -> SilkRenderer:
    """A ball of fire around the foot."""
    polar = np.linspace(0, math.pi, 65)[:, None]
    around = np.linspace(0, 2 * math.pi, 97)[None]
    x = np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar) + 0 * around
    return shaped(RADIUS * np.stack(x, axis=-1))


def eye(azimuth: float = 0.0, elevation: float = 0.0, distance: float | None = None) -> Camera:
    return camera(azimuth, elevation, distance, width=SIDE, height=SIDE, foot=0.5)


def places(seen: Camera) -> NDArray[np.float64]:
    """The middle of each pixel, heights right of and below the foot."""
    row, column = np.indices((SIDE, SIDE)) + 0.5
    return np.dstack([column - seen.origin[0], row - seen.origin[1]]) / seen.scale


@pytest.fixture(scope="module")
def ball() -> FrontSurface:
    return sphere().front_surface(0, eye())


def test_the_normals_of_a_sphere_are_within_five_degrees_of_its_own(ball: FrontSurface) -> None:
    at = places(eye())
    inside = np.hypot(at[..., 0], at[..., 1]) < INSIDE * RADIUS
    towards = np.sqrt(np.clip(RADIUS**2 - (at * at).sum(axis=2), 0, None))
    cosine = (ball.normal * np.dstack([at, towards]) / RADIUS).sum(axis=2)[inside]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert angle.max() < 5
    assert angle.mean() < 2.5
    assert np.allclose(np.linalg.norm(ball.normal, axis=2), 1, atol=1e-5)


def test_the_depth_of_a_sphere_is_within_a_hundredth_of_the_frame(ball: FrontSurface) -> None:
    at = places(eye())
    inside = np.hypot(at[..., 0], at[..., 1]) < INSIDE * RADIUS
    towards = np.sqrt(np.clip(RADIUS**2 - (at * at).sum(axis=2), 0, None))
    off = (ball.depth / SIDE - towards)[inside]
    assert abs(off.mean()) < 0.006
    assert np.abs(off).max() < 0.015


@pytest.mark.parametrize("seen", [eye(70), eye(0, 40), eye(0, 0, 4)], ids=["side", "above", "near"])
def test_a_sphere_looks_alike_from_everywhere(ball: FrontSurface, seen: Camera) -> None:
    other = sphere().front_surface(0, seen)
    at = places(eye())
    inside = np.hypot(at[..., 0], at[..., 1]) < 0.7 * RADIUS
    cosine = np.clip((other.normal * ball.normal).sum(axis=2), -1, 1)[inside]
    # From nearby the rim is seen at a distance of 4 heights less the radius: larger by 2 degrees.
    assert np.degrees(np.arccos(cosine)).max() < (6 if seen.distance < 10 else 4)


def test_a_wall_that_is_turned_faces_where_it_was_turned() -> None:
    side = np.linspace(-0.35, 0.35, 33)
    turn = math.radians(30)
    u, v = np.meshgrid(side, side)
    made = shaped(np.stack([u * math.cos(turn), u * math.sin(turn), v], axis=-1))
    form, middle = made.front_surface(0, eye()), slice(SIDE // 2 - 20, SIDE // 2 + 20)
    # Its right half lies further away, so it faces to the right.
    wanted = np.array([math.sin(turn), 0, math.cos(turn)])
    cosine = (form.normal[middle, middle] * wanted).sum(axis=-1)
    assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 5
    slope = np.gradient(form.depth[SIDE // 2, middle]).mean()
    assert slope == pytest.approx(-math.tan(turn), rel=0.05)


def test_without_fire_the_form_is_level() -> None:
    made = sphere()
    dark = replace(made, textures=replace(made.textures, burning=0 * made.textures.burning))
    form = dark.front_surface(0, eye())
    assert not form.depth.any() and (form.normal[..., 2] == 1).all()


def test_soot_keeps_back_what_its_optical_depth_states() -> None:
    """Two levels of soot of one fire: transmittances are powers of each other."""
    seen = camera()
    thin, thick = (
        np.log1p(-fire(2, soot=soot).soot(0, seen).astype(np.float64)) for soot in (0.25, 0.5)
    )
    even = (thin < -0.05) & (cover_is_even(thin))
    assert even.sum() > 30
    assert np.allclose(thick[even], 2 * thin[even], rtol=0.05)
    assert not fire(2, soot=0.0).soot(0, seen).any()


def test_soot_is_in_the_flame_and_none_rises_over_it() -> None:
    seen = camera()
    for i in range(4):
        light, soot = torch().draw(i, seen).light.max(axis=2), torch().soot(i, seen)
        flame, hides = (
            np.flatnonzero((plane > least).any(axis=1))
            for plane, least in ((light, 0.0005), (soot, 0.02))
        )
        assert abs(hides[0] - flame[0]) <= 1 and abs(hides[-1] - flame[-1]) <= 1


def cover_is_even(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where neighbours are alike, so that the mean of a pixel's samples is as any of them."""
    down, right = np.gradient(values)
    return np.asarray(np.hypot(down, right) < 0.1 * np.abs(values))


def test_a_log_before_the_fire_has_the_form_of_the_log() -> None:
    log = {"shape": "log", "at": [0.0, -0.3, 0.25], "radius": 0.06, "length": 0.5}
    made = fire(2, intruders=[log])
    seen = camera()
    form = made.front_surface(0, seen)
    row = round(seen.origin[1] - 0.25 * seen.scale)
    column = round(seen.origin[0])
    assert form.depth[row, column] == pytest.approx(0.36 * seen.scale, abs=0.02 * seen.scale)
