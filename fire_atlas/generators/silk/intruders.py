"""Intruders (section 6): objects in the flame, as fields of force and as pictures.

No collisions are computed: an intruder pushes the sheets away from its middle line. Opaque ones are
also drawn, into a depth buffer in front of and behind the flames, and lit by them.
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
"""Distance beyond its own radius in which an intruder's force falls to 1/e, heights."""

_SURFACE_ACCELERATION = 12.0
"""Acceleration at the surface of an intruder of strength 1, heights/s²."""

_WOOD = np.array([0.16, 0.085, 0.04], np.float32)
_STICK = np.array([0.55, 0.36, 0.18], np.float32)
_HEAD = np.array([0.16, 0.02, 0.012], np.float32)
_STONE = np.array([0.14, 0.13, 0.125], np.float32)
"""Linear colours of logs, matches, the heads of matches, and spheres."""

_LIGHT_GAIN, _LIGHT_SOFTENING = 90.0, 0.03
"""Brightness of what the fire lights, and heights² added to the square of its distance."""

_AMBIENT = 0.01
"""Light in the absence of fire, so that objects are not black holes."""


@dataclass(frozen=True, slots=True)
class IntruderBody:
    """A capsule: all points within ``radius`` of a line segment, which moves along keyframes.

    Attributes:
        times: (k,) of the keyframes, s, ascending.
        positions: (k, 3) of its middle (of a match: its head) at these times, heights.
        axis: (3,) from there to its far end, heights; zero for a sphere.
        centred: Whether it extends as far to the other side.
        radius: heights.
        strength: Of its force; 1 is about the lift of a flame.
        visible: Whether it is drawn.
        is_match: Whether its head catches fire.
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
        """Take it from a recipe."""
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
        """Position (3,) at ``time`` s, eased in and out between keyframes."""
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
        """Both ends (3,) of its middle line at ``time`` s, heights."""
        position = self.position(time)
        return (position - self.axis if self.centred else position), position + self.axis

    def acceleration(self, time: float, x: Vectors) -> Vectors:
        """Acceleration of the nodes at ``x`` away from the middle line, heights/s²."""
        start, end = self.ends(time)
        away = x - _nearest_on_segment(start, end, x)
        distance = np.maximum(lengths(away), 1e-6)
        outside = (distance - self.radius) / (self.radius + _FALLOFF)
        strength = self.strength * _SURFACE_ACCELERATION * np.exp(-np.maximum(outside, -1.0))
        return np.asarray(away * (strength / distance)[..., None])


def _direction(angle: float, tilt: float) -> NDArray[np.float64]:
    """Unit vector (3,) at ``angle`` seen from above and ``tilt`` above the horizon, degrees."""
    azimuth, elevation = math.radians(angle), math.radians(tilt)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def _nearest_on_segment(
    start: NDArray[np.float64], end: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Points (..., 3) of a line segment that are nearest to ``x``."""
    along = end - start
    square = float((along * along).sum())
    if square == 0:
        return np.broadcast_to(start, x.shape)
    share = np.clip(np.einsum("...d,d->...", x - start, along) / square, 0.0, 1.0)
    return np.asarray(start + share[..., None] * along)


@dataclass(frozen=True, slots=True)
class IntruderBuffers:
    """The drawn intruders as one camera sees them: per sample coverage, depth, normal and colour.

    Attributes:
        coverage: (height, width) 1 where something opaque is.
        depth: (height, width) distance away from the camera, heights; infinite where nothing is.
        normal: (height, width, 3) of the surface: right, down and away from the camera.
        colour: (height, width, 3) linear.
        scale: Samples to a frame height.
    """

    coverage: Plane
    depth: Plane
    normal: NDArray[np.float32]
    colour: NDArray[np.float32]
    scale: float

    @classmethod
    def blank(cls, height: int, width: int, scale: float) -> Self:
        """Return buffers in which nothing is drawn yet."""
        size = height, width
        depth = np.full(size, np.inf, np.float32)
        normal, colour = (np.zeros((*size, 3), np.float32) for _ in range(2))
        return cls(np.zeros(size, np.float32), depth, normal, colour, scale)

    @property
    def is_empty(self) -> bool:
        """Whether no intruder is visible."""
        return self.coverage.size == 0

    def hides(self, sample: NDArray[np.intp], depth: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether an intruder is in front of what lies at ``depth`` in these samples."""
        return np.asarray(depth >= self.depth.ravel()[sample])

    def lit_by(
        self, flame: NDArray[np.float32], centre: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Light (height, width, 3) of the intruders in that of the flame, which comes from its
        ``centre``: samples right, samples down, depth in heights."""
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
        # A flame is large: it lights surfaces that face a little away from its centre.
        facing = np.maximum(cosine + 0.35, 0) / 1.35
        shade = facing * _LIGHT_SOFTENING / (distance * distance + _LIGHT_SOFTENING)
        total = flame.sum(axis=(0, 1)) / self.scale**2
        light = total[None] * np.float32(_LIGHT_GAIN) * shade[:, None] + np.float32(_AMBIENT)
        lit[rows, columns] = self.colour[rows, columns] * light
        return lit


def draw_intruders(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, finer: int
) -> IntruderBuffers:
    """Draw the visible bodies at ``time`` s, with ``finer`` samples to a px along each axis."""
    visible = [body for body in bodies if body.visible]
    if not visible:
        return IntruderBuffers.blank(0, 0, 1.0)
    scale = float(camera.height * finer)
    buffers = IntruderBuffers.blank(camera.height * finer, camera.width * finer, scale)
    for body in visible:
        ends = camera.project(np.stack(body.ends(time)))
        ends[:, :2] *= finer
        _draw_capsule(buffers, body, ends)
    return buffers


def _draw_capsule(buffers: IntruderBuffers, body: IntruderBody, ends: NDArray[np.float64]) -> None:
    """Draw a body between its projected ``ends`` (2, 3): samples right and down, depth."""
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
    """Linear colour (..., 3) at ``share`` (0..1) of a body's middle line and ``side`` (-1..1) of
    it; ``radii`` is the body's length as seen, relative to its radius."""
    if body.is_match:
        head = np.clip((3.0 - share * radii) / 0.7, 0.0, 1.0)[..., None]
        return np.asarray(_STICK + (_HEAD - _STICK) * head, np.float32)
    if not body.axis.any():
        return np.broadcast_to(_STONE, (*share.shape, 3))
    # Bark has ridges along a log; its middle, in the fire, is charred.
    ridges = np.sin(13 * side + 1.3 * np.sin(1.2 * share * radii + 4 * side)) ** 2
    charred = 0.25 + 0.75 * np.clip(np.abs(2 * share - 1) * 1.3 - 0.2, 0, 1)
    return np.asarray(_WOOD * ((0.45 + 0.55 * ridges) * charred)[..., None], np.float32)
