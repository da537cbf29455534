"""Find a tight polygon of few vertices around all visible pixels of a frame.

Drawn as such a polygon, a sprite covers fewer pixels than as a rectangle. The polygon starts as the
convex hull of the visible pixels, each of which is a unit square. Pockets, triangles that show
nothing, are cut out of it until it follows the shape closely. Then it loses one vertex after the
other, those first that add the least area; and at last vertices are exchanged and moved for as long
as its area becomes less.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import islice, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.polygon import (
    Point,
    Points,
    chain_meets,
    convex_hull,
    doubled_area,
    edges,
    rectangle,
    turn,
    turns,
    without_straight_vertices,
)

_FINE_VERTICES = 3
"""Maximum number of vertices that pockets add to those of the hull, as a multiple of the number
asked for."""

_MIN_POCKET = 0.002
"""Smallest pocket that is cut out, as a fraction of the hull's area."""

_SEARCH_RADIUS = 3
"""Distance from the ideal place of a vertex up to which corners of pixels are tried, px."""

_POCKETS_TRIED, _CORNERS_TRIED = 3, 4
"""Maximum number of pockets tried on an edge, and of corners of pixels tried as each one's tip."""

_BEAM_REMOVALS, _BEAM_WIDTH, _BEAM_CHANGES = 5, 4, 3
"""The last removals of vertices are a beam search: how many they are, how many polygons are kept
after each, and how many changes of each polygon are tried. Those before are greedy, being many and
of little effect."""

_MAX_EXCHANGES = 12
"""Maximum number of times that vertices are exchanged."""

_EXCHANGED = 2
"""Number of vertices that are added and removed again at a time."""

_MOVES = tuple((x, y) for x in range(-2, 3) for y in range(-2, 3) if (x, y) != (0, 0))
"""Ways, px, in which a vertex is moved in one step."""

_TINY = 1e-9
"""Exceeds the rounding errors of places, px."""


def outline(visible: NDArray[np.bool_], vertices: int) -> list[Point]:
    """Return a polygon around all visible pixels, inside the frame.

    Args:
        visible: (H, W) of the frame.
        vertices: Maximum number of vertices, at least 4.

    Returns:
        Its vertices, clockwise; the frame's corners if nothing is visible.
    """
    height, width = visible.shape
    if not visible.any():
        return rectangle(0, 0, width, height)
    shape = _VisibleShape(visible)
    box = rectangle(*shape.bounds)
    fine = _carved(shape.hull, shape, len(shape.hull) + _FINE_VERTICES * vertices)
    coarse = _reduced(fine, shape, vertices)
    return min(box, _refined(coarse if len(coarse) <= vertices else box, shape, vertices),
               key=doubled_area)  # fmt: skip


