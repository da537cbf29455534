"""Tell which part of what a clip shows is its flame, and not what stands in it or behind it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture, as_light, brightest_shown, brightness_of
from fire_atlas.core.pixels import Pixels, Plane, as_plane, decode_bytes, encode_unit
from fire_atlas.effect.composition.cover import hidden_by_coverage
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.heat.ramp_colours import Light, OwnColours, Values, shown
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.still import still_things

_SAMPLES, _SAMPLED = 8, 1 << 15
"""Number of frames by which a flame's own colours are measured, and of pixels of each."""

_SOLID, _SMALLEST = 0.5, 0.002
"""How much a thing hides, and the part of the frame that things have at least."""

_HOLLOW = 0.3
"""Width of a hollow in a thing, heights."""

_BURNS, _AROUND = 0.3, 0.02
"""How far the darkest that was seen is flame from which on fire burns there in every frame, and how
far around what is behind it is looked for, heights."""

_SURE = np.float32(3)
"""Times what a pixel hides that it is not light alone, up to all of it."""


@dataclass(frozen=True, slots=True)
class FlamePart:
    """What tells a clip's flame from all else in its pictures.

    Attributes:
        blend_space: Encoding in which the client blends.
        own: The flame's own colours, by which it is told from smoke and wood; None if something
            else tells.
        scene: Tells flame from the scene behind it, if the clip is an opaque scene.
        still: (H, W) how far each pixel shows a thing that stands still, 0..1, if the clip is fire
            on black, whose coverage says nothing of things.
    """

    blend_space: str
    own: OwnColours | None
    scene: FlameSegmentation | None
    still: Plane | None

    @classmethod
    def of(cls, clip: Clip, flame: FlameSegmentation, context: BuildContext) -> Self:
        """Measure a clip with this ``flame``; what stands in it may be known (``Clip.solids``)."""
        scene = None if flame.background is None else flame
        is_told = clip.solids is not None or scene is not None
        own = None if is_told else _own_colours(clip, context)
        is_filmed = clip.matte == "luminance" and clip.flow is None
        still = _still_things(clip, flame.activity, context) if is_filmed else None
        return cls(clip.blend_space, own, scene, still)

    def of_colours(self, seen: Light) -> Values:
        """Return how much of each colour, 0..1, is flame, of what is shown of it over black."""
        return np.ones(len(seen), np.float32) if self.own is None else self.own.share(seen)

    def of_frame(self, flame: Picture, where: NDArray[np.intp], seen: Light) -> Values:
        """Return how much of each pixel ``where`` (n,) of a frame, 0..1, is flame.

        ``seen`` is what is shown of them over black, as from ``shown``.
        """
        share = self.of_colours(seen)
        if self.scene is not None:
            brightness = brightness_of(flame, self.blend_space)
            share = self.scene.fire_before(brightness, as_light(flame)).reshape(-1)[where]
        if self.still is not None:
            share = as_plane(share * (1 - self.still.reshape(-1)[where]))
        return share

    def of_picture(self, flame: Picture) -> Plane:
        """Return how much of each pixel of a frame, (H, W) in 0..1, is flame."""
        light = as_light(flame)
        share = np.zeros(light.shape[:2], np.float32)
        where = np.flatnonzero(light[..., 3] > 0)
        seen = shown(light.reshape(-1, 4)[where], self.blend_space)
        share.reshape(-1)[where] = self.of_frame(flame, where, seen)
        return share


class Parted(NamedTuple):
    """A frame in two parts, whose light and coverage add up to it.

    Attributes:
        flame: (H, W, 4) its flame.
        rest: (H, W, 4) what stands in it, or behind it.
    """

    flame: Pixels
    rest: Pixels


def parting(clip: Clip, flame: FlameSegmentation, context: BuildContext) -> Callable[[int], Parted]:
    """Return what parts frame i of a clip with this ``flame``.

    Of an opaque scene, what is behind the flame is the darkest that was seen there, and where it
    burns in every frame what is around it.
    """
    if (solids := clip.solids) is not None:
        return lambda i: _without(clip.read(i), solids(i))
    part = FlamePart.of(clip, flame, context)
    if part.scene is not None:
        darkest = reduce(np.minimum, context.workers.map(clip.read, range(clip.count)))
        burns = (part.of_picture(darkest) > _BURNS).astype(np.uint8)
        seen = np.rint(255 * encode_unit(np.ascontiguousarray(darkest[..., :3]))).astype(np.uint8)
        found = cv2.inpaint(seen, burns, _AROUND * clip.height, cv2.INPAINT_TELEA)
        around = np.asarray(found, np.uint8)
        behind = np.where(burns[..., None], decode_bytes(around), darkest[..., :3])
        scene = np.dstack([np.minimum(behind, darkest[..., :3]), darkest[..., 3]])
        return lambda i: _without(clip.read(i), as_plane(scene))

    def rest_of(whole: Pixels) -> Plane:
        if part.still is not None:  # of fire on black, all that does not stand still is light
            return part.still
        # What hides no more than its light needs is light, of whatever colour.
        solid = np.minimum(hidden_by_coverage(whole) * _SURE, 1)
        return as_plane((1 - part.of_picture(whole)) * solid)

    def parted(i: int) -> Parted:
        whole = clip.read(i)
        rest = rest_of(whole)[..., None]
        return Parted(as_plane(whole * (1 - rest)), as_plane(whole * rest))

    return parted


def _without(whole: Pixels, rest: Pixels) -> Parted:
    return Parted(as_plane(np.maximum(whole - rest, 0)), np.minimum(whole, rest))


def _own_colours(clip: Clip, context: BuildContext) -> OwnColours:
    """Measure the colours of a clip's flame in a few of its frames."""
    stride = max(1, clip.width * clip.height // _SAMPLED)

    def some(i: int) -> Light:
        return clip.read(i).reshape(-1, 4)[::stride]

    numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
    seen = shown(np.concatenate(list(context.workers.map(some, numbers))), clip.blend_space)
    return OwnColours.of(seen, clip.blend_space, is_matted=clip.matte == "alpha")


def _still_things(clip: Clip, activity: Plane, context: BuildContext) -> Plane:
    """Return how far each pixel of a clip, (H, W) in 0..1, shows a thing that stands still.

    Where the room was cleared away the coverage says so: a thing covers more than its light needs.
    """

    def brightness(i: int) -> Plane:
        return brightest_shown(clip.picture(i)) * np.float32(255)

    def hidden(i: int) -> Plane:
        return hidden_by_coverage(clip.picture(i))

    numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
    covered = reduce(np.minimum, context.workers.map(hidden, numbers))
    solid = (covered > _SOLID).astype(np.uint8)
    if solid.mean() > _SMALLEST:
        # What glows in a hollow of a thing, as molten wax, is of the thing, and so is its edge.
        opaque = reduce(
            np.minimum, context.workers.map(lambda i: as_light(clip.picture(i))[..., 3], numbers)
        )
        side = 2 * round(_HOLLOW * clip.height / 2) + 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        whole = cv2.dilate(cv2.morphologyEx(solid, cv2.MORPH_CLOSE, disc), np.ones((5, 5)))
        return as_plane(np.maximum(covered, whole * (opaque > _SOLID)))
    return still_things(list(context.workers.map(brightness, numbers)), activity)
