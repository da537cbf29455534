"""Measure every frame of a clip: its feature points, how its rows sway, and whether it shows a
flame that can be learnt from at all."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Pixels, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.features import FireMask, feature_points, largest_flame
from fire_atlas.generators.profile.model import MAX_FRAMES, MIN_FRAMES, FeaturePoints

_SEAM = 1.1
"""A clip is closed if its seam is at most this many times its 90th percentile step."""

_VISIBLE = 0.03
"""Coverage below which a pixel counts as empty."""

_MIN_AREA = 24
"""A flame of fewer pixels than this has no outline."""


@dataclass(frozen=True, slots=True)
class ClipMeasurements:
    """Measurements of a clip, frame by frame.

    Attributes:
        mask: Threshold and masks that separate its fire from all else.
        points: Feature points of every frame.
        brightness: (frames,) mean of the flame's pixels, linear, 0..1.
        row_weight: (frames, H) square root of luminance, summed over each row.
        row_centre: (frames, H) x of the centroid of that weight, px; 0 where there is none.
        row_spread: (frames, H) its standard deviation, px.
        step: 99th percentile of the difference of neighbouring frames.
        closed: Whether the first frame follows the last as any follows another.
        cut_share: Share of the frames whose tip leaves the frame.
        bounds: (left, right, top, bottom) of all that is ever fire, px.
    """

    mask: FireMask
    points: tuple[FeaturePoints, ...]
    brightness: NDArray[np.float64]
    row_weight: NDArray[np.float64]
    row_centre: NDArray[np.float64]
    row_spread: NDArray[np.float64]
    step: float
    closed: bool
    cut_share: float
    bounds: tuple[int, int, int, int]

    @property
    def leans(self) -> NDArray[np.float64]:
        """(frames,) degrees."""
        return np.array([points.lean for points in self.points])

    @property
    def height(self) -> float:
        """Median height of the flame, px."""
        return float(np.median([points.height for points in self.points]))

    @property
    def half_width(self) -> float:
        """Half the median width of the flame's foot, px."""
        return max(float(np.median([points.width for points in self.points])) / 2, 1.0)

    @property
    def base(self) -> tuple[float, float]:
        """Where the axis of the flame meets the ground, (x, y) px."""
        middle = [(points.left[0] + points.right[0]) / 2 for points in self.points]
        foot = [points.bottom[1] for points in self.points]
        return float(np.median(middle)), float(np.median(foot))


@dataclass(frozen=True, slots=True)
class _FrameMeasurements:
    """Measurements of one frame.

    Attributes:
        points: Its feature points, if it shows a flame.
        brightness: Mean of the flame's pixels.
        rows: (3, H) weight, centre and spread.
        edges: Whether the flame meets the left, right, top and bottom edge, and whether it does so
            at the top over more than half its width.
        has_rival: Whether it shows a second flame.
    """

    points: FeaturePoints | None
    brightness: float
    rows: NDArray[np.float64]
    edges: tuple[bool, bool, bool, bool, bool]
    has_rival: bool


def frame_difference(one: Pixels, other: Pixels) -> float:
    """Return the root of the summed squared difference of two frames, linear light. It grows with
    the scale of the fire, but not with empty room around it."""
    return float(np.sqrt(np.square(one - other).sum(dtype=np.float64)))


def measure_clip(
    clip: Clip, name: str, threshold: float | None, workers: Workers
) -> ClipMeasurements:
    """Measure every frame of ``clip``; ``name`` is what messages call it.

    Without a ``threshold``, the brightness (0..255) above which a pixel is flame, it is chosen.

    Raises:
        SourceError: There is no single, upright, whole flame in it to learn from.
    """
    mask = FireMask.of(clip, threshold)
    _refuse_length(name, clip.count)
    found: list[_FrameMeasurements] = []
    steps: list[float] = []
    first = before = np.zeros((clip.height, clip.width, 4), np.float32)
    flame_count = np.zeros((clip.height, clip.width), np.float32)
    visible = np.zeros((clip.height, clip.width), np.bool_)
    for frame, flame, fire in workers.map(lambda i: _measure(clip, mask, i), range(clip.count)):
        flame_count += flame
        visible |= fire[..., 3] > _VISIBLE
        if found:
            steps.append(frame_difference(before, fire))
        first, before = first if found else fire, fire
        found.append(frame)
    seen = [frame.points for frame in found if frame.points is not None]
    if len(seen) < 0.5 * clip.count:
        raise SourceError(_no_fire(name, mask, len(seen), clip.count))
    _refuse_rivals(name, found)
    cut_share = _refuse_cut(name, found)
    _refuse_tilted(name, flame_count / np.float32(len(seen)))
    seam = frame_difference(before, first)
    weight, centre, spread = np.stack([frame.rows for frame in found]).transpose(1, 0, 2)
    return ClipMeasurements(
        mask=mask,
        points=tuple(_without_gaps([frame.points for frame in found])),
        brightness=np.array([frame.brightness for frame in found]),
        row_weight=weight,
        row_centre=centre,
        row_spread=spread,
        step=float(np.quantile(steps, 0.99)),
        closed=seam <= _SEAM * float(np.quantile(steps, 0.9)),
        cut_share=cut_share,
        bounds=_bounds(visible),
    )


