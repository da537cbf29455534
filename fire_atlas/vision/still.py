"""Find what stands still in a clip and is no light: it has an outline, where a glow fades."""

from functools import reduce

import cv2
import numpy as np

from fire_atlas.core.pixels import Plane, as_plane, magnitude

_LEVELS = 8.0, 12.0, 18.0, 28.0, 48.0
"""Brightnesses, 0..255, above one of which a thing stands apart from the glow around it."""

_DARK = 12.0
"""Brightness that is added where changes are compared with it: in the dark they are noise."""

_MOVING = 0.05
"""Activity from which a place moves."""

_REACH = 0.02
"""Distance over which brightness changes at an outline, heights."""

_SHARP = 0.5
"""Change of brightness over that distance, relative to the brightness, from which it is sharp."""

_OUTLINED = 0.45
"""Part of the outline of a thing that is sharp; a glow may have less."""

_SMALLEST = 0.002
"""Part of the frame that a thing has at least: smaller spots are of a flame that rests there."""


def still_things(planes: list[Plane], activity: Plane) -> Plane:
    """Return how far each pixel of a clip shows a thing that stands still, (H, W) in 0..1.

    Args:
        planes: Brightness of a few frames, 0..255.
        activity: How much each pixel moves, as from ``activity``.
    """
    steady: Plane = reduce(np.minimum, planes)
    height = len(steady)
    side = 2 * max(1, round(_REACH * height / 4)) + 1
    smooth = as_plane(cv2.GaussianBlur(steady, (side, side), 0))
    across, down = (as_plane(cv2.Sobel(smooth, -1, x, 1 - x, scale=1 / 8)) for x in (1, 0))
    change = magnitude(across, down) * np.float32(_REACH * height)
    is_sharp = cv2.dilate((change > _SHARP * (smooth + _DARK)).view(np.uint8), np.ones((3, 3)))
    rests = (activity < _MOVING).view(np.uint8)
    seen = cv2.erode(rests, np.ones((5, 5)))  # an outline beside what moves is that of the motion
    things = np.zeros(steady.shape, np.bool_)
    for level in _LEVELS:
        bright = rests & (steady > level)
        inside = cv2.erode(bright, np.ones((3, 3)))
        outline = (bright > inside) & (seen > 0)
        _, parts = cv2.connectedComponents(bright)
        length = np.bincount(parts.ravel(), outline.ravel())
        sharp = np.bincount(parts.ravel(), (outline & (is_sharp > 0)).ravel())
        is_large = np.bincount(parts.ravel()) >= _SMALLEST * parts.size
        is_thing = is_large & (sharp > _OUTLINED * np.maximum(length, 1))
        things |= is_thing[parts] & (bright > 0)
    return as_plane(cv2.blur(things.astype(np.float32), (3, 3)))
