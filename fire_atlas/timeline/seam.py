"""Blend the end of one stretch of a clip into the beginning of the next over a few frames.

A plain cross-fade shows both ends at once, as ghosts, and pales: the mean of two flames that have
nothing to do with each other has 0.71 of their contrast. Here both sides are first warped towards
each other, every place passes over when both sides look most alike there, and the contrast is kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Pixels, Plane, as_plane, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.flow import flow_size, resized
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
"""Most px of the pictures on which a seam is planned."""

_KEPT_AREA = 64 * 64
"""Most px of the planes that are kept of a plan: they are smooth."""

_FLOW_SMOOTHING = 0.02
"""Standard deviation of the Gaussian that smooths the flow, as a fraction of the height."""

_NEIGHBOURHOOD = 0.03
"""Standard deviation over which sides are compared and contrast is measured, as the same."""

_TEMPORAL_SMOOTHING = 1.5
"""Standard deviation, frames, over which flows are averaged: a match that comes and goes would
shake."""

_PREFERENCE = 10.0
"""How strongly a place prefers to pass over while both sides look alike there."""

_DARK = 1e-5
"""Squared deviation of light that is below what 8 bits show."""

_BLUR_SIGMA = 1.0
"""Standard deviation of the detail that warping blurs, px."""

_MOST_SHARPENING = 0.5
"""Largest factor by which this detail is added again."""

_FAINT = 1e-4
"""Light that is below what 8 bits show."""


@dataclass(frozen=True, slots=True)
class BlendPlan:
    """How one frame of a seam is made of one frame of each side.

    Attributes:
        flows: By which each side is warped to where both meet.
        share: (h, w), weight of the second side at each place, 0..1.
        gain: (h, w), by how much the mix must deviate more from the mean, to keep its contrast.
    """

    flows: tuple[FlowField, FlowField]
    share: Plane
    gain: Plane

    def blend(self, ending: Pixels, beginning: Pixels, mean: Pixels) -> Pixels:
        """Return the frame, (H, W, 4); ``mean``, of the clip, may be small."""
        size = ending.shape[1], ending.shape[0]
        one, other = warp(ending, self.flows[0]), warp(beginning, self.flows[1])
        share, gain = resized(self.share, size), resized(self.gain, size)
        mixed = as_plane(one + (other - one) * share[..., None])
        planes = mixed, resized(mean, size), one, other
        light = _with_contrast([luminance(frame) for frame in planes], gain)
        cover = _with_contrast([as_plane(cv2.extractChannel(frame, 3)) for frame in planes], gain)
        blended = _with_light(_fire_coloured_mix(one, other, share), light, cover, mixed)
        whole = float(self.share.mean())
        wanted = (1 - whole) * detail_energy(ending) + whole * detail_energy(beginning)
        return _sharpened(blended, wanted)


def _with_light(hues: Pixels, light: Plane, cover: Plane, mixed: Pixels) -> Pixels:
    """Return ``hues``, changed in place, with that luminance and coverage.

    All colours get the same factor, so that no hue changes; it stops where the strongest would
    have more light than its coverage, or the plain mix, allows.
    """
    floor = np.float32(_FAINT)
    factor = light / np.maximum(luminance(hues), floor)
    most = np.maximum(cover, brightest(mixed))
    factor = np.minimum(factor, most / np.maximum(brightest(hues), floor))
    hues[..., :3] *= factor[..., None]
    hues[..., 3] = cover
    return hues


def _sharpened(pixels: Pixels, energy: float) -> Pixels:
    """Return ``pixels`` with as much detail as ``energy`` says, if warping has blurred them.

    Of detail d the frame gets a·d: ‖∇f‖² + 2a ∇f·∇d + a² ‖∇d‖² = ``energy``.
    """
    detail = as_plane(pixels - cv2.GaussianBlur(pixels, (0, 0), _BLUR_SIGMA))
    light, extra = luminance(pixels), luminance(detail)
    own, cross, added = (
        gradient_product(light, light),
        gradient_product(light, extra),
        gradient_product(extra, extra),
    )
    if own >= energy or added <= 0:
        return pixels
    amount = (math.sqrt(cross**2 + added * (energy - own)) - cross) / added
    sharp = pixels[..., :3] + detail[..., :3] * np.float32(min(amount, _MOST_SHARPENING))
    most = np.maximum(pixels[..., 3], brightest(pixels))
    np.clip(sharp, 0, most[..., None], out=pixels[..., :3])
    return pixels


def _fire_coloured_mix(one: Pixels, other: Pixels, share: Plane) -> Pixels:
    """Return a mix whose hues are those of fire: the fourth root of light is mixed.

    Half-way from white-hot to dark fire is orange; the mean of their light is grey.
    """
    here, there = (as_plane(cv2.sqrt(cv2.sqrt(side))) for side in (one, other))
    mixed = here + (there - here) * share[..., None]
    return as_plane(np.square(np.square(mixed)))


def _with_contrast(planes: Sequence[Plane], gain: Plane) -> Plane:
    """Deviate ``gain`` times more from the mean than the mix does, as far as either side does.

    ``planes``: the mix, the mean and both sides.
    """
    mixed, mean, one, other = planes
    least, most = np.minimum(one, other), np.maximum(one, other)
    return as_plane(np.clip(mean + gain * (mixed - mean), least, most))


def plan_seam(
    clip: Clip, pairs: Sequence[tuple[int, int]], mean: Pixels, workers: Workers
) -> tuple[BlendPlan, ...]:
    """Return how to blend each of ``pairs`` (frame of the ending, frame of the beginning).

    Args:
        clip: Where the frames are.
        pairs: In the order in which they are shown.
        mean: (h, w, 4) of the whole clip, small.
        workers: To read and compare them.
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
    """Both sides of one frame of a seam, small, and the flow between them."""

    sides: tuple[Pixels, Pixels]
    flow: BidirectionalFlow


