"""Measure every frame of a clip: feature points, position and width of the fire by row; and refuse
clips that do not show one whole flame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Pixels, linear_to_srgb, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.learn.features import FireMask, feature_points
from fire_atlas.generators.profile.model import (
    FEW_FRAMES,
    MANY_FRAMES,
    MAX_FRAMES,
    MIN_FRAMES,
    FeaturePoints,
)
from fire_atlas.vision.sampling import evenly_spread

_MAX_SEAM_RATIO = 1.1
"""Maximum seam of a clip that loops, relative to its 90th percentile step."""

_MAX_EMPTY_COVERAGE = 0.03
"""Coverage up to which a pixel counts as empty."""

_SAMPLES = 12
"""Number of frames that are looked at before all others."""

_MAX_WIDTH = 2.0
"""Maximum width of the foot of one flame, relative to its height."""

_MIN_CHROMA, _MIN_PEAK = 0.15, 0.85
"""What is less colourful than the first and less bright than the second is no flame."""

_MAX_SHIFT, _MIN_AREA_SHARE = 0.4, 0.2
"""A flame whose foot is further from the usual place, in heights, or whose area is smaller than a
share of the usual, is broken."""

_MAX_BROKEN, _FEW_BROKEN = 0.1, 2
"""Maximum share, and number, of the frames in which the flame is broken."""

_MIN_AREA = 24
"""Minimum number of pixels of a flame that has an outline."""


@dataclass(frozen=True, slots=True)
class ClipMeasurements:
    """Measurements of all frames of a clip.

    Attributes:
        mask: Threshold and masks that separate its fire from everything else.
        points: Feature points of every frame.
        brightness: (frames,) mean luminance of the flame's pixels, linear, 0..1.
        row_weight: (frames, H) sum of the square root of luminance over each row.
        row_centre: (frames, H) x of the centroid of that weight, px; 0 in dark rows.
        row_spread: (frames, H) standard deviation of that weight along x, px.
        step: 99th percentile of ``frame_difference`` between neighbouring frames.
        closed: Whether the clip loops: the step from last to first frame is as small as others.
        cut_share: Share of the frames whose tip leaves the frame.
        bounds: (left, right, top, bottom) of the fire's extent in all frames, px.
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
        """(frames,) lean of the flame, degrees."""
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
        """(x, y) px at which the axis of the flame meets the ground."""
        middle = [(points.left[0] + points.right[0]) / 2 for points in self.points]
        foot = [points.bottom[1] for points in self.points]
        return float(np.median(middle)), float(np.median(foot))


@dataclass(frozen=True, slots=True)
class _FrameMeasurements:
    """Measurements of one frame.

    Attributes:
        points: Its feature points; None if it shows no flame.
        brightness: Mean luminance of the flame's pixels.
        rows: (3, H) weight, centre and spread of each row, as in ``ClipMeasurements``.
        edges: Whether the flame touches the left, right, top and bottom edge, and whether it
            touches the top edge over more than half its width.
        has_rival: Whether it shows a second flame beside the first.
        area: Pixels of its flame.
        chroma: Difference of the largest and smallest channel, relative to the largest, that 95 %
            of the flame's pixels do not exceed.
        peak: Brightness, 0..1, that 99 % of the flame's pixels do not exceed.
    """

    points: FeaturePoints | None
    brightness: float
    rows: NDArray[np.float64]
    edges: tuple[bool, bool, bool, bool, bool]
    has_rival: bool
    area: int
    chroma: float
    peak: float


def frame_difference(one: Pixels, other: Pixels) -> float:
    """Return the root of the summed squared difference of two frames in linear light. A sum, not a
    mean, so that empty room around the fire does not change it."""
    return float(np.sqrt(np.square(one - other).sum(dtype=np.float64)))


def measure_clip(
    clip: Clip, name: str, threshold: float | None, workers: Workers
) -> ClipMeasurements:
    """Measure every frame of ``clip``; messages call it ``name``.

    ``threshold`` is the brightness (0..255) above which a pixel is flame; None: chosen here.

    Raises:
        SourceError: The clip does not show a single, upright flame that is not cut off.
    """
    _refuse_length(name, clip.count)
    mask = FireMask.of(clip, threshold)
    # A few frames tell soon whether all need be looked at.
    numbers = evenly_spread(0, clip.count - 1, _SAMPLES)
    samples = list(workers.map(lambda i: _measure(clip, mask, numbers[i]), range(len(numbers))))
    present = np.mean([flame for _, flame, _ in samples], axis=0).astype(np.float32)
    _refuse_unfit(name, mask, [frame for frame, _, _ in samples], present)
    found: list[_FrameMeasurements] = []
    steps: list[float] = []
    first = before = np.zeros((clip.height, clip.width, 4), np.float32)
    flame_count = np.zeros((clip.height, clip.width), np.float32)
    visible = np.zeros((clip.height, clip.width), np.bool_)
    for frame, flame, fire in workers.map(lambda i: _measure(clip, mask, i), range(clip.count)):
        flame_count += flame
        visible |= fire[..., 3] > _MAX_EMPTY_COVERAGE
        if found:
            steps.append(frame_difference(before, fire))
        first, before = first if found else fire, fire
        found.append(frame)
    cut_share = _refuse_unfit(name, mask, found, flame_count / np.float32(clip.count))
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
        closed=seam <= _MAX_SEAM_RATIO * float(np.quantile(steps, 0.9)),
        cut_share=cut_share,
        bounds=_bounds(visible),
    )


