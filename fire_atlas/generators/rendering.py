"""The contract of generators: a fire seen by one camera, as frames and their motion."""

from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.settings import GenerationSettings


class Rendering(Protocol):
    """A generated fire seen by one camera; safe to use from several threads.

    Attributes:
        matte: ``alpha`` or ``luminance``: where the coverage of its frames comes from.
        matte_reason: Why, as a sentence for people.
    """

    matte: ClassVar[str]
    matte_reason: ClassVar[str]

    @property
    def camera(self) -> Camera:
        """The camera, which also sets the size of a frame."""

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4), a fresh array."""

    def motion(self, index: int) -> NDArray[np.float32]:
        """Velocity (height, width, 2) of what frame ``index`` shows, px/s, x right, y down."""


def rendered_clip(
    rendering: Rendering,
    settings: GenerationSettings,
    blend_space: str,
    inputs: tuple[Path, ...],
) -> Clip:
    """Make a clip of a rendering: its frames are drawn when they are read.

    Args:
        rendering: The fire, seen by a camera.
        settings: Number of frames, frame rate, and whether they loop.
        blend_space: ``srgb`` or ``linear``: where the client blends.
        inputs: The files the fire was made from.
    """
    return Clip(
        width=rendering.camera.width,
        height=rendering.camera.height,
        fps=settings.fps,
        count=settings.frames,
        picture=rendering.frame,
        inputs=inputs,
        blend_space=blend_space,
        matte=rendering.matte,
        matte_reason=rendering.matte_reason,
        loop=settings.loop,
        flow=rendering.motion,
    )