@dataclass(frozen=True, slots=True)
class _AlignedPair:
    """Both sides warped to where they meet, and how they differ there: (h, w)."""

    flows: tuple[FlowField, FlowField]
    sides: tuple[Pixels, Pixels]
    difference: Plane


def _pair_of(clip: Clip, pair: tuple[int, int], size: tuple[int, int]) -> _Pair:
    one, other = (resized(clip.read(i), size) for i in pair)
    before, after = (flow_input(side, clip.blend_space) for side in (one, other))
    return _Pair((one, other), bidirectional_flow(before, after, _FLOW_SMOOTHING))


def _smoothed_over_time(flows: Sequence[BidirectionalFlow]) -> list[BidirectionalFlow]:
    """Return flows that change little from one frame of the seam to the next."""
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
    """Warp both sides as far as that makes them more alike."""
    sigma = _NEIGHBOURHOOD * pair.sides[0].shape[0]
    before = blurred(_squared_difference(*pair.sides), sigma)
    halves = _both_warped(pair.sides, intermediate_flows(flow, 0.5))
    after = blurred(_squared_difference(*halves), sigma)
    explained = 1 - np.sqrt(after / (before + np.float32(_DARK)))
    gate = as_plane(np.clip(1.5 * explained, 0, 1))
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
    """How far each place has passed over in each frame of the seam, (h, w) in 0..1.

    A place passes over faster while it looks alike in both sides than while it does not.
    """
    stack = np.stack(differences)
    relative = stack / (stack.mean(axis=0) + np.float32(1e-3))
    relative -= relative.mean(axis=0)
    between = (relative[1:] + relative[:-1]) / 2
    exponent = np.concatenate([relative[:1], between, relative[-1:]])
    speed = np.exp(-np.float32(_PREFERENCE) * exponent)
    way = np.cumsum(speed, axis=0, dtype=np.float32)
    return [as_plane(way[k] / way[-1]) for k in range(len(differences))]


def _weights(
    pair: _AlignedPair, progress: Plane, mean: Pixels, kept: tuple[int, int]
) -> tuple[Plane, Plane]:
    """Share of the second side, and the gain that keeps the contrast of both.

    The weights grow like cos and sin of an angle. The variance of a mix (1 − w, w) of two sides of
    one variance and of correlation ρ is (1 − w)² + w² + 2 w (1 − w) ρ of it: the gain is the
    inverse of its root.
    """
    sigma = _NEIGHBOURHOOD * progress.shape[0]
    one, other = (luminance(as_plane(side - mean)) for side in pair.sides)
    floor = np.float32(_DARK)
    common = blurred(as_plane(one * other), sigma) + floor
    power = (blurred(as_plane(side * side), sigma) + floor for side in (one, other))
    correlation = np.clip(common / np.sqrt(np.multiply(*power)), 0, 1)
    angle = progress * np.float32(np.pi / 2)
    share = np.sin(angle) / (np.cos(angle) + np.sin(angle))
    rest = 1 - share
    gain = 1 / np.sqrt(rest**2 + share**2 + 2 * rest * share * correlation)
    return resized(as_plane(share), kept), resized(as_plane(gain), kept)


def _squared_difference(one: Pixels, other: Pixels) -> Plane:
    """Squared difference of two frames, summed over channels: (h, w)."""
    difference = cv2.subtract(one, other)
    return over_channels(cv2.multiply(difference, difference))
