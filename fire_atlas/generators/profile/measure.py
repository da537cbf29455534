"""One look at every frame of a clip: where its flame stands, how it bends, and whether it can be
learnt from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Pixels, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.contour import Points, feature_points
from fire_atlas.generators.profile.segment import Fire, connected

LEAST_FRAMES, MOST_FRAMES = 4, 160
"""Frames a clip to learn from may have; 8 to 60 are best."""

_SEAM = 1.1
"""A seam this many times a large step of the clip is no more seen than that is."""

_FAINT = 0.03
"""Coverage that nobody sees."""

_SMALLEST = 24
"""A flame of fewer pixels than this has no outline."""


@dataclass(frozen=True, slots=True)
class Measures:
    """What was measured of a clip, frame by frame.

    Attributes:
        points: Six points of every frame.
        light: (frames,) mean brightness of the flame's pixels, linear, 0..1.
        mass: (frames, H) light of every row, as the square root of luminance, summed.
        centre: (frames, H) x of the middle of that light, px; 0 where there is none.
        spread: (frames, H) its root mean square distance from there, px.
        step: 99th percentile of how much a frame differs from the one before.
        closed: Whether the first frame follows the last as any follows another.
        cut: Share of the frames whose tip leaves the frame.
        reach: (left, right, top, bottom) of all that ever burns, px.
    """

    points: tuple[Points, ...]
    light: NDArray[np.float64]
    mass: NDArray[np.float64]
    centre: NDArray[np.float64]
    spread: NDArray[np.float64]
    step: float
    closed: bool
    cut: float
    reach: tuple[int, int, int, int]

    @property
    def leans(self) -> NDArray[np.float64]:
        """(frames,) degrees."""
        return np.array([points.lean for points in self.points])

    @property
    def height(self) -> float:
        """Median height of the flame, px."""
        return float(np.median([points.height for points in self.points]))

    @property
    def half(self) -> float:
        """Half the median width of the flame's foot, px."""
        return max(float(np.median([points.width for points in self.points])) / 2, 1.0)

    @property
    def base(self) -> tuple[float, float]:
        """Where the axis of the flame meets the ground, (x, y) px."""
        middle = [(points.left[0] + points.right[0]) / 2 for points in self.points]
        foot = [points.bottom[1] for points in self.points]
        return float(np.median(middle)), float(np.median(foot))


@dataclass(frozen=True, slots=True)
class _Look:
    """One frame: its points, if there is a flame, its light by row, its flame and its fire."""

    points: Points | None
    light: float
    rows: NDArray[np.float64]
    flame: NDArray[np.bool_]
    content: Pixels
    rival: bool


def difference(one: Pixels, other: Pixels) -> float:
    """How much two frames differ: the root of the summed squares, linear light. Empty room around
    the fire does not matter, its scale does."""
    return float(np.sqrt(np.square(one - other).sum(dtype=np.float64)))


def measure(clip: Clip, fire: Fire, workers: Workers, name: str) -> Measures:
    """Measure every frame of ``clip``; ``name`` is what messages call it.

    Raises:
        SourceError: There is no single, upright, whole flame in it to learn from.
    """
    _refuse_length(name, clip.count)
    found: list[_Look] = []
    steps: list[float] = []
    first: Pixels | None = None
    before: Pixels | None = None
    present = np.zeros((clip.height, clip.width), np.float32)
    burns = np.zeros((clip.height, clip.width), np.bool_)
    for look in workers.map(lambda i: _look(clip, fire, i), range(clip.count)):
        present += look.flame
        burns |= look.content[..., 3] > _FAINT
        if before is not None:
            steps.append(difference(before, look.content))
        before = look.content
        first = look.content if first is None else first
        found.append(_without_pictures(look, clip.width))
    seen = [look.points for look in found if look.points is not None]
    if len(seen) < 0.5 * clip.count:
        raise SourceError(_no_fire(name, fire, len(seen), clip.count))
    _refuse_rivals(name, found)
    cut = _refuse_cut(name, found)
    _refuse_tilted(name, present / np.float32(len(seen)))
    points = _without_gaps([look.points for look in found])
    mass, centre, spread = np.stack([look.rows for look in found]).transpose(1, 0, 2)
    rows, columns = np.flatnonzero(burns.any(axis=1)), np.flatnonzero(burns.any(axis=0))
    reach = int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1
    light = np.array([look.light for look in found])
    closed = False
    if first is not None and before is not None:
        closed = difference(before, first) <= _SEAM * float(np.quantile(steps, 0.9))
    step = float(np.quantile(steps, 0.99))
    return Measures(tuple(points), light, mass, centre, spread, step, closed, cut, reach)


def _look(clip: Clip, fire: Fire, i: int) -> _Look:
    pixels = clip.read(i)
    lit = fire.lit(pixels)
    flame = connected(lit)
    content = fire.content(pixels, lit)
    shown = luminance(content).astype(np.float64)
    rows = _rows(np.sqrt(np.maximum(shown, 0)))
    if np.count_nonzero(flame) < _SMALLEST:
        return _Look(None, 0.0, rows, flame, content, False)
    light = float(shown[flame].mean())
    rival = _has_rival(lit, flame)
    return _Look(feature_points(flame), light, rows, flame, content, rival)


