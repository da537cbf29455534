"""Measure every frame of a clip: feature points, colours, position and width of the fire by row."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, ProxiedClip
from fire_atlas.core.pixels import Pixels, brightness, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.learn.colour_table import cell_sums, colour_table
from fire_atlas.generators.profile.learn.features import FireMask, feature_points, flame_lean
from fire_atlas.generators.profile.learn.fitness import refuse_unfit
from fire_atlas.generators.profile.model import ColourTable, FeaturePoints

_MAX_SEAM_RATIO = 1.1
"""Maximum seam of a clip that loops, relative to its 90th percentile step."""

_MAX_EMPTY_COVERAGE = 0.03
"""Coverage up to which a pixel counts as empty."""


@dataclass(frozen=True, slots=True)
class ClipMeasurements:
    """Measurements of all frames of a clip.

    Attributes:
        mask: Threshold and masks that separate its fire from everything else.
        points: Feature points of every frame.
        leans: (frames,) lean of the flame, degrees.
        brightness: (frames,) mean luminance of the flame's pixels, linear, 0..1.
        row_weight: (frames, H) sum of the square root of luminance over each row.
        row_centre: (frames, H) x of the centroid of that weight, px; 0 in dark rows.
        row_spread: (frames, H) standard deviation of that weight along x, px.
        step: 99th percentile of ``frame_difference`` between neighbouring frames.
        closed: Whether the clip loops: the step from last to first frame is as small as others.
        cut_share: Share of the frames whose tip leaves the frame.
        bounds: (left, right, top, bottom) of the fire's extent in all frames, px.
        colours: Its colour table.
    """

    mask: FireMask
    points: tuple[FeaturePoints, ...]
    leans: NDArray[np.float64]
    brightness: NDArray[np.float64]
    row_weight: NDArray[np.float64]
    row_centre: NDArray[np.float64]
    row_spread: NDArray[np.float64]
    step: float
    closed: bool
    cut_share: float
    bounds: tuple[int, int, int, int]
    colours: ColourTable

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
        points: Its feature points.
        lean: Its lean, degrees.
        brightness: Mean luminance of the flame's pixels.
        rows: (3, H) weight, centre and spread of each row, as in ``ClipMeasurements``.
        cells: Sums of the flame's colours, as from ``cell_sums``.
    """

    points: FeaturePoints
    lean: float
    brightness: float
    rows: NDArray[np.float64]
    cells: NDArray[np.float64]


def frame_difference(one: Pixels, other: Pixels) -> float:
    """Return the root of the summed squared difference of two frames in linear light. A sum, not a
    mean, so that empty room around the fire does not change it."""
    difference = one - other
    return float(np.sqrt(np.square(difference, out=difference).sum(dtype=np.float64)))


def measure_clip(
    proxied: ProxiedClip, name: str, threshold: float | None, cells: int, workers: Workers
) -> ClipMeasurements:
    """Measure every frame of a clip; messages call it ``name``.

    ``threshold`` is the brightness (0..255) above which a pixel is flame; None: chosen here.
    ``cells`` are those in a row and in a column of its colour table.

    Raises:
        SourceError: The clip does not show a single, upright flame that is not cut off.
    """
    threshold, cut_share = refuse_unfit(proxied.proxy, name, threshold, workers)
    clip = proxied.clip
    mask = FireMask.of(clip, threshold)
    found: list[_FrameMeasurements] = []
    steps: list[float] = []
    first = before = np.zeros((clip.height, clip.width, 4), np.float32)
    visible = np.zeros((clip.height, clip.width), np.bool_)
    for frame, fire in workers.map(lambda i: _measure(clip, mask, cells, i), range(clip.count)):
        visible |= fire[..., 3] > _MAX_EMPTY_COVERAGE
        if found:
            steps.append(frame_difference(before, fire))
        first, before = first if found else fire, fire
        found.append(frame)
    seam = frame_difference(before, first)
    weight, centre, spread = np.stack([frame.rows for frame in found]).transpose(1, 0, 2)
    return ClipMeasurements(
        mask=mask,
        points=tuple(frame.points for frame in found),
        # As precise as in the profile file, so that both give the same fire.
        leans=np.array([frame.lean for frame in found]).round(3),
        brightness=np.array([frame.brightness for frame in found]),
        row_weight=weight,
        row_centre=centre,
        row_spread=spread,
        step=float(np.quantile(steps, 0.99)),
        closed=seam <= _MAX_SEAM_RATIO * float(np.quantile(steps, 0.9)),
        cut_share=cut_share,
        bounds=_bounds(visible),
        colours=colour_table(np.sum([frame.cells for frame in found], axis=0)),
    )


def _measure(clip: Clip, mask: FireMask, cells: int, i: int) -> tuple[_FrameMeasurements, Pixels]:
    """Measure one frame; also return its fire alone."""
    pixels = clip.read(i)
    bright = brightness(pixels, mask.blend_space)
    flame = largest_flame(mask.binarized_brightness(bright))
    fire = mask.isolated(pixels, bright)
    light = luminance(fire).astype(np.float64)
    measured = _FrameMeasurements(
        points=feature_points(flame),
        lean=flame_lean(flame),
        brightness=float(light[flame].mean()),
        rows=_row_moments(np.sqrt(np.maximum(light, 0))),
        cells=cell_sums(fire, flame, cells),
    )
    return measured, fire


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