def _measure(
    clip: Clip, mask: FireMask, i: int
) -> tuple[_FrameMeasurements, NDArray[np.bool_], Pixels]:
    """Measure one frame; also return the mask (H, W) of its flame and the fire alone."""
    pixels = clip.read(i)
    binarized = mask.binarized(pixels)
    flame = largest_flame(binarized)
    fire = mask.isolated(pixels, binarized)
    light = luminance(fire).astype(np.float64)
    rows = _row_moments(np.sqrt(np.maximum(light, 0)))
    points, brightness, has_rival, chroma, peak = None, 0.0, False, 0.0, 0.0
    area = int(np.count_nonzero(flame))
    if area >= _MIN_AREA:
        points, brightness = feature_points(flame), float(light[flame].mean())
        has_rival = _has_rival(binarized, flame)
        chroma, peak = _colourfulness(fire[flame])
    width = points.width if points else clip.width
    edges = (
        bool(flame[:, :1].any()), bool(flame[:, -1:].any()),
        bool(flame[:2].any()), bool(flame[-1:].any()),
        bool(np.count_nonzero(flame[0]) > 0.5 * width),
    )  # fmt: skip
    measurements = _FrameMeasurements(
        points, brightness, rows, edges, has_rival, area, chroma, peak
    )
    return measurements, flame, fire


def _colourfulness(pixels: NDArray[np.float32]) -> tuple[float, float]:
    """Return ``chroma`` and ``peak`` of ``_FrameMeasurements`` for pixels (n, 4) of a flame."""
    colours = linear_to_srgb(np.clip(pixels[:, :3], 0, 1))
    most, least = colours.max(axis=1), colours.min(axis=1)
    chroma = (most - least) / np.maximum(most, 1e-3)
    return float(np.quantile(chroma, 0.95)), float(np.quantile(most, 0.99))


