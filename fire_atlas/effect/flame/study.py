"""Study a whole clip before its frames are analysed: where its flame is, and how strong.

The values decided here (ε, α, the flame's box) hold for every frame, so that none flickers.
"""

from dataclasses import dataclass, replace
from functools import partial, reduce

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.direction import UP, flame_direction
from fire_atlas.effect.flame.features import Box, gradient_magnitude, kappa
from fire_atlas.effect.flame.fires import Fire, Fires, Labels, separate_fires
from fire_atlas.effect.flame.samples import FlameSamples
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.recipe.effect import PAPER_ALPHA, Features
from fire_atlas.vision.pixel_grid import NOT_ENLARGED, PixelGrid
from fire_atlas.vision.sampling import evenly_spread

_MIN_SAMPLES, _MAX_SAMPLES = 6, 12
"""Minimum and maximum number of frames studied, evenly spread over the clip. Between these limits
it is every other frame, because neighbours are much alike."""

_EPSILON_QUANTILE = 0.70
"""Automatic ε is this quantile of the gradients of the flame's pixels."""

_ALPHA_QUANTILE = 0.5
"""Automatic α is this quantile of the lengths of the flame's feature vectors."""

_BURNT_OUT = 0.02
"""A flame that gives less than this fraction of its median light has burnt out."""

_MIN_EPSILON = 1.0
"""Minimum of the automatic ε; weaker gradients are the noise of 8-bit quantisation."""


@dataclass(frozen=True, slots=True)
class FlameStudy:
    """Measurements that hold for all frames of a clip.

    Attributes:
        buoyancy: F_buoyancy of eq. 3, a unit vector in image axes.
        box: Bounding box of the flame over all frames.
        base: (x, y) of the flame's foot, px.
        moving_area: Area within the box in which fire moves, heights².
        segmentation: Separates flame from everything else.
        fires: The separate fires: each has its own ε, α and candidates.
        kappa: (H, W) float32, κ of each pixel (eq. 2), in its own fire.
        mean_gradient: Mean ‖∇f‖ of the features, the unit of the feature force.
        dies_out: Whether almost nothing of the flame is left in the last frame.
        samples: Small copies of a few frames; None if no step needs them.
        art: The pixels of pixel art, which may be enlarged.
    """

    buoyancy: tuple[float, float]
    box: Box
    base: tuple[float, float]
    moving_area: float
    segmentation: FlameSegmentation
    fires: Fires
    kappa: Plane
    mean_gradient: float
    dies_out: bool
    samples: FlameSamples | None = None
    art: PixelGrid = NOT_ENLARGED

    def cropped(self, window: Window) -> "FlameStudy":
        """Return the study of a window of the frame."""
        segmentation = self.segmentation.cropped(window)
        kappa, fires = self.kappa[window.slices], self.fires.cropped(window)
        art = self.art.cropped(window)
        return replace(self, segmentation=segmentation, kappa=kappa, fires=fires, art=art)