def _measure(
    clip: Clip, mask: FireMask, i: int
) -> tuple[_FrameMeasurements, NDArray[np.bool_], Pixels]:
    """Measure one frame; return its flame (H, W) and its fire alone as well."""
    pixels = clip.read(i)
    binarized = mask.binarized(pixels)
    flame = largest_flame(binarized)
    fire = mask.isolated(pixels, binarized)
    light = luminance(fire).astype(np.float64)
    rows = _row_moments(np.sqrt(np.maximum(light, 0)))
    points, brightness, has_rival = None, 0.0, False
    if np.count_nonzero(flame) >= _MIN_AREA:
        points, brightness = feature_points(flame), float(light[flame].mean())
        has_rival = _has_rival(binarized, flame)
    width = points.width if points else clip.width
    edges = (
        bool(flame[:, :1].any()), bool(flame[:, -1:].any()),
        bool(flame[:2].any()), bool(flame[-1:].any()),
        bool(np.count_nonzero(flame[0]) > 0.5 * width),
    )  # fmt: skip
    return _FrameMeasurements(points, brightness, rows, edges, has_rival), flame, fire


def _row_moments(weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, H): sum, centroid and standard deviation of each row of weights (H, W)."""
    x = np.arange(weight.shape[1]) + 0.5
    mass = weight.sum(axis=1)
    safe = np.maximum(mass, 1e-9)
    centre = (weight * x).sum(axis=1) / safe
    variance = (weight * (x - centre[:, None]) ** 2).sum(axis=1) / safe
    return np.stack([mass, centre, np.sqrt(variance)])


def _bounds(visible: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return (left, right, top, bottom) of the pixels of a mask (H, W) that are set."""
    rows, columns = np.flatnonzero(visible.any(axis=1)), np.flatnonzero(visible.any(axis=0))
    return int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1


def _has_rival(binarized: NDArray[np.uint8], flame: NDArray[np.bool_]) -> bool:
    """Whether a second flame stands beside this one, about as large."""
    rest = (binarized > 0) & ~flame
    other = largest_flame(rest.astype(np.uint8))
    if np.count_nonzero(other) < 0.35 * np.count_nonzero(flame):
        return False
    mine, its = (np.flatnonzero(mask.any(axis=0)) for mask in (flame, other))
    return bool(its[0] > mine[-1] or its[-1] < mine[0])


def _without_gaps(points: list[FeaturePoints | None]) -> list[FeaturePoints]:
    """Return the points of every frame: where no flame was found, of the last one before."""
    known = next(each for each in points if each is not None)
    filled = []
    for each in points:
        known = each or known
        filled.append(known)
    return filled


def _no_fire(name: str, mask: FireMask, seen: int, count: int) -> str:
    if not mask.fire.any():
        return (
            f"{name}: no fire found: nothing in it moves and is bright; a fire to learn from "
            f"flickers, and its frames differ"
        )
    return (
        f"{name}: no fire found in {count - seen} of {count} frames: too little in them is "
        f"brighter than {mask.threshold:.0f} of 255; set source.threshold lower, or choose other "
        f"frames with source.start and source.count"
    )


def _refuse_length(name: str, count: int) -> None:
    if count < MIN_FRAMES:
        raise SourceError(
            f"{name}: has {count} frame{'s' * (count > 1)}; how a fire moves is learnt "
            f"from at least {MIN_FRAMES}, best from 8 to 60"
        )
    if count > MAX_FRAMES:
        raise SourceError(
            f"{name}: has {count} frames; a profile is learnt from at most {MAX_FRAMES}, and "
            f"8 to 60 are enough: choose some with source.start and source.count"
        )


def _refuse_rivals(name: str, frames: list[_FrameMeasurements]) -> None:
    rivals = sum(frame.has_rival for frame in frames)
    if rivals > 0.6 * len(frames):
        raise SourceError(
            f"{name}: shows several flames beside one another in {rivals} of {len(frames)} frames; "
            f"a profile is of one flame: crop the clip to it, or set source.threshold lower if "
            f"they are one"
        )


def _refuse_cut(name: str, frames: list[_FrameMeasurements]) -> float:
    """Return the share of frames whose tip is cut off, if the flame is whole otherwise."""
    left, right, top, bottom, wide = np.mean([frame.edges for frame in frames], axis=0)
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
    """Refuse fire that does not burn upwards: from the pixels that are always flame to those that
    sometimes are."""
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
