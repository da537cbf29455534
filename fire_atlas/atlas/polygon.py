"""Polygons whose vertices are corners of pixels: areas, hulls, crossings, triangles.

All is exact, in whole numbers. x is right and y down. Polygons run clockwise as seen on the screen,
so that their areas are positive and their inside is on the right of every edge.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Point: TypeAlias = tuple[int, int]
"""A corner of pixels: x, y in px of the frame."""

Points: TypeAlias = NDArray[np.int64]
"""Corners of pixels, (n, 2), or a single one, (2,)."""

Triangle: TypeAlias = tuple[int, int, int]
"""Indices of three vertices."""


def rectangle(left: int, top: int, right: int, bottom: int) -> list[Point]:
    """Return the vertices of a rectangle."""
    return [(left, top), (right, top), (right, bottom), (left, bottom)]


def edges(polygon: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    """Yield the edges, the last of which leads back to the first vertex."""
    return pairwise([*polygon, polygon[0]])


def doubled_area(polygon: Sequence[Point]) -> int:
    """Return twice the area of a polygon, px²."""
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in edges(polygon))


def turn(a: Point, b: Point, c: Point) -> int:
    """Return twice the area of the triangle a, b, c: above 0 if the way there turns right."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])


def turns(a: Points, b: Points, c: Points) -> NDArray[np.int64]:
    """Return ``turn`` of many points: (n,)."""
    across: NDArray[np.int64] = (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
    return across - (c[..., 0] - a[..., 0]) * (b[..., 1] - a[..., 1])


def convex_hull(points: Iterable[Point]) -> list[Point]:
    """Return the vertices of the smallest convex polygon around all points."""
    ordered = sorted(set(points))
    halves: list[Point] = []
    for half in (ordered, ordered[::-1]):
        chain: list[Point] = []
        for point in half:
            while len(chain) > 1 and turn(chain[-2], chain[-1], point) <= 0:
                chain.pop()
            chain.append(point)
        halves += chain[:-1]
    return halves


def without_straight_vertices(polygon: Sequence[Point]) -> list[Point]:
    """Return the polygon without the vertices at which it does not turn."""
    around = zip([polygon[-1], *polygon], polygon, [*polygon[1:], polygon[0]], strict=False)
    return [b for a, b, c in around if turn(a, b, c)]


def chain_meets(chain: Sequence[Point], rest: Sequence[Point]) -> bool:
    """Whether the first part of a polygon meets itself or the rest where they are not joined.

    Args:
        chain: The first part: at least two vertices.
        rest: Leads on from the end of ``chain`` to its start.
    """
    whole = [*chain[:-1], *rest[:-1]]
    count = len(whole)
    starts = np.array(whole, np.int64)
    ends = np.roll(starts, -1, axis=0)
    for i in range(len(chain) - 1):
        before, a, b, after = (whole[(i + j) % count] for j in range(-1, 3))
        if _turns_back(before, a, b) or _turns_back(a, b, after):
            return True
        others = np.arange(i + 2, i + count - 1) % count
        if others.size and _touches(a, b, starts[others], ends[others]):
            return True
    return False


def _turns_back(a: Point, b: Point, c: Point) -> bool:
    """Whether the way from a over b to c leads back along itself."""
    if turn(a, b, c):
        return False
    return (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]) >= 0


def _touches(a: Point, b: Point, starts: Points, ends: Points) -> bool:
    """Whether the segment from a to b has a point in common with one of other segments."""
    first, second = np.array(a), np.array(b)
    sides = np.sign(turns(first, second, starts)) * np.sign(turns(first, second, ends))
    facing = np.sign(turns(starts, ends, first)) * np.sign(turns(starts, ends, second))
    before = np.maximum(starts, ends) < np.minimum(first, second)
    behind = np.minimum(starts, ends) > np.maximum(first, second)
    apart = (sides > 0) | (facing > 0) | np.any(before | behind, axis=1)
    return not apart.all()


def triangulated(polygon: Sequence[Point]) -> tuple[Triangle, ...]:
    """Return the triangles into which a polygon is cut, as indices of its vertices.

    Ears are cut off one after the other, always with the shortest cut, so that triangles are not
    needlessly thin: a graphics card shades the pixels along their edges twice.
    """
    left, triangles = list(range(len(polygon))), []
    while len(left) > 3:
        ears = sorted(range(len(left)), key=lambda i: _cut(polygon, left, i))
        ear = next(i for i in ears if _is_ear(polygon, left, i))
        triangles.append(_around(left, ear))
        del left[ear]
    return (*triangles, _around(left, 1))


def _around(left: Sequence[int], i: int) -> Triangle:
    return left[i - 1], left[i], left[(i + 1) % len(left)]


def _cut(polygon: Sequence[Point], left: Sequence[int], i: int) -> int:
    """Return the squared length of the cut that takes off a vertex."""
    before, _, after = _around(left, i)
    (x0, y0), (x1, y1) = polygon[before], polygon[after]
    return (x1 - x0) ** 2 + (y1 - y0) ** 2


def _is_ear(polygon: Sequence[Point], left: Sequence[int], i: int) -> bool:
    """Whether the polygon turns right at a vertex, and the triangle there has no other in it."""
    corners = _around(left, i)
    a, b, c = (polygon[corner] for corner in corners)
    if turn(a, b, c) <= 0:
        return False
    others = (polygon[j] for j in left if j not in corners)
    return not any(min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) >= 0 for p in others)
