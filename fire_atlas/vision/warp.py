"""What two frames have in common: where the shapes of one lie in the other, and warping by that.

Displacements are parts of the frame (1 = its whole width, or height), so that fields found on small
pictures hold for large ones.
"""

from typing import NamedTuple

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness
from fire_atlas.vision.flow import optical_flow

_AGREEMENT = 0.01
"""There and back again, a displacement may miss by this part of the frame."""

_COVERAGE = 0.25
"""How much coverage counts, against brightness: dark smoke has shapes too."""


class Field(NamedTuple):
    """Displacement of every place, two (h, w) planes, in parts of the frame's width and height."""

    x: Plane
    y: Plane

    def scaled(self, factor: "float | Plane") -> "Field":
        """Return the field times ``factor``."""
        return Field(as_plane(self.x * factor), as_plane(self.y * factor))

    def plus(self, other: "Field") -> "Field":
        """Return the sum of two fields."""
        return Field(as_plane(self.x + other.x), as_plane(self.y + other.y))

    def of_size(self, size: tuple[int, int]) -> "Field":
        """Return the field at another (width, height)."""
        return Field(*(resized(plane, size) for plane in self))


class Motion(NamedTuple):
    """Where the shapes of a frame lie in another one, and those of the other in the first."""

    there: Field
    back: Field


def resized(picture: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a picture or plane at another (width, height)."""
    height, width = picture.shape[:2]
    if (width, height) == size:
        return picture
    method = cv2.INTER_AREA if size[0] <= width else cv2.INTER_LINEAR
    return as_plane(cv2.resize(picture, size, interpolation=method))


def shapes(pixels: Pixels, blend_space: str) -> Bytes:
    """Return the (h, w) uint8 picture in which the shapes of a frame are looked for."""
    bright, cover = brightness(pixels, blend_space), cv2.extractChannel(pixels, 3)
    seen = cv2.addWeighted(bright, 1 - _COVERAGE, cover, 255 * _COVERAGE, 0.0)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def motion_between(one: Bytes, other: Bytes, softness: float) -> Motion:
    """Return where the shapes of two pictures lie in each other.

    Dense inverse search both ways; where the two ways disagree there is no common shape, and the
    field is that of the surroundings, or nothing.

    Args:
        one: (h, w) uint8.
        other: The same.
        softness: Over how much of the height neighbouring places move alike.
    """
    height, width = one.shape
    fields = [
        Field(as_plane(flow[..., 0] / width), as_plane(flow[..., 1] / height))
        for flow in (optical_flow(one, other, True), optical_flow(other, one, True))
    ]
    there, back = fields
    reach = softness * height
    return Motion(
        _softened(there, _agreement(there, back), reach),
        _softened(back, _agreement(back, there), reach),
    )


def warped(pixels: Pixels, field: Field) -> Pixels:
    """Return the frame whose every place shows what ``pixels`` has at that place plus ``field``."""
    height, width = pixels.shape[:2]
    x, y = _places(width, height)
    across, down = field.of_size((width, height))
    at_x, at_y = as_plane(x + across * width), as_plane(y + down * height)
    return as_plane(
        cv2.remap(pixels, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    )


def both_warped(sides: tuple[Pixels, Pixels], warps: tuple[Field, Field]) -> tuple[Pixels, Pixels]:
    """Warp two frames, each by its own field."""
    return warped(sides[0], warps[0]), warped(sides[1], warps[1])


def met(motion: Motion, part: float) -> tuple[Field, Field]:
    """Fields that warp two frames to where their shapes meet, ``part`` of the way to the second.

    The frame in between is not known, so its displacements are made of those of both ends (Jiang et
    al., "Super SloMo", CVPR 2018, eq. 4).
    """
    there, back = motion
    to_one = there.scaled(-(1 - part) * part).plus(back.scaled(part * part))
    to_other = there.scaled((1 - part) ** 2).plus(back.scaled(-part * (1 - part)))
    return to_one, to_other


def over_channels(pixels: MatLike) -> Plane:
    """Return the sum of all channels, (h, w)."""
    return as_plane(cv2.transform(pixels, np.ones((1, 4), np.float32)))


def blurred(plane: Plane, sigma: float) -> Plane:
    """Return a plane softened by a Gaussian of ``sigma`` px."""
    return as_plane(cv2.GaussianBlur(plane, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE))


def _agreement(there: Field, back: Field) -> Plane:
    """How well each place comes back to itself, (h, w) in 0..1."""
    height, width = there.x.shape
    x, y = _places(width, height)
    at = as_plane(x + there.x * width), as_plane(y + there.y * height)
    returned = [
        as_plane(cv2.remap(plane, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
        for plane in back
    ]
    miss = sum((a + b) ** 2 for a, b in zip(there, returned, strict=True))
    length = sum(a**2 + b**2 for a, b in zip(there, returned, strict=True))
    return as_plane(np.exp(-miss / (0.1 * length + np.float32(_AGREEMENT**2))))


def _softened(field: Field, weight: Plane, reach: float) -> Field:
    """Mean of the field around each place by ``weight``; nothing where all weights are small."""
    total = blurred(weight, reach)
    trust = np.minimum(1.5 * total, 1.0) / (total + np.float32(1e-3))
    return Field(*(as_plane(blurred(as_plane(plane * weight), reach) * trust) for plane in field))


def _places(width: int, height: int) -> tuple[Plane, Plane]:
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return as_plane(x), as_plane(y)
