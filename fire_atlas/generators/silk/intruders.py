"""Intruders (section 6): objects in the flame, as force fields and as drawn bodies.

No collisions are computed: an intruder pushes the sheets away from its middle line. Visible ones
are also drawn, with a depth buffer that hides the flames behind them, and are lit by the flames.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.silk.mechanics import Vectors, lengths
from fire_atlas.recipe.silk import Intruder

_FALLOFF = 0.03
"""Beyond its surface an intruder's force falls to 1/e over its radius plus this, heights."""

_SURFACE_ACCELERATION = 12.0
"""Acceleration at the surface of an intruder of strength 1, heights/s²."""

_WOOD = np.array([0.16, 0.085, 0.04], np.float32)
_STICK = np.array([0.55, 0.36, 0.18], np.float32)
_HEAD = np.array([0.16, 0.02, 0.012], np.float32)
_STONE = np.array([0.14, 0.13, 0.125], np.float32)
"""Linear colours of logs, matchsticks, match heads and spheres."""

_LIGHT_GAIN, _LIGHT_SOFTENING = 90.0, 0.03
"""Gain of the fire's light on objects; added to its squared distance to limit it, heights²."""

_AMBIENT = 0.01
"""Light on objects where no fire lights them, so that they are not black."""


@dataclass(frozen=True, slots=True)
class IntruderBody:
    """An intruder: all points within ``radius`` of a line segment that moves along keyframes.

    Attributes:
        times: (k,) of the keyframes, s, ascending.
        positions: (k, 3) position of its middle (a match: its head) at these times, heights.
        axis: (3,) vector from there to its far end, heights; zero for a sphere.
        centred: Whether it extends equally far the other way (a log).
        radius: Radius, heights.
        strength: Strength of its force; 1 is about the lift of a flame.
        visible: Whether it is drawn.
        is_match: Whether it is a match, whose head catches fire.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    axis: NDArray[np.float64]
    centred: bool
    radius: float
    strength: float
    visible: bool
    is_match: bool

    @classmethod
    def of(cls, intruder: Intruder) -> Self:
        """Read an intruder from a recipe."""
        keyframes = [(moment.t, moment.at) for moment in intruder.keyframes]
        if intruder.at is not None:
            keyframes = [(0.0, intruder.at)]
        extents = {"sphere": 0.0, "log": intruder.length / 2, "match": intruder.length}
        return cls(
            times=np.array([t for t, _ in keyframes]),
            positions=np.array([position for _, position in keyframes]),
            axis=extents[intruder.shape] * _direction(intruder.angle, intruder.tilt),
            centred=intruder.shape == "log",
            radius=intruder.radius,
            strength=intruder.strength,
            visible=intruder.draw,
            is_match=intruder.shape == "match",
        )

    def position(self, time: float) -> NDArray[np.float64]:
        """Return the position (3,) at ``time`` s, eased in and out between keyframes."""
        if time <= self.times[0]:
            return np.array(self.positions[0])
        if time >= self.times[-1]:
            return np.array(self.positions[-1])
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        share = (time - self.times[k]) / (self.times[k + 1] - self.times[k])
        share = share * share * (3 - 2 * share)
        start, end = self.positions[k : k + 2]
        return np.asarray(start + share * (end - start))

    def ends(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return both ends (3,) of its middle line at ``time`` s, heights."""
        position = self.position(time)
        return (position - self.axis if self.centred else position), position + self.axis

    def acceleration(self, time: float, x: Vectors) -> Vectors:
        """Return the acceleration of nodes at ``x``, away from the middle line, heights/s²."""
        start, end = self.ends(time)
        away = x - _nearest_on_segment(start, end, x)
        distance = np.maximum(lengths(away), 1e-6)
        outside = (distance - self.radius) / (self.radius + _FALLOFF)
        strength = self.strength * _SURFACE_ACCELERATION * np.exp(-np.maximum(outside, -1.0))
        return np.asarray(away * (strength / distance)[..., None])