class _VisibleShape:
    """The visible pixels of a frame, and which segments and triangles meet any.

    Attributes:
        bounds: Left, top, right and bottom of the visible pixels.
        hull: Their convex hull.
        corners: (n, 2), those corners of visible pixels at which not all four pixels are visible.
    """

    def __init__(self, visible: NDArray[np.bool_]) -> None:
        height, width = visible.shape
        self._size = np.array((width, height))
        self._sums = np.zeros((height, width + 1), np.int64)
        np.cumsum(visible, axis=1, out=self._sums[:, 1:])
        around = np.pad(visible, 1).view(np.int8)
        touching = around[1:, 1:] + around[:-1, 1:] + around[1:, :-1] + around[:-1, :-1]
        rows, columns = np.nonzero((touching > 0) & (touching < 4))
        self.corners = np.stack((columns, rows), axis=1)
        left, top = (int(length) for length in self.corners.min(axis=0))
        right, bottom = (int(length) for length in self.corners.max(axis=0))
        self.bounds = left, top, right, bottom
        starts = np.flatnonzero(np.diff(rows, prepend=-1))
        ends = np.append(starts[1:], len(rows)) - 1
        outermost = self.corners[np.concatenate((starts, ends))]
        self.hull = convex_hull((int(x), int(y)) for x, y in outermost)

    def is_crossed(self, a: Point, b: Point) -> bool:
        """Whether the segment from a to b passes through the inside of a visible pixel."""
        (x, top), (end, bottom) = (a, b) if a[1] < b[1] else (b, a)
        down = bottom - top
        if not down:
            return False
        steps = np.arange(down + 1) * (end - x)
        floor, ceiling = x + steps // down, x - -steps // down
        first = np.minimum(floor[1:], floor[:-1])
        last = np.maximum(ceiling[1:], ceiling[:-1])
        return self._any_between(np.arange(top, bottom), first, last)

    def is_in(self, triangle: Sequence[Point]) -> bool:
        """Whether the centre of a visible pixel is in the triangle."""
        (x0, y0), (x1, y1), (x2, y2) = sorted(triangle, key=lambda point: point[1])
        if y0 == y2:
            return False
        rows = np.arange(y0, y2)
        centres = rows + 0.5
        one = x0 + (centres - y0) * ((x2 - x0) / (y2 - y0))
        other = np.interp(centres, (y0, y1, y2), (x0, x1, x2))
        first = np.ceil(np.minimum(one, other) - 0.5 - _TINY).astype(np.int64)
        last = np.floor(np.maximum(one, other) + 0.5 + _TINY).astype(np.int64)
        return self._any_between(rows, first, np.maximum(first, last))

    def _any_between(self, rows: Points, first: Points, last: Points) -> bool:
        """Whether a pixel is visible in a row from its column ``first`` to before ``last``."""
        return bool(np.any(self._sums[rows, last] > self._sums[rows, first]))

    def holds(self, points: Points) -> NDArray[np.bool_]:
        """Whether each of the points (n, 2) is in the frame: (n,)."""
        inside: NDArray[np.bool_] = np.all((points >= 0) & (points <= self._size), axis=-1)
        return inside


class _Change(NamedTuple):
    """Vertices of a polygon that are to be replaced.

    Attributes:
        after: Index of the vertex before them.
        replaced: Number of vertices to replace.
        new: Those that replace them.
        gain: Twice the area that the polygon loses.
    """

    after: int
    replaced: int
    new: tuple[Point, ...]
    gain: int

    def apply(self, polygon: Sequence[Point]) -> list[Point]:
        """Return the changed polygon; it begins with the vertex before the change."""
        first, *others = [*polygon[self.after :], *polygon[: self.after]]
        return [first, *self.new, *others[self.replaced :]]

    def is_valid(self, polygon: Sequence[Point], shape: _VisibleShape) -> bool:
        """Whether the changed polygon holds all visible pixels, and does not meet itself."""
        around = [*polygon[self.after :], *polygon[: self.after + 1]]
        old, rest = around[: self.replaced + 2], around[self.replaced + 1 :]
        new = [old[0], *self.new, old[-1]]
        if any(shape.is_crossed(*edge) for edge in pairwise(new)):
            return False
        if any(shape.is_in(triangle) for triangle in _triangles_between(old, new)):
            return False
        return not chain_meets(new, rest)


def _triangles_between(
    old: Sequence[Point], new: Sequence[Point]
) -> Iterator[tuple[Point, Point, Point]]:
    """Yield triangles that cover what lies between two chains with the same ends."""
    longer, shorter = (old, new) if len(old) > len(new) else (new, old)
    apex = shorter[1] if len(shorter) > 2 else shorter[0]
    return ((apex, *edge) for edge in pairwise(longer) if apex not in edge)


def _valid_changes(
    changes: Iterator[_Change], polygon: Sequence[Point], shape: _VisibleShape
) -> Iterator[_Change]:
    """Yield the changes that are valid, that with the largest gain first."""
    ordered = sorted(changes, key=lambda change: -change.gain)
    return (change for change in ordered if change.is_valid(polygon, shape))


