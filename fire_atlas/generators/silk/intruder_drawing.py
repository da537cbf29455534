"""Draw intruders, lit by the flames: logs char and glow in their cracks, wicks and matches glow.

Logs and wraps are rough: their radius varies over them, also at their outlines.

Every sample's line of sight is cut with the bodies, so that a log looks the same from all sides.
Positions and normals are in camera axes (right, down, away from the camera), heights.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Window
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.silk.intruders import IntruderBody

Points = NDArray[np.float64]

_BARK = np.array([0.150, 0.082, 0.042])
CHAR = np.array([0.020, 0.017, 0.015])
_CUT = np.array([0.20, 0.12, 0.06])
_ASH = np.array([0.33, 0.31, 0.29])
_CLOTH = np.array([0.13, 0.095, 0.06])
_STICK = np.array([0.55, 0.36, 0.18])
_HEAD = np.array([0.16, 0.02, 0.012])
_STONE = np.array([0.14, 0.13, 0.125])
_WAX = np.array([0.72, 0.56, 0.35])
_COTTON = np.array([0.30, 0.24, 0.17])
"""Linear colours of bark, charred wood, the ends of logs, ash, cloth, matchsticks, match heads,
spheres, wax and wicks that are not charred."""

_GLOW = np.array([2.2, 0.36, 0.03])
"""Light of wood that glows, before exposure: that of a black body of about 1300 K."""

_LIGHT_GAIN, _LIGHT_SOFTENING = 90.0, 0.03
"""Gain of the fire's light on objects; added to its squared distance to limit it, heights²."""

_UP = np.array([0.0, 0.0, 1.0])

_SKY = 0.2
"""Light of the sky on what faces straight up, half of it on what faces sideways, none on what faces
down: objects have a form by day, and by night where no fire lights them."""

_HEAD_LENGTH, _STICK_RADIUS = 1.6, 0.66
"""Length of a match's head between its round ends, and radius of the stick behind it, radii."""

_FLARE_RADII, _FLARE_TIME, _CHAR_SPEED = 6.0, 0.4, 1.5
"""Length of what burns at first of a match, radii; time until most of it is charred, s; and speed
at which the rest chars, radii/s."""

_EMBER = 0.06
"""How brightly the charred head of a match glows, as a part of a log's cracks: beside its flame it
is black to the eye, with a red gleam."""

_TRANSLUCENCY = 2.5
"""How much more the light that comes through wax beside the flame counts than the way it faces."""

CONTACT = 0.018
"""Distance in front of a surface over which flame fades into it, heights."""

_EDGE_RAYS = ((-0.375, -0.125), (0.125, -0.375), (0.375, 0.125), (-0.125, 0.375))
"""Lines of sight through a sample at the edge of a body: right and down of its middle, samples. No
two are in one row or column, for upright and level edges."""

_LOG_RELIEF, _WRAP_RELIEF = 0.3, 0.22
"""How much smaller the radius is in a furrow of a log and between turns of a wrap, radii."""

_SCORCHED = 0.6
"""How near to the fire wood glows, relative to how near it is charred."""

_RELIEF_STEPS = 3
"""How often the radius is looked up where a line of sight meets the body of that radius."""

_BAND = 0.62
"""Width of a band of cloth around a wrap, radii."""

_GRAIN_WAVES = 24
"""Number of waves summed for the bark, and for the cracks."""


@dataclass(frozen=True, slots=True)
class Hearth:
    """The place where a fire burns, which chars and heats the logs and wicks in it.

    Attributes:
        centre: World position (x, y, z) of its middle, heights.
        radius: Distance from there within which logs glow, heights.
        phase: Part of the loop that has passed, 0..1, by which the glow wanders.
        beats: Number of times the glow swells in a loop.
        burnt: Time for which each intruder has burnt itself, s: 0 except for matches.
    """

    centre: tuple[float, float, float]
    radius: float
    phase: float
    beats: int
    burnt: tuple[float, ...]

    @property
    def at_rest(self) -> Self:
        """The same place at the beginning of the loop."""
        return replace(self, phase=0.0)

    def heat(self, distance: Points) -> Points:
        """Return how hot it makes things at ``distance`` from its middle, heights: 0..1."""
        return smooth_step(1.6 - distance / self.radius)

    def beat(self, shift: Points) -> Points:
        """Return a factor around 1 by which a glow swells, ``shift`` rad later than elsewhere."""
        return np.asarray(0.85 + 0.15 * np.sin(2 * np.pi * self.beats * self.phase + shift))


