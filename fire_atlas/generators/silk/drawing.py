"""Opaque intruders, drawn in front of and behind the flames, lit by them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.silk.intruders import Body

_WOOD = np.array([0.16, 0.085, 0.04], np.float32)
_STICK = np.array([0.55, 0.36, 0.18], np.float32)
_HEAD = np.array([0.16, 0.02, 0.012], np.float32)
_STONE = np.array([0.14, 0.13, 0.125], np.float32)
"""Linear colours of what logs, matches, their heads and spheres are made of."""

_GLOW, _NEAR = 90.0, 0.03
"""How brightly a fire lights what is near, and the square of how near that is, heights²."""

_AMBIENT = 0.01
"""Light of the night, so that things are not holes."""


@dataclass(frozen=True, slots=True)
class Stage:
    """What stands in the flames, as one camera sees it, with several samples a px.

    Attributes:
        cover: (height, width) 1 where something opaque is.
        away: (height, width) how far away it is, heights; infinite where nothing is.
        normal: (height, width, 3) its surface: right, down and away.
        colour: (height, width, 3) linear.
        scale: Samples to a height.
    """

    cover: Plane
    away: Plane
    normal: NDArray[np.float32]
    colour: NDArray[np.float32]
    scale: float

    @property
    def is_empty(self) -> bool:
        """Whether nothing is drawn at all."""
        return self.cover.size == 0

    def is_before(self, pixel: NDArray[np.intp], away: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether something ``away`` heights away is seen at these samples."""
        return np.asarray(away < self.away.ravel()[pixel])

    def lit_by(self, flame: NDArray[np.float32], heart: NDArray[np.float64]) -> NDArray[np.float32]:
        """Light (height, width, 3) of what is drawn, shone upon by the ``flame`` from its heart
        (samples right, samples down, heights away)."""
        rows, columns = np.nonzero(self.cover)
        lit = np.zeros((*self.cover.shape, 3), np.float32)
        if not rows.size:
            return lit
        towards = np.stack([
            (heart[0] - columns) / self.scale,
            (heart[1] - rows) / self.scale,
            heart[2] - self.away[rows, columns],
        ], axis=1)  # fmt: skip
        far = np.sqrt((towards * towards).sum(axis=1))
        normal = self.normal[rows, columns]
        facing = np.einsum("nd,nd->n", normal, towards) / np.maximum(far, 1e-6)
        # Flames are large: they shine round corners a little.
        shine = np.maximum(facing + 0.35, 0) / 1.35 * _NEAR / (far * far + _NEAR)
        total = flame.sum(axis=(0, 1)) / self.scale**2
        glow = total[None] * np.float32(_GLOW) * shine[:, None] + np.float32(_AMBIENT)
        lit[rows, columns] = self.colour[rows, columns] * glow
        return lit


def no_stage() -> Stage:
    """A stage with nothing on it."""
    none = np.empty((0, 0), np.float32)
    return Stage(none, none, np.empty((0, 0, 3), np.float32), np.empty((0, 0, 3), np.float32), 1.0)


def set_stage(bodies: Sequence[Body], time: float, camera: Camera, finer: int) -> Stage:
    """Draw those of ``bodies`` that are shown, at ``time`` s, with ``finer`` samples a px."""
    shown = [body for body in bodies if body.shown]
    if not shown:
        return no_stage()
    height, width = camera.height * finer, camera.width * finer
    stage = Stage(
        np.zeros((height, width), np.float32),
        np.full((height, width), np.inf, np.float32),
        np.zeros((height, width, 3), np.float32),
        np.zeros((height, width, 3), np.float32),
        float(camera.height * finer),
    )
    for body in shown:
        _draw(stage, body, time, camera, finer)
    return stage


def _draw(stage: Stage, body: Body, time: float, camera: Camera, finer: int) -> None:
    """Draw one body: round everywhere, as thick as its radius."""
    ends = camera.project(np.stack(body.ends(time)))
    ends[:, :2] *= finer
    radius = body.radius * stage.scale
    height, width = stage.cover.shape
    low = np.floor(ends[:, :2].min(axis=0) - radius).astype(int)
    high = np.ceil(ends[:, :2].max(axis=0) + radius).astype(int) + 1
    left, top = max(low[0], 0), max(low[1], 0)
    right, bottom = min(high[0], width), min(high[1], height)
    if left >= right or top >= bottom:
        return
    y, x = np.mgrid[top:bottom, left:right] + 0.5
    along = ends[1, :2] - ends[0, :2]
    square = max(float(along @ along), 1e-9)
    share = ((x - ends[0, 0]) * along[0] + (y - ends[0, 1]) * along[1]) / square
    share = np.clip(share, 0.0, 1.0)
    dx = (x - ends[0, 0] - share * along[0]) / radius
    dy = (y - ends[0, 1] - share * along[1]) / radius
    thick = 1 - dx * dx - dy * dy
    bulge = np.sqrt(np.maximum(thick, 0.0))
    away = ends[0, 2] + share * (ends[1, 2] - ends[0, 2]) - bulge * body.radius
    box = slice(top, bottom), slice(left, right)
    inside = (thick > 0) & (away < stage.away[box])
    stage.cover[box][inside] = 1
    stage.away[box][inside] = away[inside]
    stage.normal[box][inside] = np.stack([dx, dy, -bulge], axis=-1)[inside]
    side = (dx * along[1] - dy * along[0]) / math.sqrt(square)
    stage.colour[box][inside] = _colours(body, share, side, math.sqrt(square) / radius)[inside]


def _colours(
    body: Body, share: NDArray[np.float64], side: NDArray[np.float64], long: float
) -> NDArray[np.float32]:
    """Colour (..., 3) of a body ``long`` radii long, ``share`` of the way from its first end and
    ``side``, -1..1, beside its middle line."""
    if body.is_match:
        head = np.clip((3.0 - share * long) / 0.7, 0.0, 1.0)[..., None]
        return np.asarray(_STICK + (_HEAD - _STICK) * head, np.float32)
    if not body.axis.any():
        return np.broadcast_to(_STONE, (*share.shape, 3))
    # Bark runs along a log in ridges, and where it lies in the fire it is charred.
    ridges = np.sin(13 * side + 1.3 * np.sin(1.2 * share * long + 4 * side)) ** 2
    charred = 0.25 + 0.75 * np.clip(np.abs(2 * share - 1) * 1.3 - 0.2, 0, 1)
    return np.asarray(_WOOD * ((0.45 + 0.55 * ridges) * charred)[..., None], np.float32)
