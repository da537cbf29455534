"""Draw intruders: spheres, charred logs and matches, lit by the flames, with cracks that glow.

Every sample's line of sight is cut with the bodies, so that a log looks the same from all sides.
Positions and normals are in camera axes (right, down, away from the camera), heights.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.silk.intruders import IntruderBody

Points = NDArray[np.float64]

_BARK = np.array([0.085, 0.048, 0.026])
_CHAR = np.array([0.012, 0.010, 0.009])
_CUT = np.array([0.20, 0.12, 0.06])
_STICK = np.array([0.55, 0.36, 0.18])
_HEAD = np.array([0.16, 0.02, 0.012])
_STONE = np.array([0.14, 0.13, 0.125])
"""Linear colours of bark, charred wood, the ends of logs, matchsticks, match heads and spheres."""

_GLOW = np.array([2.2, 0.36, 0.03])
"""Light of wood that glows, before exposure: that of a black body of about 1300 K."""

_LIGHT_GAIN, _LIGHT_SOFTENING = 90.0, 0.03
"""Gain of the fire's light on objects; added to its squared distance to limit it, heights²."""

_AMBIENT = 0.01
"""Light on objects where no fire lights them, so that they are not black."""

_CONTACT = 0.03
"""Distance in front of a surface over which flame fades into it, heights."""

_GRAIN_WAVES = 24
"""Number of waves summed for the bark, and for the cracks."""


@dataclass(frozen=True, slots=True)
class Hearth:
    """The place where a fire burns, which chars and heats the logs in it.

    Attributes:
        centre: (3,) world position of its middle, heights.
        radius: Distance from there within which logs glow, heights.
        phase: Part of the loop that has passed, 0..1, by which the glow wanders.
        beats: Number of times the glow swells in a loop.
    """

    centre: NDArray[np.float64]
    radius: float
    phase: float
    beats: int