@dataclass(frozen=True, slots=True)
class IntruderBuffers:
    """Intruders drawn for one camera.

    Attributes:
        coverage: (height, width) fraction of each sample that an intruder covers, 0..1.
        depth: (height, width) depth of its surface, heights; infinite where none is.
        covered: Rows and columns (n,) of the samples that an intruder covers, if only in part.
        position: (n, 3) position of its surface there.
        normal: (n, 3) surface normal.
        colour: (n, 3) linear.
        glow: (n, 3) light of its own, linear.
    """

    coverage: Plane
    depth: Plane
    covered: tuple[NDArray[np.intp], NDArray[np.intp]]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    colour: NDArray[np.float32]
    glow: NDArray[np.float32]

    @property
    def is_empty(self) -> bool:
        """Whether no intruder is visible."""
        return self.covered[0].size == 0

    def shows(
        self, window: Window, sample: NDArray[np.intp], depth: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return how much is seen, 0..1, of flame at ``depth`` in each ``sample`` of a window: none
        of what is behind an intruder, and little of what touches it."""
        covers = self.coverage[window.slices].ravel()[sample]
        shown, here = np.ones_like(depth), np.flatnonzero(covers)
        before = self.depth[window.slices].ravel()[sample[here]] - depth[here]
        shown[here] -= (1 - smooth_step(before / np.float32(CONTACT))) * covers[here]
        return shown

    def lit_by(
        self, lights: Sequence[tuple[NDArray[np.float64], Points]], camera: Camera
    ) -> NDArray[np.float32]:
        """Return the light (n, 3) of the intruders where they cover samples: their own, that of the
        sky, and that of flames.

        Args:
            lights: Of each flame its light (3,), in heights², and the place (3,) that it comes
                from.
            camera: That they were drawn for.
        """
        faces_up = 0.5 + 0.5 * (self.normal @ camera.view_of(_UP))
        received = np.repeat(_SKY * faces_up[:, None], 3, axis=1)
        for total, centre in lights:
            to_light = centre - self.position
            square = (to_light * to_light).sum(axis=1)
            cosine = np.einsum("nd,nd->n", self.normal, to_light)
            cosine /= np.maximum(np.sqrt(square), 1e-6)
            # A flame is large: it also lights surfaces that face slightly away from its centre.
            facing = np.maximum(cosine + 0.35, 0) / 1.35
            shade = facing * _LIGHT_SOFTENING / (square + _LIGHT_SOFTENING)
            received += total * _LIGHT_GAIN * shade[:, None]
        light = self.glow + (self.colour * received).astype(np.float32)
        return np.asarray(light * self.coverage[self.covered][:, None], np.float32)


def draw_intruders(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, samples: int, hearth: Hearth
) -> IntruderBuffers:
    """Draw visible ``bodies`` at ``time`` s, with ``samples`` per pixel along each axis."""
    moments = tuple(_moment(body, time) for body in bodies)
    burnt = zip(bodies, hearth.burnt, strict=True)
    chars = replace(hearth, burnt=tuple(time if body.is_match else 0.0 for body, time in burnt))
    drawn, surfaces = _drawn(tuple(bodies), moments, camera, samples, chars.at_rest)
    glow = [surface.glow(hearth) for surface in surfaces]
    return replace(drawn, glow=as_plane(np.concatenate([np.zeros((0, 3)), *glow])))


def intruder_coverage(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, samples: int
) -> Plane:
    """Return ``IntruderBuffers.coverage`` of the visible ``bodies`` at ``time`` s."""
    coverage = np.zeros((camera.height * samples, camera.width * samples), np.float32)
    for i, body in enumerate(bodies):
        outline = _outline(body, i, _moment(body, time), camera, samples) if body.visible else None
        if outline is not None:
            np.maximum(coverage[outline.box], outline.share, out=coverage[outline.box])
    return coverage


def surface_depth(
    bodies: Sequence[IntruderBody], time: float, camera: Camera, x: Points, y: Points
) -> Points:
    """Return the depth (n,), heights, of the visible ``bodies`` at ``time`` s behind places (n,) of
    the frame, px; infinite where none is."""
    nearest = np.full(len(x), np.inf)
    for i, body in enumerate(bodies):
        ends = body.ends(time)
        low, high = _corners(body, ends, camera, 1)
        inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
        if body.visible and inside.any():
            seen = _SeenBody.of(body, i, ends, camera)
            depth = seen.cast(x[inside], y[inside])[0].depth
            nearest[inside] = np.minimum(nearest[inside], depth)
    return nearest


@lru_cache(maxsize=4)  # only its glow changes of what rests
def _drawn(
    bodies: tuple[IntruderBody, ...],
    times: tuple[float, ...],
    camera: Camera,
    samples: int,
    hearth: Hearth,
) -> tuple[IntruderBuffers, "list[_Surface]"]:
    """Draw the visible ``bodies``, each at its own of ``times``, s, without their glow, and return
    the parts of their surfaces that are seen, one after the other as in the buffers."""
    size = camera.height * samples, camera.width * samples
    coverage, depth = np.zeros(size, np.float32), np.full(size, np.inf, np.float32)
    nearest = np.full(size, -1, np.int16)
    outlines = dict[int, _Outline]()
    for i, (body, time) in enumerate(zip(bodies, times, strict=True)):
        outline = _outline(body, i, time, camera, samples) if body.visible else None
        if outline is None:
            continue
        outlines[i], box = outline, outline.box
        np.maximum(coverage[box], outline.share, out=coverage[box])
        is_nearer = (outline.share > 0) & (outline.hit.depth < depth[box])
        depth[box][is_nearer], nearest[box][is_nearer] = outline.hit.depth[is_nearer], i
    none = np.zeros((0, 3))
    covered, positions, surfaces = [np.zeros((2, 0), np.intp)], [none], list[_Surface]()
    for i, outline in outlines.items():
        at = np.nonzero(nearest[outline.box] == i)
        covered.append(np.stack(at) + [[part.start] for part in outline.box])
        positions.append(outline.position[at])
        surfaces.append(
            _surface(outline.seen, outline.position[at], outline.hit.normal[at], hearth)
        )
    rows, columns = np.concatenate(covered, axis=1)
    position, normal, colour = (
        as_plane(np.concatenate(parts))
        for parts in (
            positions,
            [none, *(surface.normal for surface in surfaces)],
            [none, *(surface.colour for surface in surfaces)],
        )
    )
    unlit = np.zeros_like(colour)
    drawn = IntruderBuffers(coverage, depth, (rows, columns), position, normal, colour, unlit)
    return drawn, surfaces


def _box(
    body: IntruderBody,
    ends: tuple[Points, Points],
    camera: Camera,
    samples: int,
    size: tuple[int, ...],
) -> tuple[slice, slice] | None:
    """Return rows and columns of the samples that a body may cover; None if it covers none."""
    low, high = _corners(body, ends, camera, samples)
    left, top = max(int(low[0]), 0), max(int(low[1]), 0)
    right, bottom = min(int(high[0]), size[1]), min(int(high[1]), size[0])
    if left >= right or top >= bottom:
        return None
    return slice(top, bottom), slice(left, right)


def _corners(
    body: IntruderBody, ends: tuple[Points, Points], camera: Camera, samples: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the corners (x, y) of a box, samples, outside of which a body is not seen, also beyond
    the frame."""
    seen = camera.project(np.stack(ends))
    nearest = camera.magnification(seen[:, 2] - body.radius)
    radius = (body.radius * camera.scale * nearest * samples)[:, None]
    low = np.floor((seen[:, :2] * samples - radius).min(axis=0)).astype(int) - 1
    high = np.ceil((seen[:, :2] * samples + radius).max(axis=0)).astype(int) + 1
    return low, high


@dataclass(frozen=True, slots=True)
class _Hit:
    """Where lines of sight meet a body: depth (...), infinite for a miss, and normal (..., 3)."""

    depth: Points
    normal: Points


@dataclass(frozen=True, slots=True)
class _SeenBody:
    """A body before a camera, in camera axes.

    Attributes:
        body: What it is.
        number: Its number; no two have the same grain.
        ends: (2, 3) both ends of its middle line, heights.
        along, level: (3,) unit vectors along it and across it. They turn with it, so that its grain
            is the same from any side.
        camera: The camera.
    """

    body: IntruderBody
    number: int
    ends: Points
    along: Points
    level: Points
    camera: Camera

    @classmethod
    def of(
        cls, body: IntruderBody, number: int, ends: tuple[Points, Points], camera: Camera
    ) -> Self:
        """Place a body between its ``ends``, in world coordinates, before ``camera``."""
        length = max(float(np.sqrt((body.axis * body.axis).sum())), 1e-9)
        along, level = camera.view_of(body.axis / length), camera.view_of(_level_across(body.axis))
        return cls(body, number, camera.view_of(np.stack(ends)), along, level, camera)

    def place(self, position: Points) -> tuple[Points, Points]:
        """Return where ``position`` (..., 3) is on the body: distance along it, radii, and angle
        around it, rad, (...) each."""
        from_end = position - self.ends[0]
        across = np.cross(self.along, self.level)
        angle = np.arctan2(from_end @ across, from_end @ self.level)
        return from_end @ self.along / self.body.radius, angle

    def cast(self, x: Points, y: Points) -> tuple[_Hit, Points]:
        """Return where the lines of sight through x and y (...), px, meet the body, and the
        position (..., 3) of these places."""
        start, change = self.camera.rays(x, y)
        radius = np.full(np.shape(x), self.body.radius)
        hit = _intersect(self.body, self.ends, radius, start, change)
        if self.body.is_rough:
            for _ in range(_RELIEF_STEPS):
                found = np.isfinite(hit.depth)
                position = start[found] + hit.depth[found][:, None] * change[found]
                radius[found] = self.body.radius * self._relief(*self.place(position))
                hit = _intersect(self.body, self.ends, radius, start, change)
        return hit, start + np.where(np.isfinite(hit.depth), hit.depth, 0.0)[..., None] * change

    def _relief(self, share: Points, angle: Points) -> Points:
        """Return the radius at places (n,) of a rough body, relative to its largest."""
        if self.body.shape == "wrap":
            return np.asarray(1 - _WRAP_RELIEF * (1 - _wound(self.number, share, angle)[0]))
        chance = generator(self.number, RandomStream.SHEETS, 3)
        knots, _, _ = _grain(chance, share, angle, (0.1, 1.4), (1, 6))
        return np.asarray(1 - _LOG_RELIEF * _unit(0.5 - 0.35 * knots))


def _smooth_edge(
    seen: _SeenBody,
    samples: int,
    middles: tuple[Points, Points],
    hit: _Hit,
    position: Points,
) -> Plane:
    """Return the fraction of each sample (rows, columns) that a body covers, 0..1.

    Only at its edge are more lines of sight cut with it. Where the one through the middle of a
    sample misses it and others do not, ``hit`` and ``position`` become those of one of them.
    """
    found = np.isfinite(hit.depth)
    share = found.astype(np.float32)
    square = np.ones((3, 3), np.uint8)
    edge = np.nonzero(cv2.dilate(share, square) > cv2.erode(share, square))
    share[edge] = 0
    for right, down in _EDGE_RAYS:
        x, y = (middles[0][edge] + right) / samples, (middles[1][edge] + down) / samples
        other, place = seen.cast(x, y)
        is_hit = np.isfinite(other.depth)
        share[edge] += is_hit / np.float32(len(_EDGE_RAYS))
        new = is_hit & ~np.isfinite(hit.depth[edge])
        target = edge[0][new], edge[1][new]
        hit.depth[target], hit.normal[target] = other.depth[new], other.normal[new]
        position[target] = place[new]
    return share


@dataclass(frozen=True, slots=True)
class _Outline:
    """Where a body is in a picture.

    Attributes:
        seen: The body before the camera.
        box: Rows and columns of the samples that it may cover.
        share: (rows, columns) fraction of each sample that it covers, 0..1.
        hit: Where the line of sight of each meets it.
        position: (rows, columns, 3) of that place, heights.
    """

    seen: _SeenBody
    box: tuple[slice, slice]
    share: Plane
    hit: _Hit
    position: Points


def _moment(body: IntruderBody, time: float) -> float:
    """Return the time, s, at which a body was first where it is at ``time``, if it rests."""
    return time if len(body.times) > 1 else 0.0


@lru_cache(maxsize=32)  # what rests is where it was in the frame before
def _outline(
    body: IntruderBody, number: int, time: float, camera: Camera, samples: int
) -> _Outline | None:
    """Return where the body ``number`` is at ``time`` s; None if it covers no sample."""
    ends = body.ends(time)
    box = _box(body, ends, camera, samples, (camera.height * samples, camera.width * samples))
    if box is None:
        return None
    y, x = np.mgrid[box[0], box[1]] + 0.5
    seen = _SeenBody.of(body, number, ends, camera)
    hit, position = seen.cast(x / samples, y / samples)
    share = _smooth_edge(seen, samples, (x, y), hit, position)
    return _Outline(seen, box, share, hit, position)


def _intersect(
    body: IntruderBody, ends: Points, radius: Points, start: Points, change: Points
) -> _Hit:
    """Cut lines of sight with a body between ``ends`` (2, 3), of the ``radius`` (...) that it has
    where each meets it: cylinders have flat ends, others round."""
    along = ends[1] - ends[0]
    length = float(np.sqrt((along * along).sum()))
    axis = along / length if length else np.array([1.0, 0.0, 0.0])
    if body.is_match:
        return _cut_match(ends, axis, body.radius, start, change)
    best = _Hit(np.full(start.shape[:-1], np.inf), np.zeros_like(start))
    if length:
        best = _nearer(best, _side(axis, length, radius, start - ends[0], change))
    for end, outwards in ((ends[0], -axis), (ends[1], axis)):
        if body.is_cylinder and length:
            best = _nearer(best, _disc(outwards, radius, start - end, change))
        else:
            best = _nearer(best, _ball(body.radius, start - end, change))
    return best


def _cut_match(ends: Points, axis: Points, radius: float, start: Points, change: Points) -> _Hit:
    """Cut lines of sight with a match: a long head with round ends on a thinner stick."""
    neck = ends[0] + _HEAD_LENGTH * radius * axis
    stick, length = _STICK_RADIUS * radius, math.dist(ends[0], ends[1])
    best = _side(axis, length, stick, start - ends[0], change)
    best = _nearer(best, _ball(stick, start - ends[1], change))
    best = _nearer(best, _side(axis, _HEAD_LENGTH * radius, radius, start - ends[0], change))
    for middle in (ends[0], neck):
        best = _nearer(best, _ball(radius, start - middle, change))
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


def _side(
    axis: Points, length: float, radius: float | Points, start: Points, change: Points
) -> _Hit:
    """Cut lines of sight with a cylinder from the origin along ``axis``."""
    across = start - (start @ axis)[..., None] * axis
    turn = change - (change @ axis)[..., None] * axis
    square, half = (turn * turn).sum(axis=-1), (across * turn).sum(axis=-1)
    depth = _first_root(square, half, (across * across).sum(axis=-1) - radius * radius)
    found = np.where(np.isfinite(depth), depth, 0.0)
    share = (start + found[..., None] * change) @ axis
    depth = np.where((share >= 0) & (share <= length), depth, np.inf)
    return _hit(depth, across, turn, lambda at: at / np.asarray(radius)[..., None])


def _disc(axis: Points, radius: Points, start: Points, change: Points) -> _Hit:
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
    """Normal and colour of n places on a body, (n, 3) each, and their own light (n, 3) by the
    moment of the hearth."""

    normal: Points
    colour: Points
    glow: Callable[[Hearth], Points]


def _surface(seen: _SeenBody, position: Points, normal: Points, hearth: Hearth) -> _Surface:
    """Return the surface of a body at ``position`` (n, 3)."""
    body, number, camera, along = seen.body, seen.number, seen.camera, seen.along
    dark = np.zeros_like(position)
    if not body.axis.any():
        return _Surface(normal, dark + _STONE, lambda _: dark)
    share, angle = seen.place(position)
    if body.is_match:
        return _match(number, (share, angle), normal, hearth.burnt[number])
    away = position - camera.view_of(np.array(hearth.centre))
    distance = np.sqrt((away * away).sum(axis=1))
    if body.shape == "wax":
        # Light that scatters inside comes out of the sides as if they faced the flame.
        through = np.exp(-distance / (1.2 * body.radius))[:, None]
        facing = normal + _TRANSLUCENCY * through * along
        facing /= np.sqrt((facing * facing).sum(axis=1, keepdims=True))
        return _Surface(facing, dark + _WAX, lambda _: dark)
    if body.shape == "wick":
        up = share * body.radius / math.dist(*seen.ends)
        # The flame stands above its foot, so a wick in it is hot all the way up.
        level = np.sqrt(np.maximum(distance**2 - (away @ camera.view_of(_UP)) ** 2, 0.0))
        return _wick(up, normal, hearth.heat(level))
    heat = hearth.heat(distance)
    if body.shape == "wrap":
        return _wrap(number, (share, angle), normal, along, heat)
    from_end = position - seen.ends[0]
    across = from_end - (from_end @ along)[:, None] * along
    ring = np.sqrt((across * across).sum(axis=1)) / body.radius
    scorch = hearth.heat(_SCORCHED * distance)
    axes = along, seen.level
    return _wood(number, (share, angle, ring), normal, axes, heat, scorch)


def _match(number: int, place: tuple[Points, Points], normal: Points, burnt: float) -> _Surface:
    """Return the surface of a match that has burnt for ``burnt`` s: it chars from its head on.

    Args:
        number: Number of the match; no two have the same grain.
        place: (n,) distance from its head, radii, and angle around it, rad.
        normal: (n, 3).
        burnt: Time for which it has burnt, s.
    """
    share, angle = place
    chance = generator(number, RandomStream.SHEETS, 2)
    grain, _, _ = _grain(chance, share, angle, (0.5, 2.0), (1, 4))
    head = _unit((_HEAD_LENGTH + 0.9 - share) / 0.3)[:, None]
    fresh = _STICK + (_HEAD - _STICK) * head
    charred_to = _FLARE_RADII * -math.expm1(-burnt / _FLARE_TIME) + _CHAR_SPEED * burnt - 1
    # Wood is scorched brown before it is black, in tongues along its grain.
    charred = _unit((charred_to - share - 0.5 * np.abs(grain)) / 2.5)[:, None] ** 0.7
    cooling = _unit(0.9 - share / _FLARE_RADII) ** 2 * _unit(0.5 + 0.5 * grain)
    glow = glowing(_EMBER * cooling) * charred
    return _Surface(normal, fresh + (CHAR - fresh) * charred, lambda _: glow)


def glowing(amount: Points) -> Points:
    """Return the light (n, 3) of wood that glows by ``amount`` (n,): less is redder."""
    heat = _unit(amount)[:, None]
    return np.asarray(_GLOW * heat ** np.array([1.0, 1.5, 2.0]))


def _wick(up: Points, normal: Points, heat: Points) -> _Surface:
    """Return the surface of a wick, ``up`` (n,) 0 at its foot to 1 at its end, where it glows."""
    charred = smooth_step((up - 0.1) / 0.3)[:, None]
    glow = _unit((up - 0.4) / 0.6) ** 2
    return _Surface(
        normal,
        _COTTON + (CHAR - _COTTON) * charred,
        lambda now: _GLOW * (heat * now.beat(up) * glow)[:, None],
    )


def _wound(number: int, share: Points, angle: Points) -> tuple[Points, Points, Points]:
    """Return what cloth wound around a stick in slanting bands shows at places (n,): height, 0 in
    the crease between two bands to 1 on a band; slope towards the stick's end; and its weave, noise
    of rms 1."""
    chance = generator(number, RandomStream.SHEETS, 3)
    weave, _, _ = _grain(chance, share, angle, (1.0, 9.0), (2, 12))
    loose, _, _ = _grain(chance, share, angle, (0.3, 1.5), (1, 3))
    turn = np.pi * (share + 0.05 * loose) / _BAND + angle / 2
    return np.sqrt(np.abs(np.sin(turn))), np.cos(turn) * np.sign(np.sin(turn)), weave


def _wrap(
    number: int,
    place: tuple[Points, Points],
    normal: Points,
    along: Points,
    heat: Points,
) -> _Surface:
    """Return the surface of a wrap: cloth, charred where ``heat`` is high, that glows in creases.

    Args:
        number: Number of the wrap; no two have the same folds.
        place: (n,) distance along it, radii, and angle around it, rad.
        normal: (n, 3) normal of the smooth wrap.
        along: (3,) direction along it.
        heat: (n,) 0..1.
    """
    share, angle = place
    height, slope, weave = _wound(number, share, angle)
    is_end = np.abs(normal @ along) > 0.9
    bumpy = np.where(is_end[:, None], normal, normal - (0.5 * slope)[:, None] * along)
    bumpy /= np.sqrt((bumpy * bumpy).sum(axis=1, keepdims=True))
    charred = _unit(heat * (1.3 + 0.4 * weave))[:, None]
    shade = (0.25 + 0.75 * height) * _unit(0.8 + 0.2 * weave)
    colour = (_CLOTH + (CHAR - _CLOTH) * charred) * shade[:, None]
    crease = _unit(1 - height / 0.7) * _unit(0.45 + 0.6 * weave)
    glow = heat**2 * (0.9 * crease + 0.1 * _unit(0.4 * weave))
    shift = weave + 0.8 * share
    return _Surface(bumpy, colour, lambda now: glowing(glow * now.beat(shift)))


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
    scorch: Points,
) -> _Surface:
    """Return the surface of a log: bark, charred where it is scorched, with cracks that glow.

    Args:
        number: Number of the log; no two have the same grain.
        place: Distance along the log, radii; angle around it, rad; and distance from its axis,
            radii: (n,) each.
        normal: (n, 3) normal of the smooth log.
        axes: Directions along the log, and across it where ``angle`` is 0.
        heat: (n,) 0..1.
        scorch: (n,) 0..1, heat in the time that it has lain there.
    """
    along, level = axes
    share, angle, ring = place
    chance = generator(number, RandomStream.SHEETS, 2)
    bark, bark_along, bark_around = _grain(chance, share, angle, (0.03, 0.3), (3, 9))
    fine, fine_along, fine_around = _grain(chance, share, angle, (0.2, 2.5), (9, 26))
    crack, crack_along, crack_around = _grain(chance, share, angle, (0.7, 2.4), (1, 5))
    is_end = np.abs(normal @ along) > 0.9
    rough = (
        0.10 * bark_along + 0.05 * crack_along + 0.08 * fine_along,
        0.07 * bark_around + 0.12 * crack_around + 0.03 * fine_around,
    )
    across = -np.sin(angle)[:, None] * level + np.cos(angle)[:, None] * np.cross(along, level)
    tilt = rough[0][:, None] * along + rough[1][:, None] * across
    bumpy = np.where(is_end[:, None], normal, normal - tilt)
    bumpy /= np.sqrt((bumpy * bumpy).sum(axis=1, keepdims=True))
    furrow = np.where(
        is_end,
        0.75 + 0.25 * np.sin(16 * ring),
        0.25 + 0.75 * _unit(0.5 + 0.45 * bark + 0.3 * fine),
    )
    plain = np.where(is_end[:, None], _CUT, _BARK)
    charred = _unit(scorch * (1.5 + np.where(is_end, 0.0, 0.6 * bark)))[:, None]
    # What has burnt longest is white with ash on its scales.
    ash = _unit(2.5 * heat - 1.4) * _unit(0.3 + 0.5 * bark - 0.3 * np.abs(crack))
    colour = plain + (CHAR - plain) * charred
    colour += (_ASH - colour) * np.where(is_end, 0.0, ash)[:, None]
    colour *= furrow[:, None]
    # Furrows are deep: seen at a slant, their walls hide the glow and shade one another.
    facing = smooth_step(-1.6 * normal[:, 2])
    rings = heat**2 * (0.25 + 0.25 * np.sin(5 * ring + 2 * bark * ring))
    glow = np.where(is_end, rings, _glow(crack, bark, heat) * facing)
    shift = 2 * bark + 0.8 * share
    shown = np.where(is_end, 1.0, 0.3 + 0.7 * facing)[:, None]
    return _Surface(bumpy, colour * shown, lambda now: glowing(glow * now.beat(shift)))


def _unit(values: Points) -> Points:
    """Return ``values`` limited to 0..1."""
    return np.clip(values, 0.0, 1.0)


def _glow(crack: Points, bark: Points, heat: Points) -> Points:
    """Return how brightly wood glows: in cracks between its scales, where it is hot and where a
    patch of it has burnt through."""
    seam = np.exp(-((crack + 0.3 * bark) ** 2) / 0.09)
    patch = _unit(0.2 + 0.5 * bark)
    return np.asarray(heat**2 * (0.7 * seam * patch + 0.35 * patch))


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
    waves = np.stack([along, around, phase]).astype(np.float32)
    theta = np.stack([share, angle, np.ones_like(share)], axis=1).astype(np.float32) @ waves
    size = math.sqrt(2 / _GRAIN_WAVES)
    slopes = np.cos(theta) @ (size * waves[:2].T)
    return size * np.sin(theta).sum(axis=1), slopes[:, 0], slopes[:, 1]
