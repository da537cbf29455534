"""Fire profile → clips: new fire, of any length, seen from anywhere."""

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.profile.balance import balanced
from fire_atlas.generators.profile.blaze import Burning
from fire_atlas.generators.profile.camera import camera_for, middle, pictured, places
from fire_atlas.generators.profile.face import DRIFT_CELL
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.profile.view import View


def burn(
    profile: Profile,
    asked: Burning,
    azimuths: list[float],
    height: int | None,
    elevation: float,
    blend_space: str,
    inputs: tuple[Path, ...],
    workers: Workers,
) -> list[Clip]:
    """Return a clip of the same fire from each azimuth, degrees.

    Args:
        profile: What was learnt.
        asked: Length, speed, wind and grain of the fire.
        azimuths: Where the camera stands, counter-clockwise seen from above.
        height, elevation: As of ``camera_for``.
        blend_space: Where the coverage is meant to be blended.
        inputs: The files the profile comes from.
        workers: Who tries it out.
    """
    blaze = balanced(profile, asked, workers)
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
        picture=lambda i: frame_of(view, camera, i),
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
    return pictured(view, camera, territories, view.stance(frame))


def flow_of(view: View, camera: Camera, frame: int) -> NDArray[np.float32]:
    """(height, width, 2) velocity of what a frame shows, px/s: the particles', as they carry the
    clip's own motion, and the sway of the whole."""
    territories = view.territories(frame)
    stance = view.stance(frame)
    grid, asked = view.blaze.profile.grid, view.blaze.asked
    drift = view.drift(territories) * np.float32(view.blaze.haste(frame))
    columns, rows = places(view, camera, stance, 1)
    moves = cv2.remap(
        drift, (columns + 0.5) / DRIFT_CELL - 0.5, (rows + 0.5) / DRIFT_CELL - 0.5,
        cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    per_cell = camera.scale * np.array([view.half / grid.per_half, 1 / grid.per_height])
    flow = moves * per_cell.astype(np.float32)
    # What rises along a bent middle goes to the side with it.
    slant = np.gradient(middle(stance, camera)).astype(np.float32)
    flow[..., 0] += flow[..., 1] * slant[:, None]
    following = frame + 1 if asked.loop or frame + 1 < asked.frames else frame - 1
    if asked.frames > 1:
        later = view.stance(following % asked.frames)
        sways = (middle(later, camera) - middle(stance, camera)) * asked.fps
        flow[..., 0] += (sways if following > frame else -sways)[:, None].astype(np.float32)
    return as_plane(flow)
