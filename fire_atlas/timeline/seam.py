"""Blend the end of one stretch of a clip into the beginning of the next over a few frames.

A plain cross-fade shows both ends at once, as ghosts, and pales: the mean of two unrelated flames
has 0.71 of their contrast. Here both sides are first warped towards each other, each place changes
sides when both look most alike there, and the contrast is kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, Plane, as_plane, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.flow import flow_size, resized
from fire_atlas.vision.palette import Palette
from fire_atlas.vision.thumbnails import detail_energy, gradient_product
from fire_atlas.vision.warp import (
    BidirectionalFlow,
    FlowField,
    bidirectional_flow,
    blurred,
    flow_input,
    intermediate_flows,
    over_channels,
    warp,
)

_PLAN_AREA = 200 * 200
"""Maximum area of the pictures on which a seam is planned, px²."""

_KEPT_AREA = 64 * 64
"""Maximum area of the planes kept in a plan, px²; they are smooth, so that this is enough."""

_FLOW_SMOOTHING = 0.02
"""Standard deviation of the Gaussian that smooths the flow, as a fraction of the height."""

_NEIGHBOURHOOD = 0.03
"""Standard deviation over which sides are compared and contrast is measured, in the same unit."""

_TEMPORAL_SMOOTHING = 1.5
"""Standard deviation, frames, over which flows are averaged: a flow that changes from frame to
frame would shake the picture."""

_PREFERENCE = 10.0
"""How strongly a place prefers to change sides while both look alike there."""

_DARK = 1e-5
"""Squared difference of light that 8 bits do not show."""

_WARPING = 1.5
"""A place is warped by its flow times this times the fraction of the difference between both sides
that warping removes there, at most by all of its flow."""

_BLUR_SIGMA = 1.0
"""Standard deviation, px, of the Gaussian that separates the detail which warping blurs."""

_MAX_SHARPENING = 0.5
"""Maximum factor by which this detail is added again."""


@dataclass(frozen=True, slots=True)
class BlendPlan:
    """How one frame of a seam is blended from one frame of each side.

    Attributes:
        flows: Flow by which each side is warped, so that both align.
        weight: (h, w), weight of the second side at each place, 0..1.
        gain: (h, w), how much to raise the contrast of the mix, as a factor on its difference from
            the clip's mean frame.
    """

    flows: tuple[FlowField, FlowField]
    weight: Plane
    gain: Plane

    def blend(self, ending: Pixels, beginning: Pixels, mean: Pixels, palette: Palette) -> Pixels:
        """Return the frame, (H, W, 4).

        Its light and coverage are decided first; each pixel then gets the colour that such light
        has in the clip.

        Args:
            ending, beginning: The frame of each side.
            mean: Mean frame of the clip, of any size.
            palette: Colours of the clip.
        """
        size = ending.shape[1], ending.shape[0]
        one, other = warp(ending, self.flows[0]), warp(beginning, self.flows[1])
        weight, gain = resized(self.weight, size), resized(self.gain, size)
        frames = resized(mean, size), one, other
        light = _mixed([luminance(frame) for frame in frames], weight, gain)
        coverage = _mixed(
            [as_plane(cv2.extractChannel(frame, 3)) for frame in frames], weight, gain
        )
        share = float(self.weight.mean())
        energy = (1 - share) * detail_energy(ending) + share * detail_energy(beginning)
        return palette.mix(one, other, weight, _sharpened(light, energy), coverage)


def _sharpened(light: Plane, energy: float) -> Plane:
    """Return ``light`` sharpened to a mean squared gradient of ``energy``, if warping blurred it.

    The plane f becomes f + a·d, d its detail, with ‖∇f‖² + 2a ∇f·∇d + a² ‖∇d‖² = ``energy``.
    """
    detail = as_plane(light - cv2.GaussianBlur(light, (0, 0), _BLUR_SIGMA))
    own, cross, added = (
        gradient_product(light, light),
        gradient_product(light, detail),
        gradient_product(detail, detail),
    )
    if own >= energy or added <= 0:
        return light
    amount = (math.sqrt(cross**2 + added * (energy - own)) - cross) / added
    return np.maximum(light + detail * np.float32(min(amount, _MAX_SHARPENING)), 0)


def _mixed(planes: Sequence[Plane], weight: Plane, gain: Plane) -> Plane:
    """Mix two planes, and multiply the deviation of the mix from the mean by ``gain``.

    The result stays within the range of both sides. ``planes``: the mean and both sides.
    """
    mean, one, other = planes
    mixed = one + (other - one) * weight
    low, high = np.minimum(one, other), np.maximum(one, other)
    return as_plane(np.clip(mean + gain * (mixed - mean), low, high))


def plan_seam(
    clip: Clip, pairs: Sequence[tuple[int, int]], mean: Pixels, workers: Workers
) -> tuple[BlendPlan, ...]:
    """Return how to blend each of ``pairs`` (frame of the ending, frame of the beginning).

    Args:
        clip: The clip that is cut.
        pairs: Frame numbers, in the order in which the seam shows them.
        mean: (h, w, 4), mean frame of the clip, of any size.
        workers: Read and compare the pairs in parallel.
    """
    size = flow_size(clip.width, clip.height, _PLAN_AREA)
    around = resized(mean, size)
    found = list(workers.map(lambda pair: _pair_of(clip, pair, size), pairs))
    times = [(k + 1) / (len(pairs) + 1) for k in range(len(pairs))]
    flows = _smoothed_over_time([pair.flow for pair in found])
    aligned = [
        _aligned(pair, flow, time) for pair, flow, time in zip(found, flows, times, strict=True)
    ]
    progress = _progress([pair.difference for pair in aligned])
    kept = flow_size(clip.width, clip.height, _KEPT_AREA)
    return tuple(
        BlendPlan(
            (pair.flows[0].resized(kept), pair.flows[1].resized(kept)),
            *_weights(pair, passed, around, kept),
        )
        for pair, passed in zip(aligned, progress, strict=True)
    )


@dataclass(frozen=True, slots=True)
class _Pair:
    """Small copies of both sides of one frame of a seam, and the flow between them."""

    sides: tuple[Pixels, Pixels]
    flow: BidirectionalFlow


@dataclass(frozen=True, slots=True)
class _AlignedPair:
    """Both sides warped so that they align, and their remaining difference, (h, w)."""

    flows: tuple[FlowField, FlowField]
    sides: tuple[Pixels, Pixels]
    difference: Plane


def _pair_of(clip: Clip, pair: tuple[int, int], size: tuple[int, int]) -> _Pair:
    one, other = (resized(clip.read(i), size) for i in pair)
    before, after = (flow_input(side, clip.blend_space) for side in (one, other))
    return _Pair((one, other), bidirectional_flow(before, after, _FLOW_SMOOTHING))


def _smoothed_over_time(flows: Sequence[BidirectionalFlow]) -> list[BidirectionalFlow]:
    """Average flows over neighbouring frames of the seam, so that they change little."""
    at = np.arange(len(flows))
    weights = np.exp(-0.5 * ((at[:, None] - at) / _TEMPORAL_SMOOTHING) ** 2)
    weights /= weights.sum(axis=1, keepdims=True)
    return [
        BidirectionalFlow(
            _weighted_mean([flow.forward for flow in flows], row),
            _weighted_mean([flow.backward for flow in flows], row),
        )
        for row in weights
    ]


def _weighted_mean(fields: Sequence[FlowField], weights: NDArray[np.float64]) -> FlowField:
    planes = []
    for axis in (0, 1):
        total = np.zeros_like(fields[0][axis])
        for weight, field in zip(weights, fields, strict=True):
            total += np.float32(weight) * field[axis]
        planes.append(total)
    return FlowField(*planes)


def _aligned(pair: _Pair, flow: BidirectionalFlow, time: float) -> _AlignedPair:
    """Warp both sides towards each other, each place as far as that makes them more alike."""
    sigma = _NEIGHBOURHOOD * pair.sides[0].shape[0]
    before = blurred(_squared_difference(*pair.sides), sigma)
    halves = _both_warped(pair.sides, intermediate_flows(flow, 0.5))
    after = blurred(_squared_difference(*halves), sigma)
    removed = 1 - np.sqrt(after / (before + np.float32(_DARK)))
    gate = as_plane(np.clip(_WARPING * removed, 0, 1))
    gated = BidirectionalFlow(flow.forward.scaled(gate), flow.backward.scaled(gate))
    flows = intermediate_flows(gated, time)
    sides = _both_warped(pair.sides, flows)
    difference = as_plane(np.sqrt(_squared_difference(*sides)))
    return _AlignedPair(flows, sides, blurred(difference, sigma))


def _both_warped(
    sides: tuple[Pixels, Pixels], flows: tuple[FlowField, FlowField]
) -> tuple[Pixels, Pixels]:
    return warp(sides[0], flows[0]), warp(sides[1], flows[1])


def _progress(differences: Sequence[Plane]) -> list[Plane]:
    """How far each place has changed sides in each frame of the seam, (h, w) in 0..1.

    A place changes faster while both sides look alike there than while they do not.
    """
    stack = np.stack(differences)
    relative = stack / (stack.mean(axis=0) + np.float32(1e-3))
    relative -= relative.mean(axis=0)
    between = (relative[1:] + relative[:-1]) / 2
    exponent = np.concatenate([relative[:1], between, relative[-1:]])
    speed = np.exp(-np.float32(_PREFERENCE) * exponent)
    distance = np.cumsum(speed, axis=0, dtype=np.float32)
    return [as_plane(distance[k] / distance[-1]) for k in range(len(differences))]


def _weights(
    pair: _AlignedPair, progress: Plane, mean: Pixels, kept: tuple[int, int]
) -> tuple[Plane, Plane]:
    """Weight of the second side, and the gain that keeps the contrast of both, each (h, w).

    The weights are in the ratio of cos and sin of an angle. If two sides of equal variance have
    correlation ρ, their mix (1 − w, w) has (1 − w)² + w² + 2 w (1 − w) ρ of that variance; the gain
    is the inverse of its square root.
    """
    sigma = _NEIGHBOURHOOD * progress.shape[0]
    one, other = (luminance(as_plane(side - mean)) for side in pair.sides)
    floor = np.float32(_DARK)
    common = blurred(as_plane(one * other), sigma) + floor
    power = (blurred(as_plane(side * side), sigma) + floor for side in (one, other))
    correlation = np.clip(common / np.sqrt(np.multiply(*power)), 0, 1)
    angle = progress * np.float32(np.pi / 2)
    weight = np.sin(angle) / (np.cos(angle) + np.sin(angle))
    rest = 1 - weight
    gain = 1 / np.sqrt(rest**2 + weight**2 + 2 * rest * weight * correlation)
    return resized(as_plane(weight), kept), resized(as_plane(gain), kept)


def _squared_difference(one: Pixels, other: Pixels) -> Plane:
    """Squared difference of two frames, summed over channels: (h, w)."""
    difference = cv2.subtract(one, other)
    return over_channels(cv2.multiply(difference, difference))