def _row_moments(weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (3, H): sum, centroid and standard deviation of each row of weights (H, W)."""
    x = np.arange(weight.shape[1]) + 0.5
    mass = weight.sum(axis=1)
    safe = np.maximum(mass, 1e-9)
    centre = (weight * x).sum(axis=1) / safe
    variance = (weight * (x - centre[:, None]) ** 2).sum(axis=1) / safe
    return np.stack([mass, centre, np.sqrt(variance)])


def _bounds(visible: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return (left, right, top, bottom) of the box of all set pixels of a mask (H, W)."""
    rows, columns = np.flatnonzero(visible.any(axis=1)), np.flatnonzero(visible.any(axis=0))
    return int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1


def _has_rival(binarized: NDArray[np.uint8], flame: NDArray[np.bool_]) -> bool:
    """Return whether a second flame of similar size stands beside this one."""
    rest = (binarized > 0) & ~flame
    other = largest_flame(rest.astype(np.uint8))
    if np.count_nonzero(other) < 0.35 * np.count_nonzero(flame):
        return False
    mine, its = (np.flatnonzero(mask.any(axis=0)) for mask in (flame, other))
    return bool(its[0] > mine[-1] or its[-1] < mine[0])


def _without_gaps(points: list[FeaturePoints | None]) -> list[FeaturePoints]:
    """Return the points of every frame; a frame without flame takes those of the frame before."""
    known = next(each for each in points if each is not None)
    filled = []
    for each in points:
        known = each or known
        filled.append(known)
    return filled


def _no_fire(name: str, mask: FireMask, seen: int, count: int) -> str:
    if not mask.fire.any():
        return (
            f"{name}: no fire found: nothing in it moves and is bright; choose a clip in which the "
            f"fire flickers, so that its frames differ"
        )
    return (
        f"{name}: no fire found in {count - seen} of {count} frames: too little in them is "
        f"brighter than {mask.threshold:.0f} of 255; set source.threshold lower, or choose other "
        f"frames with source.start and source.count"
    )


def length_advice(count: int) -> str | None:
    """Return advice on a clip of ``count`` frames that is shorter or longer than is best."""
    if FEW_FRAMES <= count <= MANY_FRAMES:
        return None
    best = f"{FEW_FRAMES} to {MANY_FRAMES} are best"
    if count < FEW_FRAMES:
        return f"{best}; {count} show few poses of the fire, so that what is generated repeats them"
    return (
        f"{best}; of {count}, those beyond mostly make the profile larger and slower to learn: "
        "--set start=N and --set count=N choose some"
    )


def _refuse_length(name: str, count: int) -> None:
    best = f"{FEW_FRAMES} to {MANY_FRAMES}"
    if count < MIN_FRAMES:
        raise SourceError(
            f"{name}: has {count} frame{'s' * (count > 1)}; a profile is learnt from at "
            f"least {MIN_FRAMES}, best from {best}"
        )
    if count > MAX_FRAMES:
        raise SourceError(
            f"{name}: has {count} frames; a profile is learnt from at most {MAX_FRAMES}, and "
            f"{best} are enough: choose some with source.start and source.count"
        )


def _refuse_unfit(
    name: str, mask: FireMask, frames: list[_FrameMeasurements], present: NDArray[np.float32]
) -> float:
    """Refuse frames that do not show one whole flame; return the share whose tip is cut off.

    ``present`` (H, W) is the share of the frames in which each pixel is flame.
    """
    seen = [frame for frame in frames if frame.points is not None]
    if len(seen) < 0.5 * len(frames):
        raise SourceError(_no_fire(name, mask, len(seen), len(frames)))
    _refuse_rivals(name, frames)
    cut_share = _refuse_cut(name, frames)
    _refuse_tilted(name, present * np.float32(len(frames) / len(seen)))
    points = [frame.points for frame in seen if frame.points is not None]
    _refuse_wide(name, points)
    _refuse_grey(name, seen)
    _refuse_broken(name, frames)
    return cut_share


def _refuse_wide(name: str, points: list[FeaturePoints]) -> None:
    ratio = float(np.median([each.width / max(each.height, 1.0) for each in points]))
    if ratio > _MAX_WIDTH:
        raise SourceError(
            f"{name}: the fire is {ratio:.1f} times as wide as it is high: a row or a ring of "
            f"flames; a profile is of one flame: crop the clip to one"
        )


def _refuse_grey(name: str, frames: list[_FrameMeasurements]) -> None:
    chroma, peak = np.median([(frame.chroma, frame.peak) for frame in frames], axis=0)
    if chroma < _MIN_CHROMA and peak < _MIN_PEAK:
        raise SourceError(
            f"{name}: shows something grey that does not glow (at most {255 * peak:.0f} of 255): "
            f"smoke or steam; a profile is of a flame: choose a clip of one, or use the clip as it "
            f"is with source.kind: frames"
        )


def _refuse_broken(name: str, frames: list[_FrameMeasurements]) -> None:
    """Refuse a flame that goes out, leaves its base, or gives way to another picture."""
    seen = [frame for frame in frames if frame.points is not None]
    area = float(np.median([frame.area for frame in seen]))
    points = [frame.points for frame in seen if frame.points is not None]
    height = float(np.median([each.height for each in points]))
    foot = np.array([each.bottom for each in points])
    shift = np.abs(foot[:, None] - foot).max(axis=2)
    # The usual place is that of the frame to which most others are near.
    off = shift[np.argmin(np.quantile(shift, 0.4, axis=1))] > _MAX_SHIFT * height
    small = [frame.area < _MIN_AREA_SHARE * area for frame in seen]
    broken = len(frames) - len(seen) + sum(a or b for a, b in zip(off, small, strict=True))
    if broken > max(_MAX_BROKEN * len(frames), _FEW_BROKEN):
        raise SourceError(
            f"{name}: the flame goes out, leaves its base or jumps elsewhere in {broken} of "
            f"{len(frames)} frames; choose a part of the clip in which it burns in one place with "
            f"source.start and source.count, or set source.threshold lower if parts of it are dim"
        )


def _refuse_rivals(name: str, frames: list[_FrameMeasurements]) -> None:
    rivals = sum(frame.has_rival for frame in frames)
    if rivals > 0.6 * len(frames):
        raise SourceError(
            f"{name}: shows several flames side by side in {rivals} of {len(frames)} frames; "
            f"a profile is of one flame: crop the clip to one, or set source.threshold lower if "
            f"they belong together"
        )


def _refuse_cut(name: str, frames: list[_FrameMeasurements]) -> float:
    """Return the share of frames whose tip is cut off; refuse flames cut off more than that."""
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
    """Refuse fire that does not burn upwards, which is the direction from the pixels that are
    always flame to those that sometimes are."""
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
        f"{name}: the fire burns {where}; a profile is of fire that burns upwards: turn the clip "
        f"so that its base is at the bottom"
    )