def _direction(angle: float, tilt: float) -> NDArray[np.float64]:
    """Return the unit vector (3,) at ``angle`` seen from above and ``tilt`` upwards, degrees."""
    azimuth, elevation = math.radians(angle), math.radians(tilt)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def _nearest_on_segment(
    start: NDArray[np.float64], end: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the points (..., 3) of a line segment that are nearest to ``x``."""
    along = end - start
    square = float((along * along).sum())
    if square == 0:
        return np.broadcast_to(start, x.shape)
    share = np.clip(np.einsum("...d,d->...", x - start, along) / square, 0.0, 1.0)
    return np.asarray(start + share[..., None] * along)


@dataclass(frozen=True, slots=True)
class IntruderBuffers:
    """Intruders drawn for one camera: coverage, depth, normal and colour of each sample.

    Attributes:
        coverage: (height, width) 1 where an intruder is, else 0.
        depth: (height, width) depth along the view, heights; infinite where no intruder is.
        normal: (height, width, 3) surface normal: right, down and away from the camera.
        colour: (height, width, 3) linear.
        scale: Samples per frame height.
    """

    coverage: Plane
    depth: Plane
    normal: NDArray[np.float32]
    colour: NDArray[np.float32]
    scale: float

    @classmethod
    def blank(cls, height: int, width: int, scale: float) -> Self:
        """Return empty buffers."""
        size = height, width
        depth = np.full(size, np.inf, np.float32)
        normal, colour = (np.zeros((*size, 3), np.float32) for _ in range(2))
        return cls(np.zeros(size, np.float32), depth, normal, colour, scale)

    @property
    def is_empty(self) -> bool:
        """Whether no intruder is visible."""
        return self.coverage.size == 0

    def hides(self, sample: NDArray[np.intp], depth: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether an intruder hides what is at ``depth`` in each ``sample``."""
        return np.asarray(depth >= self.depth.ravel()[sample])

    def lit_by(
        self, flame: NDArray[np.float32], centre: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return the light (height, width, 3) of the intruders, lit by a point light at ``centre``
        (samples right, samples down, depth in heights) with the total light of ``flame``."""
        rows, columns = np.nonzero(self.coverage)
        lit = np.zeros((*self.coverage.shape, 3), np.float32)
        if not rows.size:
            return lit
        to_light = np.stack([
            (centre[0] - columns) / self.scale,
            (centre[1] - rows) / self.scale,
            centre[2] - self.depth[rows, columns],
        ], axis=1)  # fmt: skip
        distance = np.sqrt((to_light * to_light).sum(axis=1))
        normal = self.normal[rows, columns]
        cosine = np.einsum("nd,nd->n", normal, to_light) / np.maximum(distance, 1e-6)
        # A flame is large: it also lights surfaces that face slightly away from its centre.
        facing = np.maximum(cosine + 0.35, 0) / 1.35
        shade = facing * _LIGHT_SOFTENING / (distance * distance + _LIGHT_SOFTENING)
        total = flame.sum(axis=(0, 1)) / self.scale**2
        light = total[None] * np.float32(_LIGHT_GAIN) * shade[:, None] + np.float32(_AMBIENT)
        lit[rows, columns] = self.colour[rows, columns] * light
        return lit


def draw_intruders(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, samples: int
) -> IntruderBuffers:
    """Draw visible ``bodies`` at ``time`` s, with ``samples`` per pixel along each axis."""
    visible = [body for body in bodies if body.visible]
    if not visible:
        return IntruderBuffers.blank(0, 0, 1.0)
    scale = float(camera.height * samples)
    buffers = IntruderBuffers.blank(camera.height * samples, camera.width * samples, scale)
    for body in visible:
        ends = camera.project(np.stack(body.ends(time)))
        ends[:, :2] *= samples
        _draw_capsule(buffers, body, ends)
    return buffers


def _draw_capsule(buffers: IntruderBuffers, body: IntruderBody, ends: NDArray[np.float64]) -> None:
    """Draw a body between its projected ``ends`` (2, 3): samples right, samples down, depth."""
    radius = body.radius * buffers.scale
    height, width = buffers.coverage.shape
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
    thickness = 1 - dx * dx - dy * dy
    bulge = np.sqrt(np.maximum(thickness, 0.0))
    depth = ends[0, 2] + share * (ends[1, 2] - ends[0, 2]) - bulge * body.radius
    box = slice(top, bottom), slice(left, right)
    inside = (thickness > 0) & (depth < buffers.depth[box])
    buffers.coverage[box][inside] = 1
    buffers.depth[box][inside] = depth[inside]
    buffers.normal[box][inside] = np.stack([dx, dy, -bulge], axis=-1)[inside]
    side = (dx * along[1] - dy * along[0]) / math.sqrt(square)
    colours = _surface_colours(body, share, side, math.sqrt(square) / radius)
    buffers.colour[box][inside] = colours[inside]


def _surface_colours(
    body: IntruderBody, share: NDArray[np.float64], side: NDArray[np.float64], radii: float
) -> NDArray[np.float32]:
    """Return linear colours (..., 3) at ``share`` (0..1) along a body and ``side`` (-1..1) across
    it; ``radii`` is its length in the frame, relative to its radius."""
    if body.is_match:
        head = np.clip((3.0 - share * radii) / 0.7, 0.0, 1.0)[..., None]
        return np.asarray(_STICK + (_HEAD - _STICK) * head, np.float32)
    if not body.axis.any():
        return np.broadcast_to(_STONE, (*share.shape, 3))
    # A log has ridges of bark along it; its middle, which is in the fire, is charred.
    ridges = np.sin(13 * side + 1.3 * np.sin(1.2 * share * radii + 4 * side)) ** 2
    charred = 0.25 + 0.75 * np.clip(np.abs(2 * share - 1) * 1.3 - 0.2, 0, 1)
    return np.asarray(_WOOD * ((0.45 + 0.55 * ridges) * charred)[..., None], np.float32)
