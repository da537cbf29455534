"""Test motion vectors: rebuild known frames from their neighbours and the encoded vectors, as the
engine would, and compare the error with that of plain blending.

The result goes into the manifest; its figures are written and read here.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.statistics import by_animation
from fire_atlas.maps.vectors.encoding import MotionEncoding
from fire_atlas.maps.vectors.held_out import HeldOutFrame, reliability, squared_error
from fire_atlas.vision.warp import pixel_centres, sample_at

_MIN_GAIN = 0.005
"""Minimum gain when testing on skipped source frames; less may be chance and would not be seen. If
a played frame is predicted from its two neighbours (a step twice as long, harder to predict), any
gain is enough."""

_STILL = 1e-12
"""Squared error of plain blending, summed over frames, up to which nothing moves in a clip."""


@dataclass(frozen=True, slots=True)
class ValidationReport:
    """How much closer motion vectors come to held-out frames than plain blending does.

    Attributes:
        held_out: Number of frames that were held out.
        gain: The fraction of plain blending's error (root mean square) that the vectors remove;
            negative if they add error.
        helps: Whether the gain is more than chance. If not, no vectors are written.
        still: Whether nothing moves: held-out frames are as their neighbours.
    """

    held_out: int
    gain: float
    helps: bool
    still: bool = False


def cross_validate(
    held_out: Sequence[HeldOutFrame], encoding: MotionEncoding
) -> ValidationReport | None:
    """Predict held-out frames as the engine would blend them, and compare; None if there are none.

    Two-fold: every other frame is predicted with the reliability measured on the frames between.
    """
    if not held_out:
        return None
    plain = moved = 0.0
    for tested, others in ((held_out[::2], held_out[1::2]), (held_out[1::2], held_out[::2])):
        weight = reliability(others, held_out[0].actual.shape[:2])
        for frame in tested:
            blended = frame.blended(frame.before.astype(np.float32), frame.after.astype(np.float32))
            plain += _mean_squared_error(blended, frame.actual)
            moved += _mean_squared_error(_seen(frame, weight, encoding), frame.actual)
    if plain <= _STILL:
        return ValidationReport(len(held_out), 0.0, helps=False, still=True)
    gain = 1 - math.sqrt(moved / plain)
    min_gain = _MIN_GAIN if held_out[0].span == 1 else 0.0
    return ValidationReport(len(held_out), gain, gain > min_gain)


def _mean_squared_error(predicted: NDArray[np.float32], actual: Bytes) -> float:
    return float(np.mean(squared_error(predicted, actual), dtype=np.float64))


def _seen(frame: HeldOutFrame, weight: Plane, encoding: MotionEncoding) -> NDArray[np.float32]:
    """Return the frame that the engine shows, computed in its own axes from encoded vectors."""
    height, width = weight.shape
    unit = np.array(encoding.unit_pixels((width, height)), np.float32)
    vectors = [as_plane(flow * weight[..., None] / unit) for flow in frame.vectors]
    # The scale of the encoding is this frame's own maximum.
    scale = max(float(max(np.abs(flow).max() for flow in vectors)), 1e-6)
    maps = [encoding.encode(as_plane(flow / np.float32(scale))) for flow in vectors]
    columns, rows = pixel_centres(width, height)
    upwards = encoding.green == "up"
    place = np.stack([columns, height - 1 - rows if upwards else rows], axis=2)
    seen = []
    shifts = -frame.blend, 1 - frame.blend
    for image, data, shift in zip((frame.before, frame.after), maps, shifts, strict=True):
        at = as_plane(place + encoding.decoded(data) * (unit * scale) * np.float32(shift))
        y = height - 1 - at[..., 1] if upwards else at[..., 1]
        seen.append(sample_at(image.astype(np.float32), at[..., 0], y))
    return frame.blended(seen[0], seen[1])


def motion_statistics(report: ValidationReport | None) -> dict[str, Any]:
    """Return the manifest's statistics of an animation's vectors; gains to four digits.

    ``report`` is None if the animation was too short to hold out a frame.
    """
    if report is None:
        return {"motion": None}
    return {
        "motion": {
            "held_out": report.held_out,
            "written": report.helps,
            "gain": round(report.gain, 4),
            **({"still": True} if report.still else {}),
        }
    }


def read_reports(statistics: dict[str, Any]) -> dict[str, ValidationReport | None]:
    """Return the report of each animation with vectors, by its name, from a manifest's statistics.

    Statistics may be nested by animation or member; a single animation has the name "".

    Raises:
        ValueError: The figures are not in the form that ``motion_statistics`` writes.
    """
    return {
        name: _report(figures["motion"])
        for name, figures in by_animation(statistics)
        if "motion" in figures
    }


def _report(figures: Any) -> ValidationReport | None:
    match figures:
        case None:
            return None
        case {"held_out": int(held_out), "written": bool(helps), "gain": float(gain)}:
            return ValidationReport(held_out, gain, helps, figures.get("still") is True)
    raise ValueError(f"{figures!r} are no figures of motion vectors")
