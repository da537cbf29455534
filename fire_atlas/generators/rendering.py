"""Interface of all fire generators: a fire seen by one camera, as frames and their motion."""

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Clip, FireInDepth, FrontSurface, Values
from fire_atlas.core.pixels import Pixels, Plane
from fire_atlas.generators.settings import GenerationSettings


class Rendering(Protocol):
    """A generated fire seen by one camera; safe to use from several threads.

    Attributes:
        matte: ``alpha`` or ``luminance``: source of the coverage of its frames.
        matte_reason: Reason for that, shown to the user.
    """

    matte: ClassVar[str]
    matte_reason: ClassVar[str]

    @property
    def camera(self) -> Camera:
        """The camera, which also sets the size of a frame."""

    @property
    def front(self) -> Camera:
        """The camera in front of the fire, level, with parallel lines of sight, in px of the same
        size; its frame holds the whole fire."""

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4), a fresh array."""

    @property
    def motion(self) -> Callable[[int], NDArray[np.float32]] | None:
        """Velocity of the fire in a frame by its number: (height, width, 2) px/s, x right, y down.

        None: it is estimated from what is drawn. Gas runs through a flame that stands, so its own
        velocity says less."""

    @property
    def burning(self) -> Callable[[int], Plane] | None:
        """Which share of the light of a frame is fire's; see ``Clip.burning``."""

    def seen_by(self, camera: Camera) -> Self:
        """Return the rendering of the same fire by another camera."""

    def fire_depth(self, index: int, x: Values, y: Values, share: Values) -> Values:
        """Return the depth at which fire burns behind places; see ``FireInDepth``."""

    def hidden(self, index: int, x: Values, y: Values, z: Values) -> NDArray[np.bool_]:
        """Return which places are behind something opaque; see ``FireInDepth``."""

    def front_surface(self, index: int) -> FrontSurface:
        """Return the front of the fire's body in frame ``index``."""

    def smoke(self, index: int) -> Plane:
        """Return the share of light (height, width), 0..1, that smoke keeps back in a frame."""


def rendered_clip(
    rendering: Rendering,
    settings: GenerationSettings,
    blend_space: str,
    inputs: tuple[Path, ...],
) -> Clip:
    """Return a clip of a rendering; each frame is drawn when it is read.

    Args:
        rendering: The fire, seen by a camera.
        settings: Number of frames, frame rate, and whether they loop.
        blend_space: ``srgb`` or ``linear``: colour space in which the engine blends.
        inputs: Files the fire was made from.
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
        burning=rendering.burning,
        depth=FireInDepth(
            rendering.camera,
            rendering.front,
            lambda camera: rendered_clip(rendering.seen_by(camera), settings, blend_space, inputs),
            rendering.fire_depth,
            rendering.hidden,
            rendering.front_surface,
        ),
        smoke=rendering.smoke,
    )