@dataclass(frozen=True, slots=True)
class IntruderBuffers:
    """Intruders drawn for one camera.

    Attributes:
        coverage: (height, width) 1 where an intruder is, else 0.
        position: (height, width, 3) position of its surface; infinitely deep where none is.
        normal: (height, width, 3) surface normal.
        colour: (height, width, 3) linear.
        glow: (height, width, 3) light of its own, linear.
    """

    coverage: Plane
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    colour: NDArray[np.float32]
    glow: NDArray[np.float32]

    @classmethod
    def blank(cls, height: int, width: int) -> Self:
        """Return empty buffers."""
        position = np.zeros((height, width, 3), np.float32)
        position[..., 2] = np.inf
        normal, colour, glow = (np.zeros((height, width, 3), np.float32) for _ in range(3))
        return cls(np.zeros((height, width), np.float32), position, normal, colour, glow)

    @property
    def is_empty(self) -> bool:
        """Whether no intruder is visible."""
        return self.coverage.size == 0

    def shows(self, sample: NDArray[np.intp], depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how much is seen, 0..1, of flame at ``depth`` in each ``sample``: none of what is
        behind an intruder, and little of what touches it."""
        before = self.position[..., 2].ravel()[sample] - depth
        return np.asarray(smooth_step(before / np.float32(_CONTACT)), np.float32)

    def lit_by(self, total: NDArray[np.float64], centre: Points) -> NDArray[np.float32]:
        """Return the light (height, width, 3) of the intruders: their own, and that of a flame of
        ``total`` light (3,), in heights², around ``centre`` (3,)."""
        covered = np.nonzero(self.coverage)
        lit = self.glow.copy()
        if not covered[0].size:
            return lit
        to_light = centre - self.position[covered]
        distance = np.sqrt((to_light * to_light).sum(axis=1))
        cosine = np.einsum("nd,nd->n", self.normal[covered], to_light) / np.maximum(distance, 1e-6)
        # A flame is large: it also lights surfaces that face slightly away from its centre.
        facing = np.maximum(cosine + 0.35, 0) / 1.35
        shade = facing * _LIGHT_SOFTENING / (distance * distance + _LIGHT_SOFTENING)
        light = total * _LIGHT_GAIN * shade[:, None] + _AMBIENT
        lit[covered] += (self.colour[covered] * light).astype(np.float32)
        return lit


def draw_intruders(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, samples: int, hearth: Hearth
) -> IntruderBuffers:
    """Draw visible ``bodies`` at ``time`` s, with ``samples`` per pixel along each axis."""
    visible = [(i, body) for i, body in enumerate(bodies) if body.visible]
    if not visible:
        return IntruderBuffers.blank(0, 0)
    buffers = IntruderBuffers.blank(camera.height * samples, camera.width * samples)
    for i, body in visible:
        _draw(buffers, body, i, body.ends(time), camera, samples, hearth)
    return buffers


def _draw(
    buffers: IntruderBuffers,
    body: IntruderBody,
    number: int,
    ends: tuple[Points, Points],
    camera: Camera,
    samples: int,
    hearth: Hearth,
) -> None:
    """Draw the body ``number`` between its ``ends``, where it is in front of those drawn before."""
    box = _box(body, ends, camera, samples, buffers.coverage.shape)
    if box is None:
        return
    y, x = np.mgrid[box[0], box[1]] + 0.5
    start, change = camera.rays(x / samples, y / samples)
    hit = _intersect(body, camera.view_of(np.stack(ends)), start, change)
    near = hit.depth < buffers.position[box][..., 2]
    at = np.nonzero(near)
    target = at[0] + box[0].start, at[1] + box[1].start
    position = start[at] + hit.depth[at][:, None] * change[at]
    surface = _surface(body, number, ends, camera, position, hit.normal[at], hearth)
    buffers.coverage[target] = 1
    buffers.position[target] = position
    buffers.normal[target] = surface.normal
    buffers.colour[target] = surface.colour
    buffers.glow[target] = surface.glow


def _box(
    body: IntruderBody,
    ends: tuple[Points, Points],
    camera: Camera,
    samples: int,
    size: tuple[int, ...],
) -> tuple[slice, slice] | None:
    """Return rows and columns of the samples that a body may cover; None if it covers none."""
    seen = camera.project(np.stack(ends))
    nearest = camera.magnification(seen[:, 2] - body.radius)
    reach = (body.radius * camera.scale * nearest * samples)[:, None]
    low = np.floor((seen[:, :2] * samples - reach).min(axis=0)).astype(int) - 1
    high = np.ceil((seen[:, :2] * samples + reach).max(axis=0)).astype(int) + 1
    left, top = max(int(low[0]), 0), max(int(low[1]), 0)
    right, bottom = min(int(high[0]), size[1]), min(int(high[1]), size[0])
    if left >= right or top >= bottom:
        return None
    return slice(top, bottom), slice(left, right)


@dataclass(frozen=True, slots=True)
class _Hit:
    """Where lines of sight meet a body: depth (...), infinite for a miss, and normal (..., 3)."""

    depth: Points
    normal: Points


def _intersect(body: IntruderBody, ends: Points, start: Points, change: Points) -> _Hit:
    """Cut lines of sight with a body between ``ends`` (2, 3): logs have flat ends, others round."""
    along = ends[1] - ends[0]
    length = float(np.sqrt((along * along).sum()))
    axis = along / length if length else np.array([1.0, 0.0, 0.0])
    best = _Hit(np.full(start.shape[:-1], np.inf), np.zeros_like(start))
    if length:
        best = _nearer(best, _side(axis, length, body.radius, start - ends[0], change))
    for end, outwards in ((ends[0], -axis), (ends[1], axis)):
        if body.centred and length:
            best = _nearer(best, _disc(outwards, body.radius, start - end, change))
        else:
            best = _nearer(best, _ball(body.radius, start - end, change))
    return best


def _nearer(one: _Hit, other: _Hit) -> _Hit:
    is_nearer = other.depth < one.depth
    normal = np.where(is_nearer[..., None], other.normal, one.normal)
    return _Hit(np.where(is_nearer, other.depth, one.depth), normal)


def _first_root(square: Points, half: Points, rest: Points) -> Points:
    """Return the smaller root of square·z² + 2·half·z + rest = 0; infinite if there is none."""
    inside = half * half - square * rest
    is_hit = (inside > 0) & (square > 1e-12)
    root = (-half - np.sqrt(np.where(is_hit, inside, 0.0))) / np.where(is_hit, square, 1.0)
    return np.where(is_hit, root, np.inf)


def _ball(radius: float, start: Points, change: Points) -> _Hit:
    square, half = (change * change).sum(axis=-1), (start * change).sum(axis=-1)
    depth = _first_root(square, half, (start * start).sum(axis=-1) - radius * radius)
    return _hit(depth, start, change, lambda at: at / radius)


def _side(axis: Points, length: float, radius: float, start: Points, change: Points) -> _Hit:
    """Cut lines of sight with a cylinder from the origin along ``axis``."""
    across = start - (start @ axis)[..., None] * axis
    turn = change - (change @ axis)[..., None] * axis
    square, half = (turn * turn).sum(axis=-1), (across * turn).sum(axis=-1)
    depth = _first_root(square, half, (across * across).sum(axis=-1) - radius * radius)
    found = np.where(np.isfinite(depth), depth, 0.0)
    share = (start + found[..., None] * change) @ axis
    depth = np.where((share >= 0) & (share <= length), depth, np.inf)
    return _hit(depth, across, turn, lambda at: at / radius)


def _disc(axis: Points, radius: float, start: Points, change: Points) -> _Hit:
    """Cut lines of sight with a disc around the origin that faces along ``axis``."""
    slope = change @ axis
    is_front = slope < -1e-9
    depth = -(start @ axis) / np.where(is_front, slope, 1.0)
    at = start + depth[..., None] * change
    inside = is_front & ((at * at).sum(axis=-1) <= radius * radius)
    return _hit(np.where(inside, depth, np.inf), start, change, lambda at: np.zeros_like(at) + axis)


def _hit(depth: Points, start: Points, change: Points, normal: Callable[[Points], Points]) -> _Hit:
    """Return hits at ``depth``, with the normal of each place start + depth · change."""
    at = start + np.where(np.isfinite(depth), depth, 0.0)[..., None] * change
    return _Hit(depth, normal(at))


@dataclass(frozen=True, slots=True)
class _Surface:
    """Normal, colour and own light of n places on a body: each (n, 3)."""

    normal: Points
    colour: Points
    glow: Points


def _surface(
    body: IntruderBody,
    number: int,
    ends: tuple[Points, Points],
    camera: Camera,
    position: Points,
    normal: Points,
    hearth: Hearth,
) -> _Surface:
    """Return the surface of the body ``number`` at ``position`` (n, 3)."""
    dark = np.zeros_like(position)
    if not body.axis.any():
        return _Surface(normal, dark + _STONE, dark)
    along = camera.view_of(body.axis / np.sqrt((body.axis * body.axis).sum()))
    from_end = position - camera.view_of(ends[0])
    share = from_end @ along / body.radius
    if body.is_match:
        head = np.clip((3.0 - share) / 0.7, 0.0, 1.0)[:, None]
        return _Surface(normal, _STICK + (_HEAD - _STICK) * head, dark)
    # Two directions across the log that turn with it, so that its bark is the same from any side.
    level = camera.view_of(_level_across(body.axis))
    angle = np.arctan2(from_end @ np.cross(along, level), from_end @ level)
    away = position - camera.view_of(hearth.centre)
    distance = np.sqrt((away * away).sum(axis=1)) / hearth.radius
    heat = smooth_step(1.3 - distance)
    across = from_end - (from_end @ along)[:, None] * along
    ring = np.sqrt((across * across).sum(axis=1)) / body.radius
    return _wood(number, (share, angle, ring), normal, (along, level), heat, hearth)


def _level_across(axis: Points) -> Points:
    """Return a unit vector across ``axis``, level unless the axis is upright."""
    across = np.array([-axis[1], axis[0], 0.0])
    length = float(np.sqrt((across * across).sum()))
    return across / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])


def _wood(
    number: int,
    place: tuple[Points, Points, Points],
    normal: Points,
    axes: tuple[Points, Points],
    heat: Points,
    hearth: Hearth,
) -> _Surface:
    """Return the surface of a log: bark, charred where ``heat`` is high, with cracks that glow.

    Args:
        number: Number of the log; no two have the same grain.
        place: Distance along the log, radii; angle around it, rad; and distance from its axis,
            radii: (n,) each.
        normal: (n, 3) normal of the smooth log.
        axes: Directions along the log, and across it where ``angle`` is 0.
        heat: (n,) 0..1.
        hearth: The fire.
    """
    along, level = axes
    share, angle, ring = place
    chance = generator(number, RandomStream.SHEETS, 2)
    bark, bark_along, bark_around = _grain(chance, share, angle, (0.1, 0.7), (3, 11))
    crack, crack_along, crack_around = _grain(chance, share, angle, (0.7, 2.4), (1, 5))
    is_end = np.abs(normal @ along) > 0.9
    rough = 0.10 * bark_along + 0.12 * crack_along, 0.10 * bark_around + 0.12 * crack_around
    across = -np.sin(angle)[:, None] * level + np.cos(angle)[:, None] * np.cross(along, level)
    tilt = rough[0][:, None] * along + rough[1][:, None] * across
    bumpy = np.where(is_end[:, None], normal, normal - tilt)
    bumpy /= np.sqrt((bumpy * bumpy).sum(axis=1, keepdims=True))
    furrow = np.where(
        is_end, 0.75 + 0.25 * np.sin(16 * ring), 0.45 + 0.55 * _unit(0.5 + 0.6 * bark)
    )
    plain = np.where(is_end[:, None], _CUT, _BARK)
    charred = _unit(1.5 * heat + np.where(is_end, 0.0, 0.25 * bark))[:, None]
    colour = (plain + (_CHAR - plain) * charred) * furrow[:, None]
    wander = np.sin(2 * np.pi * hearth.beats * hearth.phase + 2 * bark + 0.8 * share)
    glow = _glow(crack, bark, heat) * (0.85 + 0.15 * wander)
    return _Surface(bumpy, colour, _GLOW * np.where(is_end, 0.15 * heat, glow)[:, None])


def _unit(values: Points) -> Points:
    """Return ``values`` limited to 0..1."""
    return np.clip(values, 0.0, 1.0)


def _glow(crack: Points, bark: Points, heat: Points) -> Points:
    """Return how brightly wood glows: in cracks between its scales, wider where it is hotter."""
    width = 0.06 + 0.24 * heat
    line = np.clip(1 - np.abs(crack + 0.2 * bark) / width, 0, 1) ** 1.5
    patch = np.clip(1.6 * heat - 0.9 + 0.45 * bark, 0, 1)
    return np.asarray(heat * (line + 0.4 * patch))


def _grain(
    chance: np.random.Generator,
    share: Points,
    angle: Points,
    frequencies: tuple[float, float],
    turns: tuple[int, int],
) -> tuple[Points, Points, Points]:
    """Return noise (rms 1) on a log, and its slopes along and around it, per radius.

    Args:
        chance: Source of random numbers.
        share, angle: (n,) distance along the log, radii, and angle around it, rad.
        frequencies: Least and greatest frequency along it, rad per radius.
        turns: Least and greatest number of waves around it.
    """
    along = chance.uniform(*frequencies, _GRAIN_WAVES) * chance.choice([-1, 1], _GRAIN_WAVES)
    around = chance.integers(turns[0], turns[1] + 1, _GRAIN_WAVES)
    phase = chance.uniform(0, 2 * np.pi, _GRAIN_WAVES)
    theta = share[:, None] * along + angle[:, None] * around + phase
    size = math.sqrt(2 / _GRAIN_WAVES)
    slope = np.cos(theta) * size
    return (np.sin(theta) * size).sum(axis=1), slope @ along, slope @ around.astype(np.float64)