def study_flame(
    clip: Clip,
    features: Features,
    buoyancy: tuple[float, float] | None,
    workers: Workers,
    *,
    is_sampled: bool = True,
) -> FlameStudy:
    """Measure a few frames of a clip and return the values that hold for all of it.

    Args:
        clip: The clip as it is played.
        features: The recipe's section.
        buoyancy: F_buoyancy, a unit vector in image axes, along which κ grows; None for the
            direction in which the flame moves by its samples, up without these.
        workers: Read and measure frames.
        is_sampled: Whether samples are measured.
    """
    count = min(max(clip.body // 2, _MIN_SAMPLES), _MAX_SAMPLES)
    numbers = evenly_spread(0, clip.body - 1, count)
    planes = list(workers.map(clip.brightness, numbers))
    segmentation = FlameSegmentation.estimate(planes, is_opaque=clip.matte == "none")
    readers = [partial(clip.read, number) for number in numbers]
    masks = list(
        workers.map(lambda pair: segmentation.mask(*pair), zip(planes, readers, strict=True))
    )
    if clip.burning is not None:  # flakes are born of fire, not of smoke
        shares = workers.map(clip.burning, numbers)
        masks = [as_plane(mask * share) for mask, share in zip(masks, shares, strict=True)]
    samples = FlameSamples.of(clip, segmentation, workers) if is_sampled else None
    if buoyancy is None:
        buoyancy = flame_direction(samples) if samples else UP
    total = as_plane(reduce(np.add, masks))
    box, base = _flame_box(total)
    if features.preset == "paper":  # which knows one fire, and has features in the whole image
        labels, inside = np.zeros(total.shape, np.uint8), (slice(None), slice(None))
    else:
        labels, inside = separate_fires(masks), segmentation.active_window(1).slices
    weight = _kappa(total, labels, features, buoyancy)
    slopes = workers.map(
        lambda plane: gradient_magnitude(plane[inside], features.sigma, features.kernel), planes
    )
    pairs = [(slope, mask[inside]) for slope, mask in zip(slopes, masks, strict=True)]
    parts = total[inside], labels[inside], weight[inside]
    fires, mean_gradient = _measured(pairs, *parts, features, workers)
    return FlameStudy(
        buoyancy, box, base, _moving_area(segmentation.activity, box), segmentation,
        Fires(labels, fires), weight, mean_gradient, _dies_out(planes, masks), samples,
    )  # fmt: skip


def _kappa(
    total: Plane, labels: Labels, features: Features, buoyancy: tuple[float, float]
) -> Plane:
    """Return κ of each pixel, (H, W): over the box of its own fire, or over the image.

    ``total`` is the sum of the flame's masks.
    """
    height, width = total.shape
    if features.kappa_over == "image":
        return kappa(total.shape, Box(0, 0, width - 1, height - 1), buoyancy, features.n)
    weight = np.zeros_like(total)
    for number in range(int(labels.max()) + 1):
        own = labels == number
        box, _ = _flame_box(as_plane(total * own))
        np.copyto(weight, kappa(total.shape, box, buoyancy, features.n), where=own)
    return weight


def _measured(
    pairs: list[tuple[Plane, Plane]],
    total: Plane,
    labels: Labels,
    weight: Plane,
    features: Features,
    workers: Workers,
) -> tuple[tuple[Fire, ...], float]:
    """Measure each fire, and the mean ‖∇f‖ of all features, in a window with all of the flame.

    Features of the paper are counted wherever they are, by its own α; others in the flame.

    Args:
        pairs: Gradients and masks (H, W) of a few frames.
        total: (H, W) sum of the masks.
        labels: The fire of each pixel.
        weight: κ of each pixel.
        features: The recipe's section.
        workers: Measure frames.
    """
    area = np.bincount(labels.ravel(), total.ravel())
    shares = area / area.sum() if area.sum() else np.ones(1)
    is_paper = features.preset == "paper"
    fires, found = list[Fire](), list[NDArray[np.float32]]()
    for number, share in enumerate(shares):
        own = pairs
        if len(shares) > 1:
            own = [(slope, as_plane(mask * (labels == number))) for slope, mask in pairs]
        epsilon = features.epsilon
        if epsilon == "auto":
            epsilon = _automatic_epsilon(own, workers)
        if is_paper:
            own = [(slope, np.ones_like(mask)) for slope, mask in own]
        lengths = list(workers.map(partial(_feature_lengths, kappa=weight, epsilon=epsilon), own))
        alpha = _automatic_alpha(lengths)
        usual = PAPER_ALPHA if is_paper else alpha
        count = float(
            np.mean([np.count_nonzero(frame_lengths > usual) for frame_lengths in lengths])
        )
        fires.append(Fire(float(share), epsilon, alpha, max(count, 1.0)))
        found += [slope[(slope > epsilon) & (mask > 0)] for slope, mask in own]
    gradients = np.concatenate(found)
    return tuple(fires), float(gradients.mean()) if gradients.size else 1.0


def _flame_box(total: Plane) -> tuple[Box, tuple[float, float]]:
    """Bounding box of the flame without stray pixels, and (x, y) of the flame's foot, px.

    ``total`` is the sum of its masks, (H, W).
    """
    height, width = total.shape
    if not total.any():
        return Box(0.0, 0.0, width - 1.0, height - 1.0), (width / 2, float(height))
    (left, right), (top, bottom) = (_central_range(total.sum(axis=axis)) for axis in (0, 1))
    foot = total[max(0, int(bottom - (bottom - top) * 0.15)) : int(bottom) + 1].sum(axis=0)
    x = float((foot * (np.arange(width) + 0.5)).sum() / max(foot.sum(), 1e-6))
    return Box(left, top, right, bottom), (x, bottom + 1.0)


def _moving_area(activity: Plane, box: Box) -> float:
    """Area of the box in which anything moves, heights²."""
    inside = activity[int(box.top) : int(box.bottom) + 1, int(box.left) : int(box.right) + 1]
    return float(inside.sum()) / len(activity) ** 2


def _dies_out(planes: list[Plane], masks: list[Plane]) -> bool:
    """Whether the flame's light (about its squared brightness) has burnt out by the last frame."""
    light = [float((mask * plane * plane).sum()) for plane, mask in zip(planes, masks, strict=True)]
    burning = [amount for amount in light if amount > 0]
    return bool(burning) and light[-1] < _BURNT_OUT * float(np.median(burning))


def _central_range(profile: Plane) -> tuple[float, float]:
    """First and last index of the central 99 % of the sum of ``profile``."""
    total = np.cumsum(profile, dtype=np.float64)
    first, last = np.searchsorted(total, total[-1] * np.array([0.005, 0.995]))
    return float(first), float(last)


def _automatic_epsilon(pairs: list[tuple[Plane, Plane]], workers: Workers) -> float:
    """Automatic ε from the gradients and masks of a few frames."""
    inside = np.concatenate(list(workers.map(lambda pair: pair[0][pair[1] > 0.5], pairs)))
    if not inside.size:
        return _MIN_EPSILON
    return max(float(np.quantile(inside, _EPSILON_QUANTILE)), _MIN_EPSILON)


def _feature_lengths(
    pair: tuple[Plane, Plane], kappa: Plane, epsilon: float
) -> NDArray[np.float32]:
    """‖Fv‖ of the feature pixels of a frame with these gradients and this mask, (features,)."""
    slope, mask = pair
    places = np.flatnonzero((slope > epsilon) & (mask > 0) & (kappa > 0))
    return slope.ravel()[places] * kappa.ravel()[places] * mask.ravel()[places]


def _automatic_alpha(lengths: list[NDArray[np.float32]]) -> float:
    """Automatic α, from ‖Fv‖ of the features of a few frames."""
    features = np.concatenate(lengths)
    return float(np.quantile(features, _ALPHA_QUANTILE)) if features.size else 0.0
