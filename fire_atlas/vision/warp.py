"""Warp pictures along optical flow, and estimate the flow between two frames in both directions."""

from typing import Any, NamedTuple, TypeVar, cast

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness
from fire_atlas.vision.flow import optical_flow, resized

_Image = TypeVar("_Image", bound=NDArray[Any])

_CONSISTENCY = 0.01
"""Tolerated mismatch of forward and backward flow, as a fraction of the frame."""

_COVERAGE_WEIGHT = 0.25
"""Weight of coverage, against brightness, in the picture flow is estimated on; it shows smoke."""


_AROUND = 2
"""Width, px, that a bicubic filter reaches beyond a picture."""


class FlowField(NamedTuple):
    """Displacement of each pixel, two (h, w) planes, as fractions of the frame's width and height.

    So a field estimated on small pictures can be applied to large ones.
    """

    x: Plane
    y: Plane

    def scaled(self, factor: "float | Plane") -> "FlowField":
        """Return the field times ``factor``."""
        return FlowField(as_plane(self.x * factor), as_plane(self.y * factor))

    def plus(self, other: "FlowField") -> "FlowField":
        """Return the sum of two fields."""
        return FlowField(as_plane(self.x + other.x), as_plane(self.y + other.y))

    def resized(self, size: tuple[int, int]) -> "FlowField":
        """Return the field resized to ``size`` (width, height)."""
        return FlowField(*(resized(plane, size) for plane in self))


class BidirectionalFlow(NamedTuple):
    """Flow from a frame to another one, and back."""

    forward: FlowField
    backward: FlowField


def sample_at(
    image: NDArray[np.float32],
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    interpolation: int = cv2.INTER_LINEAR,
    border: int = cv2.BORDER_REPLICATE,
    *,
    tiles: bool = False,
) -> NDArray[np.float32]:
    """Sample ``image``, (h, w) or (h, w, channels), at the points (``x``, ``y``), (rows, columns).

    Points are px, with (0, 0) the centre of the top-left pixel. By default the sampling is bilinear
    and the outermost pixels are repeated beyond the border. Beyond the sides of an image that
    ``tiles``, it begins again.
    """
    if tiles:
        x = np.mod(x, image.shape[1]) + _AROUND
        image = between_copies(image, _AROUND)
    return as_plane(cv2.remap(image, as_plane(x), as_plane(y), interpolation, borderMode=border))


def between_copies(image: _Image, margin: int) -> _Image:
    """Return ``image``, (h, w) or (h, w, channels), with ``margin`` px at both sides of copies that
    are laid beside it."""
    return cast(_Image, cv2.copyMakeBorder(image, 0, 0, margin, margin, cv2.BORDER_WRAP))


def warp_by_pixels(
    image: NDArray[np.float32],
    flow: NDArray[np.float32],
    share: float = 1.0,
    interpolation: int = cv2.INTER_LINEAR,
    border: int = cv2.BORDER_REPLICATE,
) -> NDArray[np.float32]:
    """Return the picture that shows at p what ``image`` (h, w, ...) shows at p + share · flow(p).

    ``flow`` is (h, w, 2), px. The other arguments are those of ``sample_at``.
    """
    height, width = flow.shape[:2]
    x, y = pixel_centres(width, height)
    part = np.float32(share)
    return sample_at(image, x + flow[..., 0] * part, y + flow[..., 1] * part, interpolation, border)


def pixel_centres(width: int, height: int) -> tuple[Plane, Plane]:
    """Return the column and the row of every pixel of a picture, (height, width) each."""
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return as_plane(x), as_plane(y)


def flow_input(pixels: Pixels, blend_space: str) -> Bytes:
    """Return the (h, w) uint8 picture of a frame on which flow is estimated.

    It is a weighted sum of brightness and coverage.
    """
    bright, coverage = brightness(pixels, blend_space), cv2.extractChannel(pixels, 3)
    mixed = cv2.addWeighted(bright, 1 - _COVERAGE_WEIGHT, coverage, 255 * _COVERAGE_WEIGHT, 0.0)
    return np.clip(np.rint(mixed), 0, 255).astype(np.uint8)


def bidirectional_flow(one: Bytes, other: Bytes, smoothing: float) -> BidirectionalFlow:
    """Estimate the flow between two pictures in both directions.

    Where the two directions disagree (occlusion), the flow of the surroundings is taken, or 0 if
    these disagree too.

    Args:
        one, other: (h, w) uint8.
        smoothing: Standard deviation of the Gaussian that smooths the fields, in heights.
    """
    height, width = one.shape
    forward, backward = (
        FlowField(as_plane(flow[..., 0] / width), as_plane(flow[..., 1] / height))
        for flow in (optical_flow(one, other, True), optical_flow(other, one, True))
    )
    sigma = smoothing * height
    return BidirectionalFlow(
        _smoothed(forward, _consistency(forward, backward), sigma),
        _smoothed(backward, _consistency(backward, forward), sigma),
    )


def warp(pixels: Pixels, flow: FlowField) -> Pixels:
    """Return the frame that shows at each p what ``pixels`` shows at p + flow(p)."""
    height, width = pixels.shape[:2]
    return sample_at(pixels, *_destinations(flow.resized((width, height)), (width, height)))


def intermediate_flows(flow: BidirectionalFlow, time: float) -> tuple[FlowField, FlowField]:
    """Return the flow from an in-between frame at ``time``, 0..1, to the first and to the second.

    The in-between frame is not known, so its flow is approximated by a combination of the flows
    between the two frames (Jiang et al., "Super SloMo", CVPR 2018, eq. 4).
    """
    forward, backward = flow
    to_first = forward.scaled(-(1 - time) * time).plus(backward.scaled(time * time))
    to_second = forward.scaled((1 - time) ** 2).plus(backward.scaled(-time * (1 - time)))
    return to_first, to_second


def over_channels(pixels: MatLike) -> Plane:
    """Return the sum of the four channels, (h, w)."""
    return as_plane(cv2.transform(pixels, np.ones((1, 4), np.float32)))


def blurred(plane: Plane, sigma: float) -> Plane:
    """Return a plane blurred by a Gaussian of ``sigma`` px."""
    return as_plane(cv2.GaussianBlur(plane, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE))


def _consistency(forward: FlowField, backward: FlowField) -> Plane:
    """Return how well following both flows leads each pixel back to itself, (h, w) in 0..1."""
    height, width = forward.x.shape
    x, y = _destinations(forward, (width, height))
    returned = [sample_at(plane, x, y) for plane in backward]
    mismatch = sum((a + b) ** 2 for a, b in zip(forward, returned, strict=True))
    length = sum(a**2 + b**2 for a, b in zip(forward, returned, strict=True))
    return as_plane(np.exp(-mismatch / (0.1 * length + np.float32(_CONSISTENCY**2))))


def _smoothed(field: FlowField, weight: Plane, sigma: float) -> FlowField:
    """Return the field blurred with weights; 0 where all weights nearby are small."""
    total = blurred(weight, sigma)
    scale = np.minimum(1.5 * total, 1.0) / (total + np.float32(1e-3))
    return FlowField(
        *(as_plane(blurred(as_plane(plane * weight), sigma) * scale) for plane in field)
    )


def _destinations(flow: FlowField, size: tuple[int, int]) -> tuple[Plane, Plane]:
    """Return the point, px, to which ``flow`` leads each pixel of a frame of ``size`` (w, h)."""
    x, y = pixel_centres(*size)
    return as_plane(x + flow.x * size[0]), as_plane(y + flow.y * size[1])
