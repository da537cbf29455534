"""The build's own test of what it is about to write, by the engine's formula from the bytes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.evidence import HeldOut, square_error, trust
from fire_atlas.channels.flow import Vectors
from fire_atlas.core.pixels import Bytes, Plane, as_plane

SIGNS = (1, 1), (1, -1), (-1, 1), (-1, -1)
"""What a client may get wrong, of R and of G; the first is right."""

_CHANCE = 0.005
"""A smaller gain on frames of the source between those that are played may be chance, and nobody
sees it. Over steps that are twice as long any gain tells of more."""


@dataclass(frozen=True, slots=True)
class Proof:
    """How near frames that were held out are met.

    Attributes:
        held_out: How many frames were.
        gains: By how much of plain blending's error (root mean square) the vectors come closer,
            with each of ``SIGNS``. Below 0 they are further away.
        least: The gain above which vectors are written.
    """

    held_out: int
    gains: tuple[float, ...]
    least: float

    @property
    def helps(self) -> bool:
        """Whether vectors come closer than plain blending. Where not, none are written."""
        return self.gains[0] > self.least

    @property
    def sign_right(self) -> bool:
        """Whether no other choice of signs comes closer."""
        return self.gains[0] >= max(self.gains[1:])

    def figures(self) -> dict[str, Any]:
        """Return what goes into the manifest."""
        return {
            "held_out": self.held_out,
            "written": self.helps,
            "gain": round(self.gains[0], 4),
            "other_signs": [round(gain, 4) for gain in self.gains[1:]],
            "sign_right": self.sign_right,
        }


def prove(held: Sequence[HeldOut], encoding: MotionEncoding) -> Proof | None:
    """Blend held out frames as the engine would; None where there are none.

    Every other frame is met with the trust that the ones between them earned.
    """
    if not held:
        return None
    errors = np.zeros(1 + len(SIGNS), np.float64)
    for tested, learned in ((held[::2], held[1::2]), (held[1::2], held[::2])):
        earned = trust(learned, held[0].held.shape[:2])
        for one in tested:
            errors += _errors(one, earned, encoding)
    plain = max(errors[0], 1e-12)
    gains = tuple(float(1 - np.sqrt(each / plain)) for each in errors[1:])
    return Proof(len(held), gains, _CHANCE if held[0].frames == 1 else 0.0)


def _errors(one: HeldOut, earned: Plane, encoding: MotionEncoding) -> NDArray[np.float64]:
    """Return the mean square errors of plain blending and with each choice of signs."""
    height, width = earned.shape
    unit = np.array(encoding.unit_pixels((width, height)), np.float32)
    share = [as_plane(each * earned[..., None] / unit) for each in one.vectors]
    scale = max(float(max(np.abs(each).max() for each in share)), 1e-6)
    maps = [encoding.encode(as_plane(each / np.float32(scale))) for each in share]
    plain = one.blended(one.before.astype(np.float32), one.after.astype(np.float32))
    errors = [square_error(plain, one.held)]
    for signs in SIGNS:
        seen = _blended(one, (maps[0], maps[1]), encoding, unit * scale, signs)
        errors.append(square_error(seen, one.held))
    return np.array([np.mean(each, dtype=np.float64) for each in errors])


def _blended(
    one: HeldOut,
    maps: tuple[Bytes, Bytes],
    encoding: MotionEncoding,
    scale: NDArray[np.float32],
    signs: tuple[int, int],
) -> NDArray[np.float32]:
    """Return what the engine shows there: coordinates in its own axes, scale in px of a cell."""
    height, width = one.before.shape[:2]
    columns, rows = np.meshgrid(
        np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
    )
    upwards = encoding.green == "up"
    place = np.stack([columns, height - 1 - rows if upwards else rows], axis=2)
    seen = []
    ways = -one.part, 1 - one.part
    for image, data, way in zip((one.before, one.after), maps, ways, strict=True):
        motion: Vectors = encoding.decoded(data) * np.array(signs, np.float32)
        at = as_plane(place + motion * scale * np.float32(way))
        y = height - 1 - at[..., 1] if upwards else at[..., 1]
        seen.append(as_plane(cv2.remap(
            image.astype(np.float32), as_plane(at[..., 0]), as_plane(y), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )))  # fmt: skip
    return one.blended(seen[0], seen[1])
