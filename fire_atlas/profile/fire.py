"""Fire profile → clips: new fire, of any length, seen from anywhere."""

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.profile.blaze import Blaze, Burning
from fire_atlas.profile.face import DRIFT_CELL
from fire_atlas.profile.force import PER_LEVEL
from fire_atlas.profile.model import Profile
from fire_atlas.profile.pose import along
from fire_atlas.profile.territory import Territory
from fire_atlas.profile.view import Stance, View

_STEEPEST = 80.0
"""Degrees."""

_MARGIN = 2
"""Empty px left around all that ever burns."""


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the fire stands in the frame, the same from all directions.

    Attributes:
        width, height: Of the frame, px.
        base: (x, y) of the fire's axis on the ground, px.
        flame: Height of the flame, px.
        elevation: Radians the camera looks down.
    """

    width: int
    height: int
    base: tuple[float, float]
    flame: float
    elevation: float


def camera_for(blaze: Blaze, height: int | None, elevation: float) -> Camera:
    """Return a camera that sees all of the fire, wherever it stands and however the wind blows.

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
    broad = max(float(side.face.pose.ratio.max()) for side in profile.sides)
    lean = math.radians(PER_LEVEL * blaze.asked.wind.strongest())
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
    return Camera(columns, rows, (columns / 2, float(rows - ground)), flame, tilt)


def burn(
    profile: Profile,
    asked: Burning,
    azimuths: list[float],
    height: int | None,
    elevation: float,
    blend_space: str,
    inputs: tuple[Path, ...],
) -> list[Clip]:
    """Return a clip of the same fire from each azimuth, degrees.

    Args:
        profile: What was learnt.
        asked: Length, speed, wind and grain of the fire.
        azimuths: Where the camera stands, counter-clockwise seen from above.
        height, elevation: As of ``camera_for``.
        blend_space: Where the coverage is meant to be blended.
        inputs: The files the profile comes from.
    """
    blaze = Blaze.of(profile, asked)
    camera = camera_for(blaze, height, elevation)
    return [
        _clip(View.of(blaze, math.radians(azimuth)), camera, blend_space, inputs)
        for azimuth in azimuths
    ]


def _clip(view: View, camera: Camera, blend_space: str, inputs: tuple[Path, ...]) -> Clip:
    asked = view.blaze.asked
    return Clip(
        width=camera.width,
        height=camera.height,
        fps=asked.fps,
        count=asked.frames,
        read=lambda i: frame_of(view, camera, i),
        inputs=inputs,
        blend_space=blend_space,
        matte="alpha",
        matte_reason="generated fire knows its own coverage",
        loop=asked.loop,
        flow=lambda i: flow_of(view, camera, i),
    )


def frame_of(view: View, camera: Camera, frame: int) -> Pixels:
    """Return a frame as the camera sees it."""
    territories = view.territories(frame)
    return pictured(view, camera, territories, view.stance(frame, territories))


def pictured(view: View, camera: Camera, territories: list[Territory], stance: Stance) -> Pixels:
    """Return what the camera sees of a fire that stands so, each splice in its territory."""
    picture = view.picture(territories)
    grid = view.blaze.profile.grid
    # A fire that is shown smaller than it was learnt is drawn larger first.
    finer = max(1, math.ceil(0.8 * grid.per_height / camera.flame))
    columns, rows = places(view, camera, stance, finer)
    seen = cv2.remap(
        picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0, 0, 0, 0),
    )  # fmt: skip
    if finer > 1:
        seen = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return as_plane(seen)


def places(
    view: View, camera: Camera, stance: Stance, finer: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return which column and row of the grid each pixel sees, each (height, width) · ``finer``."""
    grid = view.blaze.profile.grid
    (x, y), flame = camera.base, camera.flame
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


def flow_of(view: View, camera: Camera, frame: int) -> NDArray[np.float32]:
    """(height, width, 2) velocity of what a frame shows, px/s: the particles', as they carry the
    clip's own motion, and the sway of the whole."""
    territories = view.territories(frame)
    stance = view.stance(frame, territories)
    grid, asked = view.blaze.profile.grid, view.blaze.asked
    drift = view.drift(territories)
    columns, rows = places(view, camera, stance, 1)
    moves = cv2.remap(
        drift, (columns + 0.5) / DRIFT_CELL - 0.5, (rows + 0.5) / DRIFT_CELL - 0.5,
        cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    per_cell = camera.flame * np.array([view.half / grid.per_half, 1 / grid.per_height])
    flow = moves * per_cell.astype(np.float32)
    # What rises along a bent middle goes to the side with it.
    slant = np.gradient(_middle(stance, camera)).astype(np.float32)
    flow[..., 0] += flow[..., 1] * slant[:, None]
    following = frame + 1 if asked.loop or frame + 1 < asked.frames else frame - 1
    if asked.frames > 1:
        later = view.stance(following % asked.frames, view.territories(following % asked.frames))
        sways = (_middle(later, camera) - _middle(stance, camera)) * asked.fps
        flow[..., 0] += (sways if following > frame else -sways)[:, None].astype(np.float32)
    return as_plane(flow)


def _middle(stance: Stance, camera: Camera) -> NDArray[np.float64]:
    """(height,) x of the fire's middle from its axis, px, in each row of the frame."""
    lean = math.radians(stance.lean)
    above = camera.base[1] - (np.arange(camera.height) + 0.5)
    heights = above / (camera.flame * math.cos(lean) * math.cos(camera.elevation))
    bent = along(stance.offset, heights) + math.sin(lean) * bend(heights)
    return np.asarray(bent * camera.flame)


def bend(heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """How far a fire that leans is to the side at a height: a cubic that leaves the base upright,
    is 1 at the top, and goes on straight above it."""
    h = np.maximum(heights, 0.0)
    return np.asarray(np.where(h < 1, h * h * (3 - h) / 2, 1 + 1.5 * (h - 1)), np.float64)
