"""A seam: a few frames in which the end of one take becomes the beginning of the next.

A plain cross-fade shows both ends at once, as ghosts, and pales: the mean of two flames that have
nothing to do with each other has 0.71 of their contrast. Here both sides are first warped towards
each other, every place passes over when it looks most alike in both, and the contrast is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, Plane, as_plane, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.blending import Blend
from fire_atlas.vision.flow import flow_size
from fire_atlas.vision.warp import (
    Field,
    Motion,
    blurred,
    both_warped,
    met,
    motion_between,
    over_channels,
    resized,
    shapes,
    warped,
)

_AREA = 200 * 200
"""Most px of the pictures on which a seam is planned."""

_KEPT = 64 * 64
"""Most px of the planes that are kept: they are smooth."""

_SOFTNESS = 0.02
"""Neighbouring places move alike over this part of the height."""

_NEAR = 0.03
"""Places pass over together, and have contrast together, over this part of the height."""

_STEADY = 1.5
"""Standard deviation, frames, over which displacements change: a match that comes and goes would
shake."""

_CHOOSY = 10.0
"""How much faster a place passes over while it looks alike in both."""

_DARK = 1e-5
"""Squared deviation of light that is below what 8 bits show."""


def plan_seam(
    clip: Clip, pairs: Sequence[tuple[int, int]], mean: Pixels, workers: Workers
) -> tuple[Blend, ...]:
    """Return how to blend each of ``pairs`` (frame of the ending, frame of the beginning).

    Args:
        clip: Where the frames are.
        pairs: In the order in which they are shown.
        mean: (h, w, 4) of the whole clip, small.
        workers: To read and compare them.
    """
    size = flow_size(clip.width, clip.height, _AREA)
    around = resized(mean, size)
    looks = list(workers.map(lambda pair: _compare(clip, pair, size), pairs))
    parts = [(k + 1) / (len(pairs) + 1) for k in range(len(pairs))]
    motions = _steadied([look.motion for look in looks])
    meetings = [
        _meeting(look, motion, part)
        for look, motion, part in zip(looks, motions, parts, strict=True)
    ]
    passed = _passing([meeting.difference for meeting in meetings])
    kept = flow_size(clip.width, clip.height, _KEPT)
    return tuple(
        Blend(
            (meeting.warps[0].of_size(kept), meeting.warps[1].of_size(kept)),
            *_weights(meeting, part, around, kept),
        )
        for meeting, part in zip(meetings, passed, strict=True)
    )


@dataclass(frozen=True, slots=True)
class _Look:
    """Both sides of one frame of a seam, small, and their common shapes."""

    sides: tuple[Pixels, Pixels]
    motion: Motion


@dataclass(frozen=True, slots=True)
class _Meeting:
    """Both sides warped to where they meet, and how they differ there: (h, w)."""

    warps: tuple[Field, Field]
    sides: tuple[Pixels, Pixels]
    difference: Plane


def _compare(clip: Clip, pair: tuple[int, int], size: tuple[int, int]) -> _Look:
    one, other = (resized(clip.read(i), size) for i in pair)
    before, after = (shapes(side, clip.blend_space) for side in (one, other))
    return _Look((one, other), motion_between(before, after, _SOFTNESS))


def _steadied(motions: Sequence[Motion]) -> list[Motion]:
    """Return motions that change little from one frame of the seam to the next."""
    at = np.arange(len(motions))
    weights = np.exp(-0.5 * ((at[:, None] - at) / _STEADY) ** 2)
    weights /= weights.sum(axis=1, keepdims=True)

    def mean(row: "np.ndarray[tuple[int], np.dtype[np.float64]]", side: int) -> Field:
        planes = []
        for axis in (0, 1):
            total = np.zeros_like(motions[0][side][axis])
            for weight, motion in zip(row, motions, strict=True):
                total += np.float32(weight) * motion[side][axis]
            planes.append(total)
        return Field(*planes)

    return [Motion(mean(row, 0), mean(row, 1)) for row in weights]


def _meeting(look: _Look, motion: Motion, part: float) -> _Meeting:
    """Warp both sides as far as that makes them more alike."""
    reach = _NEAR * look.sides[0].shape[0]
    apart = blurred(_square(*look.sides), reach)
    halves = met(motion, 0.5)
    left = blurred(
        _square(*(warped(*each) for each in zip(look.sides, halves, strict=True))), reach
    )
    explained = 1 - np.sqrt(left / (apart + np.float32(_DARK)))
    gate = as_plane(np.clip(1.5 * explained, 0, 1))
    gated = Motion(motion.there.scaled(gate), motion.back.scaled(gate))
    warps = met(gated, part)
    one, other = both_warped(look.sides, warps)
    difference = as_plane(np.sqrt(_square(one, other)))
    return _Meeting(warps, (one, other), blurred(difference, reach))


def _passing(differences: Sequence[Plane]) -> list[Plane]:
    """How far each place has passed over in each frame of the seam, (h, w) in 0..1.

    A place passes over faster while it looks alike in both sides than while it does not.
    """
    stack = np.stack(differences)
    relative = stack / (stack.mean(axis=0) + np.float32(1e-3))
    relative -= relative.mean(axis=0)
    between = (relative[1:] + relative[:-1]) / 2
    speed = np.exp(-np.float32(_CHOOSY) * np.concatenate([relative[:1], between, relative[-1:]]))
    way = np.cumsum(speed, axis=0, dtype=np.float32)
    return [as_plane(way[k] / way[-1]) for k in range(len(differences))]


def _weights(
    meeting: _Meeting, passed: Plane, mean: Pixels, kept: tuple[int, int]
) -> tuple[Plane, Plane]:
    """Share of the second side, and the gain that keeps the contrast of both.

    The weights grow like cos and sin of an angle. The variance of a mix (1 − w, w) of two sides of
    one variance is (1 − w)² + w² + 2 w (1 − w) ρ of it: the gain is the inverse of its root, and
    for sides that have nothing in common, ρ = 0, this is 1/√(w² + (1 − w)²).
    """
    reach = _NEAR * passed.shape[0]
    one, other = (luminance(as_plane(side - mean)) for side in meeting.sides)
    floor = np.float32(_DARK)
    common = blurred(as_plane(one * other), reach) + floor
    power = (blurred(as_plane(side * side), reach) + floor for side in (one, other))
    alike = np.clip(common / np.sqrt(np.multiply(*power)), 0, 1)
    angle = passed * np.float32(np.pi / 2)
    share = np.sin(angle) / (np.cos(angle) + np.sin(angle))
    rest = 1 - share
    gain = 1 / np.sqrt(rest**2 + share**2 + 2 * rest * share * alike)
    return resized(as_plane(share), kept), resized(as_plane(gain), kept)


def _square(one: Pixels, other: Pixels) -> Plane:
    """Squared difference of two frames, summed over channels: (h, w)."""
    apart = cv2.subtract(one, other)
    return over_channels(cv2.multiply(apart, apart))
