"""Test motion vectors: rebuild known frames from their neighbours and the encoded vectors, as the
engine would, and compare the error with that of plain blending.

The result goes into the manifest; its figures are written and read here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.statistics import by_animation
from fire_atlas.maps.vectors.encoding import MotionEncoding
from fire_atlas.maps.vectors.flow import Method
from fire_atlas.maps.vectors.held_out import (
    HeldOutFrame,
    for_half_the_step,
    reliability,
    squared_error,
)
from fire_atlas.vision.warp import pixel_centres, sample_at

_MIN_GAIN = 0.005
"""Minimum gain when testing on skipped source frames; less may be chance and would not be seen. If
a played frame is predicted from its two neighbours (a step twice as long, harder to predict), any
gain is enough."""

_STILL = 1e-6
"""Residual of plain blending up to which nothing moves in a clip."""

_TIE = 0.01
"""Part of its residual by which Farnebäck's flow has to beat DIS: less may be chance."""


class Residuals(NamedTuple):
    """What is left between held-out frames and what is shown for them: root mean square over their
    pixels and four channels, premultiplied, of 255.

    Attributes:
        blend: Of plain blending.
        vectors: Of motion vectors.
    """

    blend: float
    vectors: float

    @property
    def still(self) -> bool:
        """Whether nothing moves: held-out frames are as their neighbours."""
        return self.blend <= _STILL

    @property
    def gain(self) -> float:
        """The fraction of plain blending's residual that the vectors remove; negative if they add
        to it."""
        return 0.0 if self.still else 1 - self.vectors / self.blend


@dataclass(frozen=True, slots=True)
class ValidationReport:
    """How close motion vectors come to held-out frames, beside plain blending.

    Attributes:
        held_out: Number of frames that were held out.
        gain: See ``Residuals``, as ``still``.
        helps: Whether the gain is more than chance. If not, no vectors are written.
        method: Of optical flow, by which the vectors are made.
        residual: Of vectors by each method, and of plain blending (``blend``); see ``Residuals``.
        fewer: By how many times fewer frames are played, the residuals at those that are then not;
            without those that leave too few to play.
        still: Whether nothing moves.
    """

    held_out: int
    gain: float
    helps: bool
    method: Method
    residual: Mapping[str, float]
    fewer: Mapping[int, Residuals]
    still: bool = False


class TestedFrame(NamedTuple):
    """A held-out frame, and the reliability of vectors (h, w) that was measured without it."""

    frame: HeldOutFrame
    reliable: Plane


def two_fold(held_out: Sequence[HeldOutFrame]) -> list[TestedFrame]:
    """Test every other frame with the reliability measured on the frames between."""
    shape = held_out[0].actual.shape[:2]
    measured = [reliability(held_out[first::2], shape) for first in (1, 0)]
    return [TestedFrame(frame, measured[i % 2]) for i, frame in enumerate(held_out)]


def residuals(
    tested: Sequence[TestedFrame], encoding: MotionEncoding, *, steps_are_double: bool = False
) -> Residuals:
    """Predict held-out frames as the engine would blend them, and compare.

    ``steps_are_double`` says whether the steps over them are twice as long as those to be played,
    for which their reliability is then corrected.
    """
    blend = vectors = 0.0
    for frame, reliable in tested:
        blended = frame.blended(frame.before.astype(np.float32), frame.after.astype(np.float32))
        blend += _mean_squared_error(blended, frame.actual)
        weight = for_half_the_step(reliable) if steps_are_double else reliable
        vectors += _mean_squared_error(_seen(frame, weight, encoding), frame.actual)
    return Residuals(math.sqrt(blend / len(tested)), math.sqrt(vectors / len(tested)))


def helps(left: Residuals, *, steps_are_double: bool) -> bool:
    """Return whether vectors leave less than plain blending, by more than chance."""
    min_gain = 0.0 if steps_are_double else _MIN_GAIN
    return not left.still and left.gain > min_gain


def better_method(left: Mapping[Method, Residuals], *, steps_are_double: bool) -> Method:
    """Return the method that makes the better flipbook; in a tie it is DIS.

    Where the vectors of a method do not help, none are written, and frames are blended plainly.
    """
    shown = {
        method: each.vectors if helps(each, steps_are_double=steps_are_double) else each.blend
        for method, each in left.items()
    }
    return "farneback" if shown["farneback"] < (1 - _TIE) * shown["dis"] else "dis"


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
    """Return the manifest's statistics of an animation's vectors; gains to four digits, residuals
    to three decimals.

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
            "method": report.method,
            "residual": {name: round(value, 3) for name, value in report.residual.items()},
            "fewer_frames": {
                str(times): {"blend": round(left.blend, 3), "vectors": round(left.vectors, 3)}
                for times, left in report.fewer.items()
            },
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
        case {
            "held_out": int(held_out), "written": bool(helps), "gain": float(gain),
            "method": "dis" | "farneback" as method,
            "residual": {"blend": float(), "dis": float(), "farneback": float()} as residual,
            "fewer_frames": dict(fewer),
        }:  # fmt: skip
            left = {int(times): _residuals(each) for times, each in fewer.items()}
            still = figures.get("still") is True
            return ValidationReport(held_out, gain, helps, method, residual, left, still)
    raise ValueError(f"{figures!r} are no figures of motion vectors")


def _residuals(figures: Any) -> Residuals:
    match figures:
        case {"blend": float(blend), "vectors": float(vectors)}:
            return Residuals(blend, vectors)
    raise ValueError(f"{figures!r} are no figures of motion vectors")