def _carved(polygon: list[Point], shape: _VisibleShape, most: int) -> list[Point]:
    """Return the polygon with pockets cut out, the largest first, up to ``most`` vertices."""
    least = _MIN_POCKET * doubled_area(shape.hull)
    pockets = cache(lambda a, b: _pocket(a, b, shape))
    while len(polygon) < most:
        found = ((i, pockets(*edge)) for i, edge in enumerate(edges(polygon)))
        changes = (_Change(i, 0, *pocket) for i, pocket in found if pocket and pocket[1] > least)
        change = next(_valid_changes(changes, polygon, shape), None)
        if change is None:
            break
        polygon = change.apply(polygon)
    return polygon


_Vertex = tuple[tuple[Point], int]
"""A new vertex, and twice the area that the polygon loses by it."""


def _pocket(a: Point, b: Point, shape: _VisibleShape) -> _Vertex | None:
    """Return the corner of the largest triangle found on the edge from a to b, inside the polygon,
    that shows nothing; None if there is none.

    From a and from b, each visible corner is seen at an angle to the edge. A triangle is empty if
    no corner is seen at smaller angles from both. So the largest triangle is limited by two
    corners: one for its angle at a, the other for that at b. Angles are compared by their
    cotangents, which fall as the angles grow.
    """
    start, along = np.array(a), np.array((b[0] - a[0], b[1] - a[1]))
    squared = int(along @ along)
    depth, reach = _seen_from(start, along, shape.corners)
    limits = (depth > 0) | ((depth == 0) & (reach > 0) & (reach < squared))
    depth, reach = np.maximum(depth[limits], _TINY), reach[limits]
    at_a, at_b = reach / depth, (squared - reach) / depth
    order = np.lexsort((-at_b, -at_a))
    at_a, at_b = at_a[order][1:], np.maximum.accumulate(at_b[order])[:-1]
    depths = squared / np.maximum(at_a + at_b, _TINY)
    depths[at_a + at_b < _TINY] = 0
    across = np.array((-along[1], along[0]))
    for i in np.argsort(-depths, kind="stable")[:_POCKETS_TRIED]:
        place = start + (along * at_a[i] + across) * (depths[i] / squared)
        points = _corners_near(*place)
        deep, far = _seen_from(start, along, points)
        fits = shape.holds(points) & (deep > 0)
        fits &= (far >= at_a[i] * deep - _TINY) & (squared - far >= at_b[i] * deep - _TINY)
        deepest = np.argsort(np.where(fits, -deep, 0), kind="stable")
        for j in deepest[: min(fits.sum(), _CORNERS_TRIED)]:
            corner = (int(points[j, 0]), int(points[j, 1]))
            if not (
                shape.is_crossed(a, corner)
                or shape.is_crossed(corner, b)
                or shape.is_in((a, corner, b))
            ):
                return (corner,), int(deep[j])
    return None


