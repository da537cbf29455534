"""Where a camera stands, and what it sees of a fire."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.effect.field.wind import peak_level
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.profile.blaze import Blaze
from fire_atlas.generators.profile.force import PER_LEVEL
from fire_atlas.generators.profile.pose import along
from fire_atlas.generators.profile.territory import Territory
from fire_atlas.generators.profile.view import Stance, View

_STEEPEST = 80.0
"""Degrees."""

_MARGIN = 2
"""Empty px left around all that ever burns."""


def camera_for(blaze: Blaze, height: int | None, elevation: float) -> Camera:
    """Return a camera in front that sees all of the fire, wherever it stands and however the wind
    blows; its unit of length is the height of the flame.

    Args:
        blaze: The fire.
        height: Of the frame, px; None keeps the scale of the clip.
        elevation: Degrees.
    """
    grid, profile = blaze.profile.grid, blaze.profile
    # From steeper than this nothing of a flame is left but its foot.
    tilt = math.radians(min(max(elevation, -_STEEPEST), _STEEPEST))
    half = max(side.face.half for side in profile.sides)
    sway = max(float(np.abs(side.face.pose.offset).max()) for side in profile.sides)
    sway *= max(blaze.gain, 1.0)
    broad = max(float(side.face.pose.ratio.max()) for side in profile.sides)
    lean = math.radians(PER_LEVEL * peak_level(blaze.asked.wind) + abs(blaze.bias))
    up = grid.up / grid.per_height
    side = grid.side / grid.per_half * half * broad + sway + math.sin(lean) * bend(np.array(up))
    depth = half * abs(math.sin(tilt))
    above, below = up * math.cos(tilt) + depth, grid.down / grid.per_height + depth
    if height is None:
        flame = profile.front.statistics.height.median
    else:
        flame = max(height - 2 * _MARGIN - 1, 1) / (above + below)
    # Whole px below the base, as in most sprites: their pixels then stay what they are.
    ground = math.ceil(below * flame) + _MARGIN
    rows = height or math.ceil(above * flame) + _MARGIN + ground
    columns = 2 * (math.ceil(float(side) * flame) + _MARGIN)
    return Camera(0.0, tilt, columns, rows, (columns / 2, float(rows - ground)), flame)


def pictured(view: View, camera: Camera, territories: list[Territory], stance: Stance) -> Pixels:
    """Return what the camera sees of a fire that stands so, each splice in its territory."""
    picture = view.picture(territories)
    grid = view.blaze.profile.grid
    # A fire that is shown smaller than it was filmed is drawn larger first. The grid of a small
    # sprite is finer than what it holds.
    filmed = min(grid.per_height, view.blaze.profile.front.statistics.height.median)
    finer = max(1, math.ceil(0.8 * filmed / camera.scale))
    columns, rows = places(view, camera, stance, finer)
    seen = cv2.remap(
        picture, columns, rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0, 0, 0, 0),
    )  # fmt: skip
    if finer > 1:
        seen = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    # Cubics swing over at edges.
    np.clip(seen, 0, 1, out=seen)
    np.minimum(seen[..., :3], seen[..., 3:], out=seen[..., :3])
    return as_plane(seen)


def places(
    view: View, camera: Camera, stance: Stance, finer: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return which column and row of the grid each pixel sees, each (height, width) · ``finer``."""
    grid = view.blaze.profile.grid
    (x, y), flame = camera.origin, camera.scale
    px = (np.arange(camera.width * finer) + 0.5) / finer - x
    py = y - (np.arange(camera.height * finer) + 0.5) / finer
    lean = math.radians(stance.lean)
    heights = py / (flame * math.cos(lean) * math.cos(camera.elevation))
    middle = along(stance.offset, heights) + math.sin(lean) * bend(heights)
    reach = along(stance.ratio, heights) * view.half
    across = (px / flame - middle[:, None]) / reach[:, None]
    tall = np.broadcast_to(heights[:, None], across.shape)
    if camera.elevation:
        # Of a round foot one sees the near side, lower in the frame than the axis.
        round_ = np.sqrt(np.clip(1 - across * across, 0, 1)) * np.clip(1 - tall, 0, 1)
        tall = tall + round_ * view.half * math.tan(camera.elevation)
    columns = grid.side + across * grid.per_half - 0.5
    rows = grid.up - tall * grid.per_height - 0.5
    return columns.astype(np.float32), rows.astype(np.float32)


def middle(stance: Stance, camera: Camera) -> NDArray[np.float64]:
    """(height,) x of the fire's middle from its axis, px, in each row of the frame."""
    lean = math.radians(stance.lean)
    above = camera.origin[1] - (np.arange(camera.height) + 0.5)
    heights = above / (camera.scale * math.cos(lean) * math.cos(camera.elevation))
    bent = along(stance.offset, heights) + math.sin(lean) * bend(heights)
    return np.asarray(bent * camera.scale)


def bend(heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """How far a fire that leans is to the side at a height: a cubic that leaves the base upright,
    is 1 at the top, and goes on straight above it."""
    h = np.maximum(heights, 0.0)
    return np.asarray(np.where(h < 1, h * h * (3 - h) / 2, 1 + 1.5 * (h - 1)), np.float64)
