"""Cross-validate motion vectors on held-out frames, by the engine's formula from the bytes.

The manifest states the result; its figures are written and read here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.flow import Vectors
from fire_atlas.channels.held_out import HeldOutFrame, reliability, squared_error
from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.vision.warp import pixel_centres, sample_at

SIGNS = (1, 1), (1, -1), (-1, 1), (-1, -1)
"""Signs that an engine may give R and G by mistake; the first pair is right."""

_MIN_GAIN = 0.005
"""A smaller gain on frames of the source between those that are played may be chance, and nobody
sees it. Over steps that are twice as long any gain is evidence of a larger one."""


@dataclass(frozen=True, slots=True)
class ValidationReport:
    """How much closer motion vectors come to held-out frames than plain blending does.

    Attributes:
        held_out: How many frames were held out.
        gains: By how much of plain blending's error (root mean square) the vectors come closer,
            with each of ``SIGNS``. Below 0 they are further away.
        helps: Whether they come closer by more than chance. Where not, none are written.
    """

    held_out: int
    gains: tuple[float, ...]
    helps: bool

    @property
    def sign_right(self) -> bool:
        """Whether no other choice of signs comes closer."""
        return self.gains[0] >= max(self.gains[1:])


def cross_validate(
    held_out: Sequence[HeldOutFrame], encoding: MotionEncoding
) -> ValidationReport | None:
    """Blend held-out frames as the engine would, and compare; None where there are none.

    It is two-fold: every other frame is predicted with the reliability that was measured on the
    ones between them.
    """
    if not held_out:
        return None
    errors = np.zeros(1 + len(SIGNS), np.float64)
    for tested, others in ((held_out[::2], held_out[1::2]), (held_out[1::2], held_out[::2])):
        weight = reliability(others, held_out[0].actual.shape[:2])
        for frame in tested:
            errors += _errors(frame, weight, encoding)
    plain = max(errors[0], 1e-12)
    gains = tuple(float(1 - np.sqrt(each / plain)) for each in errors[1:])
    least = _MIN_GAIN if held_out[0].span == 1 else 0.0
    return ValidationReport(len(held_out), gains, gains[0] > least)


def _errors(frame: HeldOutFrame, weight: Plane, encoding: MotionEncoding) -> NDArray[np.float64]:
    """Return the mean squared errors of plain blending and with each choice of signs."""
    height, width = weight.shape
    unit = np.array(encoding.unit_pixels((width, height)), np.float32)
    share = [as_plane(each * weight[..., None] / unit) for each in frame.vectors]
    scale = max(float(max(np.abs(each).max() for each in share)), 1e-6)
    maps = [encoding.encode(as_plane(each / np.float32(scale))) for each in share]
    plain = frame.blended(frame.before.astype(np.float32), frame.after.astype(np.float32))
    errors = [squared_error(plain, frame.actual)]
    for signs in SIGNS:
        seen = _blended(frame, (maps[0], maps[1]), encoding, unit * scale, signs)
        errors.append(squared_error(seen, frame.actual))
    return np.array([np.mean(each, dtype=np.float64) for each in errors])


def _blended(
    frame: HeldOutFrame,
    maps: tuple[Bytes, Bytes],
    encoding: MotionEncoding,
    scale: NDArray[np.float32],
    signs: tuple[int, int],
) -> NDArray[np.float32]:
    """Return what the engine shows there: coordinates in its own axes, scale in px of a cell."""
    height, width = frame.before.shape[:2]
    columns, rows = pixel_centres(width, height)
    upwards = encoding.green == "up"
    place = np.stack([columns, height - 1 - rows if upwards else rows], axis=2)
    seen = []
    ways = -frame.blend, 1 - frame.blend
    for image, data, way in zip((frame.before, frame.after), maps, ways, strict=True):
        motion: Vectors = encoding.decoded(data) * np.array(signs, np.float32)
        at = as_plane(place + motion * scale * np.float32(way))
        y = height - 1 - at[..., 1] if upwards else at[..., 1]
        seen.append(sample_at(image.astype(np.float32), at[..., 0], y))
    return frame.blended(seen[0], seen[1])


def motion_statistics(report: ValidationReport | None) -> dict[str, Any]:
    """Return what the manifest states of an animation's vectors; gains to four digits.

    ``report`` is None where the animation was too short to hold out a frame.
    """
    if report is None:
        return {"motion": None}
    gain, *others = (round(gain, 4) for gain in report.gains)
    return {
        "motion": {
            "held_out": report.held_out,
            "written": report.helps,
            "gain": gain,
            "other_signs": others,
            "sign_right": report.sign_right,
        }
    }


def read_reports(statistics: dict[str, Any]) -> dict[str, ValidationReport | None]:
    """Return the report of each animation with vectors, by its name, from a manifest's statistics.

    They may be those of one animation, whose name then is empty, of several, or of members.

    Raises:
        ValueError: Figures are not as ``motion_statistics`` writes them.
    """
    return dict(_reports("", statistics))


def _reports(name: str, statistics: Any) -> Iterator[tuple[str, ValidationReport | None]]:
    if not isinstance(statistics, dict):
        raise ValueError(f"{statistics!r} are no statistics")
    if "motion" in statistics:
        yield name, _report(statistics["motion"])
    for several in ("animations", "members", "motions"):
        inner = statistics.get(several)
        if isinstance(inner, dict):
            for key, figures in inner.items():
                yield from _reports(f"{name}/{key}" if name else key, figures)


def _report(figures: Any) -> ValidationReport | None:
    match figures:
        case None:
            return None
        case {
            "held_out": int(held_out),
            "written": bool(helps),
            "gain": float(gain),
            "other_signs": [float(x), float(y), float(both)],
        }:
            return ValidationReport(held_out, (gain, x, y, both), helps)
    raise ValueError(f"{figures!r} are no figures of motion vectors")