def _seen_from(
    start: Points, along: Points, points: Points
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how far points (n, 2) are from a line, inwards, and how far along it: (n,) each, both
    times the length of ``along``."""
    away = points - start
    return along[0] * away[:, 1] - along[1] * away[:, 0], away @ along


def _corners_near(x: float, y: float) -> Points:
    """Return the corners of pixels near a place: (n, 2)."""
    side = np.arange(-_SEARCH_RADIUS, _SEARCH_RADIUS + 1)
    columns, rows = np.meshgrid(round(x) + side, round(y) + side)
    return np.stack((columns.ravel(), rows.ravel()), axis=1)


def _reduced(polygon: list[Point], shape: _VisibleShape, most: int) -> list[Point]:
    """Return the polygon with at most that many vertices, unless no way is found."""
    joints = cache(lambda a, u, v, b: _joint(a, u, v, b, shape))
    kept = [polygon]
    while len(kept[0]) > most:
        is_last = len(kept[0]) - most <= _BEAM_REMOVALS
        smaller: dict[frozenset[Point], list[Point]] = {}
        for outline in kept:
            changes = _valid_changes(_removals(outline, joints), outline, shape)
            for change in islice(changes, _BEAM_CHANGES if is_last else 1):
                changed = change.apply(outline)
                smaller.setdefault(frozenset(changed), changed)
        if not smaller:
            break
        kept = sorted(smaller.values(), key=doubled_area)[: _BEAM_WIDTH if is_last else 1]
    return kept[0]


def _removals(
    polygon: Sequence[Point], joints: Callable[[Point, Point, Point, Point], _Vertex | None]
) -> Iterator[_Change]:
    """Yield the changes that take away a vertex and only let the polygon grow."""
    for i in range(len(polygon)):
        a, u, v, b = (polygon[(i + j) % len(polygon)] for j in range(4))
        at_u = turn(a, u, v)
        if at_u <= 0:
            yield _Change(i, 1, (), at_u)
        if (at_u > 0 or turn(u, v, b) > 0) and (joint := joints(a, u, v, b)):
            yield _Change(i, 2, *joint)


def _joint(a: Point, u: Point, v: Point, b: Point, shape: _VisibleShape) -> _Vertex | None:
    """Return the vertex that can replace u and v between a and b, so that the polygon grows least.

    It lies near where the edges that lead to u and from v would meet, and not on their inside.
    """
    (ux, uy), (vx, vy) = (u[0] - a[0], u[1] - a[1]), (b[0] - v[0], b[1] - v[1])
    bend = ux * vy - uy * vx
    if bend <= 0:
        return None
    reach = ((v[0] - a[0]) * vy - (v[1] - a[1]) * vx) / bend
    points = _corners_near(a[0] + ux * reach, a[1] + uy * reach)
    first, second = (np.array(a), np.array(u)), (np.array(v), np.array(b))
    points = points[
        (turns(*first, points) <= 0) & (turns(*second, points) <= 0) & shape.holds(points)
    ]
    if not len(points):
        return None
    areas = turns(first[0], points, second[1])
    best = int(areas.argmin())
    corner = (int(points[best, 0]), int(points[best, 1]))
    return (corner,), turn(a, u, v) + turn(a, v, b) - int(areas[best])


def _refined(polygon: list[Point], shape: _VisibleShape, most: int) -> list[Point]:
    """Return the polygon with vertices exchanged and moved for as long as its area becomes less."""
    polygon = _settled(polygon, shape)
    for _ in range(_MAX_EXCHANGES):
        finer = _settled(_carved(polygon, shape, most + _EXCHANGED), shape)
        other = _settled(_reduced(finer, shape, most), shape)
        if len(other) > most or doubled_area(other) >= doubled_area(polygon):
            break
        polygon = other
    return without_straight_vertices(polygon)


def _settled(polygon: list[Point], shape: _VisibleShape) -> list[Point]:
    """Return the polygon with each vertex moved for as long as that makes its area less."""
    i, tried = 0, 0
    while tried < len(polygon):
        moves = _moves(polygon, i % len(polygon), shape)
        change = next(_valid_changes(moves, polygon, shape), None)
        i, tried = i + 1, tried + 1
        if change is not None:
            polygon = change.apply(polygon)
            i, tried = 2, 0  # the vertex after the one that was moved
    return polygon


def _moves(polygon: Sequence[Point], i: int, shape: _VisibleShape) -> Iterator[_Change]:
    """Yield the changes that move a vertex a little and gain area."""
    a, v, b = polygon[i - 1], polygon[i], polygon[(i + 1) % len(polygon)]
    now = turn(a, v, b)
    for x, y in _MOVES:
        to = (v[0] + x, v[1] + y)
        gain = now - turn(a, to, b)
        if gain > 0 and shape.holds(np.array(to)):
            yield _Change((i - 1) % len(polygon), 1, (to,), gain)