def _without_pictures(look: _Look, width: int) -> _Look:
    """Return a look with which edges its flame meets in place of its mask, and without its fire."""
    flame = look.flame
    edges = np.array([
        flame[:, :1].any(), flame[:, -1:].any(), flame[:2].any(), flame[-1:].any(),
        np.count_nonzero(flame[0]) > 0.5 * (look.points.width if look.points else width),
    ])  # fmt: skip
    return _Look(look.points, look.light, look.rows, edges, look.content[:0], look.rival)


def _rows(weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, H): mass, centre and spread of each row of a picture of light."""
    x = np.arange(weight.shape[1]) + 0.5
    mass = weight.sum(axis=1)
    safe = np.maximum(mass, 1e-9)
    centre = (weight * x).sum(axis=1) / safe
    variance = (weight * (x - centre[:, None]) ** 2).sum(axis=1) / safe
    return np.stack([mass, centre, np.sqrt(variance)])


def _has_rival(lit: NDArray[np.uint8], flame: NDArray[np.bool_]) -> bool:
    """Whether a second flame stands beside this one, about as large."""
    rest = (lit > 0) & ~flame
    other = connected(rest.astype(np.uint8))
    if np.count_nonzero(other) < 0.35 * np.count_nonzero(flame):
        return False
    mine, its = (np.flatnonzero(mask.any(axis=0)) for mask in (flame, other))
    return bool(its[0] > mine[-1] or its[-1] < mine[0])


def _without_gaps(points: list[Points | None]) -> list[Points]:
    """Return the points of every frame: where no flame was found, of the last one before."""
    known = next(each for each in points if each is not None)
    filled = []
    for each in points:
        known = each or known
        filled.append(known)
    return filled


def _no_fire(name: str, fire: Fire, seen: int, count: int) -> str:
    if not fire.place.any():
        return (
            f"{name}: no fire found: nothing in it moves and is bright; a fire to learn from "
            f"flickers, and its frames differ"
        )
    return (
        f"{name}: no fire found in {count - seen} of {count} frames: too little in them is "
        f"brighter than {fire.threshold:.0f} of 255; set source.threshold lower, or choose other "
        f"frames with source.start and source.count"
    )


def _refuse_length(name: str, count: int) -> None:
    if count < LEAST_FRAMES:
        raise SourceError(
            f"{name}: has {count} frame{'s' * (count > 1)}; how a fire moves is learnt "
            f"from at least {LEAST_FRAMES}, best from 8 to 60"
        )
    if count > MOST_FRAMES:
        raise SourceError(
            f"{name}: has {count} frames; a profile is learnt from at most {MOST_FRAMES}, and "
            f"8 to 60 are enough: choose some with source.start and source.count"
        )


def _refuse_rivals(name: str, looks: list[_Look]) -> None:
    rivals = sum(look.rival for look in looks)
    if rivals > 0.6 * len(looks):
        raise SourceError(
            f"{name}: shows several flames beside one another in {rivals} of {len(looks)} frames; "
            f"a profile is of one flame: crop the clip to it, or set source.threshold lower if "
            f"they are one"
        )


def _refuse_cut(name: str, looks: list[_Look]) -> float:
    """Return the share of frames whose tip is cut off, if the flame is whole otherwise."""
    left, right, top, bottom, wide = np.mean([look.flame for look in looks], axis=0)
    advice = "film it with room on all sides, or set source.threshold higher if this is its glow"
    if min(left, right, top, bottom) > 0.5:
        raise SourceError(f"{name}: the fire touches every edge, so it has no outline; {advice}")
    for share, edge in ((left, "left"), (right, "right")):
        if share > 0.5:
            raise SourceError(f"{name}: the fire is cut off at the {edge} edge; {advice}")
    if wide > 0.5 or top > 0.9:
        raise SourceError(
            f"{name}: the tip of the flame is cut off in {100 * max(wide, top):.0f} % of the "
            f"frames; {advice}"
        )
    return float(top)


def _refuse_tilted(name: str, present: NDArray[np.float32]) -> None:
    """Refuse fire that does not burn upwards: it goes from what always burns to what sometimes
    does."""
    always, sometimes = present > 0.8, (present > 0.05) & (present < 0.5)
    if not always.any() or not sometimes.any():
        return
    (y0, x0), (y1, x1) = (np.argwhere(mask).mean(axis=0) for mask in (always, sometimes))
    rows, columns = np.argwhere(present > 0.05).T
    size = float(np.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1))
    right, up = (x1 - x0) / size, (y0 - y1) / size
    if max(abs(right), -up) < 0.12 or up > abs(right):
        return
    where = "downwards" if -up > abs(right) else "to the right" if right > 0 else "to the left"
    raise SourceError(
        f"{name}: the fire burns {where}; a profile is of fire that rises: turn the clip so that "
        f"its base is at the bottom"
    )
