"""A picture of something of the user's that burns: where it chars, glows and is lit.

The fire is drawn over it, so its frames hold what the fire does to it: char that covers it, cracks
that glow, the light of the flames on it. It stands upright in the plane through the fire's middle,
and hides the flames behind it.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Window
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.silk.glow import blurred
from fire_atlas.generators.silk.intruder_drawing import CHAR, CONTACT, Hearth, glowing

_GAP_WIDTH, _GAP_DEPTH = 0.03, 0.3
"""Greatest width, heights, of what is dark between brighter parts and counts as a gap; and how much
darker it is there than around, as a part of that, if it is deep."""

_CHAR_ASIDE, _CHAR_ABOVE, _CHAR_BELOW = 0.05, 0.16, 0.03
"""How far from the foot of a flame it is charred: to its sides, above and below, heights."""

_CHAR_COVER = 0.88
"""What char covers of the picture at most: its grain still shows."""

_SPOT, _SCALE = 0.035, 0.012
"""Size of the patches in which wood chars and glows, and of the scales of char, heights."""

_IN_CRACKS = 0.3
"""How brightly the cracks between scales glow, relative to edges and gaps."""

_LIGHT_SPREADS = 0.02, 0.06, 0.16
"""Standard deviations of the Gaussians whose sum is the light that flames throw on the picture,
heights: they burn before it."""

_LIGHT_GAIN = 0.06
"""Share of that light that the picture receives."""


@dataclass(frozen=True, slots=True, eq=False)
class BurningPicture:
    """What burns, in a picture of the frame's proportions.

    Attributes:
        burns: (h, w) where something burns.
        colours: (h, w, 3) its linear colours; None if only where it burns is known.
    """

    burns: NDArray[np.bool_]
    colours: NDArray[np.float32] | None = None

    def edges(self) -> Plane:
        """Return (h, w) 0..1, where thin wood burns best: at its outline and along gaps in it."""
        burns = self.burns.astype(np.float32)
        side = 2 * max(1, round(_GAP_WIDTH / 2 * len(burns))) + 1
        around = np.ones((side, side), np.uint8)
        outline = burns - cv2.erode(burns, np.ones((3, 3), np.uint8))
        if self.colours is None:
            return as_plane(outline)
        bright = self.colours.max(axis=2)
        filled = cv2.morphologyEx(bright, cv2.MORPH_CLOSE, around)
        gap = (filled - bright) / np.maximum(_GAP_DEPTH * filled, 1e-3)
        return as_plane(np.maximum(outline, smooth_step(gap - 0.5)) * burns)


@dataclass(frozen=True, slots=True, eq=False)
class CharredPicture:
    """What a fire does to a picture.

    Attributes:
        picture: The picture.
        colours: (h, w, 3) its linear colours.
        feet: (n, 2) where flames begin: right of the middle and up from the ground, heights.
    """

    picture: BurningPicture
    colours: NDArray[np.float32]
    feet: NDArray[np.float64]

    def seen_by(self, camera: Camera, samples: int) -> "PictureBuffers | None":
        """Return what a camera sees of it; None from where it is not the user's picture: only from
        the front it is, level, with parallel lines of sight."""
        if camera != camera.from_the_front():
            return None
        return PictureBuffers.of(self, camera, samples)


@dataclass(frozen=True, slots=True)
class PictureBuffers:
    """A charred picture in the samples of a frame.

    Attributes:
        opaque: (height, width) 0..1, what it hides of the flames behind it.
        coverage: (height, width) 0..1, what its char covers of the picture.
        colour: (height, width, 3) linear, of what is not charred; 0 where nothing is.
        cracks: (height, width) 0..1, how brightly it glows.
        wander: (height, width) rad, when the glow swells there.
        scale: Samples per height.
    """

    opaque: Plane
    coverage: Plane
    colour: NDArray[np.float32]
    cracks: Plane
    wander: Plane
    scale: float

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, charred: CharredPicture, camera: Camera, samples: int) -> Self:
        """Draw it for a camera in front."""
        width, height = camera.width * samples, camera.height * samples
        scale, picture = camera.scale * samples, charred.picture

        def fitted(plane: NDArray[np.float32]) -> NDArray[np.float32]:
            is_larger = plane.shape[0] > height
            way = cv2.INTER_AREA if is_larger else cv2.INTER_LINEAR
            return as_plane(cv2.resize(plane, (width, height), interpolation=way))

        opaque, edges = fitted(as_plane(picture.burns)), fitted(picture.edges())
        colour = fitted(charred.colours) * opaque[..., None]
        right = ((np.arange(width) + 0.5) / samples - camera.origin[0]) / camera.scale
        up = (camera.origin[1] - (np.arange(height) + 0.5) / samples) / camera.scale
        whole = np.ones((height, width))
        for x, z in charred.feet:
            above = up - z
            rise = above / np.where(above > 0, _CHAR_ABOVE, _CHAR_BELOW)
            near = np.exp(-(((right - x) / _CHAR_ASIDE) ** 2))
            whole *= 1 - 0.8 * np.exp(-(rise**2))[:, None] * near
        patches = _noise(0, (height, width), _SPOT * scale)
        fine = _noise(1, (height, width), _SCALE * scale)
        burnt = (1 - whole) * (1 + 0.4 * edges) + 0.06 * patches + 0.03 * fine
        char = as_plane(smooth_step((burnt - 0.1) / 0.75) * opaque)
        hot = smooth_step((burnt - 0.45 + 0.1 * patches) / 0.6) ** 2
        seams = edges**2 + _IN_CRACKS * np.exp(-((fine + 0.5 * patches) ** 2) / 0.03)
        cracks = as_plane(char * hot * seams)
        return cls(opaque, _CHAR_COVER * char, colour, cracks, as_plane(2 * patches), scale)

    def shows(
        self, window: Window, sample: NDArray[np.intp], depth: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return how much is seen, 0..1, of flame at ``depth``, heights, in each ``sample`` of a
        window."""
        hidden = smooth_step(depth / np.float32(CONTACT))
        return np.asarray(1 - hidden * self.opaque[window.slices].ravel()[sample], np.float32)

    def lit_by(self, flame: NDArray[np.float32], hearth: Hearth) -> NDArray[np.float32]:
        """Return the light (height, width, 3) of the picture: of its cracks, and what it throws
        back of that of the ``flame`` of the same shape."""
        falls = np.sum([blurred(flame, spread * self.scale) for spread in _LIGHT_SPREADS], axis=0)
        char = self.coverage[..., None]
        colour = self.colour * (1 - char) + CHAR.astype(np.float32) * char
        beat = hearth.beat(self.wander.ravel().astype(np.float64))
        glow = glowing(self.cracks.ravel() * beat)
        received = np.maximum(falls, 0) * np.float32(_LIGHT_GAIN)
        return as_plane(colour * received + glow.reshape(flame.shape))


def _noise(number: int, shape: tuple[int, int], size: float) -> Plane:
    """Return noise of mean 0 and rms 1 whose spots are of a ``size``, px."""
    small = tuple(max(2, round(2 * length / size)) for length in shape)
    chance = generator(number, RandomStream.SHEETS, 4)
    noise = chance.standard_normal(small).astype(np.float32)
    spots = cv2.resize(noise, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return as_plane(spots / max(float(spots.std()), 1e-6))
