"""Clear away the room around a flame that was filmed in the dark, and keep what stands in it.

Of fire on black, brightness becomes coverage. In a dark room that makes a veil of the wall behind
the flame, which ends raggedly where the footage is too dark to hold it; and the unlit part of a
candle becomes glass. Both stand still, as the flame does not: the veil is smooth and reaches the
border of the frame, a thing has an outline.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.picture import Picture, as_light, brightest
from fire_atlas.core.pixels import (
    Pixels,
    Plane,
    as_plane,
    decode_unit,
    encode_unit,
    light_added,
    pixels_of_added,
)
from fire_atlas.core.workers import Workers
from fire_atlas.vision.activity import activity
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.still import still_things

_SAMPLES, _LEAST = 9, 4
"""Number of frames, evenly spread, by which the room is found, and the least that a clip has."""

_SIDE = 320
"""Largest height, px, of the copies in which the room is found, which bounds their memory."""

_SMOOTH = 0.02
"""Standard deviation, heights, of the blur by which a veil is told from grain."""

_BORDER = 0.04
"""Width of the border that a veil reaches, heights."""

_VEIL, _SCENE = 3 / 255, 48 / 255
"""Brightness of a veil, sRGB in 0..1: less is black, and more is a scene that is lit."""

_WIDE, _REACHED = 0.15, 0.25
"""Least part of the frame, and of its border, that a veil has."""

_WALL, _FLAME = 1.5, 4.0
"""Brightness of a pixel, in that of the veil there, up to which it is the wall's, and from which it
is a flame's."""

_MIN_THING = 0.05
"""How far a pixel may show a thing, or motion, and still count as of the room."""

_GRAIN = 5.0
"""Brightness that a veil has above its least over time, in standard deviations of its grain."""

_REMAINS = 2.5
"""Brightness, in that of the veil at the border, from which steady light is the flame's own."""

_NOTCH = 0.2
"""Width of notches of a thing that are filled, as beneath a flame, which moves there: heights."""

_UNLIT = 0.3
"""Brightness of the end of a thing, relative to its bright parts, below which it is not its end but
lost in the dark."""

_MIN_COVERAGE = np.float32(1e-6)
"""Minimum coverage that light is divided by."""


@dataclass(frozen=True, slots=True)
class DarkRoom:
    """What stands still around a flame.

    Attributes:
        veil: (H, W, 3) what is taken off each frame as it is shown over black, sRGB in 0..1.
        things: (H, W) 0..1, how far each pixel shows a thing, which hides what is behind it.
        haze: Brightness of the frame's border, 0..255, if that is too much for a veil; else 0.
    """

    veil: NDArray[np.float32]
    things: Plane
    haze: float

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> Self:
        """Find the room of a clip of fire on black."""
        smaller = max(1.0, clip.height / _SIDE)
        size = max(1, round(clip.width / smaller)), max(1, round(clip.height / smaller))

        def small(i: int) -> tuple[NDArray[np.float32], Plane]:
            parts = _shown(clip.read(i), clip.blend_space), clip.brightness(i)
            shown, bright = (cv2.resize(each, size, interpolation=cv2.INTER_AREA) for each in parts)
            return as_plane(shown), as_plane(bright)

        numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
        shown, bright = zip(*workers.map(small, numbers), strict=True)
        moves = activity(list(bright))
        # The least of each pixel over time: a flame flickers, and lets the room be seen.
        resting = as_plane(reduce(np.minimum, shown))
        nothing = np.zeros_like(moves)
        if haze := _haze(resting, moves):
            return cls(np.zeros_like(resting), nothing, haze)
        # Means of pixels have less grain than the pixels themselves.
        spread = np.std(np.stack([brightest(frame) for frame in shown]), axis=0)
        grain = as_plane(spread * smaller)
        # A wall may share the outline of what stands before it; a glow has one without the wall.
        peaks = [brightest(frame) for frame in shown]
        veil = brightest(_veil(resting, nothing, grain))
        found = np.minimum(
            still_things([peak * np.float32(255) for peak in peaks], moves),
            still_things([np.maximum(peak - veil, 0) * np.float32(255) for peak in peaks], moves),
        )
        things = _whole(found, brightest(resting))
        whole = [
            as_plane(cv2.resize(each, (clip.width, clip.height)))
            for each in (_veil(resting, things, grain), things)
        ]
        return cls(whole[0], whole[1], 0.0)

    def cleared(self, picture: Picture, blend_space: str) -> Pixels:
        """Return a frame (H, W, 4) without the veil, and with things that hide."""
        pixels = as_light(picture)
        shown, veil = _shown(pixels, blend_space), brightest(self.veil)
        # What is far brighter is a flame before the wall, which hides it.
        beyond = brightest(shown) / np.maximum(veil, _MIN_COVERAGE)
        taken = 1 - smooth_step((beyond - _WALL) / (_FLAME - _WALL))
        shown = np.maximum(shown - self.veil * taken[..., None], 0)
        bright = decode_unit(shown) if blend_space == "linear" else shown
        coverage = np.maximum(np.minimum(brightest(bright), pixels[..., 3]), self.things)
        return pixels_of_added(bright, coverage, blend_space)


def _border(height: int, width: int) -> NDArray[np.bool_]:
    """Return which pixels (height, width) are of the frame's border."""
    border, band = np.ones((height, width), np.bool_), max(1, round(_BORDER * height))
    border[band:-band, band:-band] = False
    return border


def _haze(resting: NDArray[np.float32], moves: Plane) -> float:
    """Return the brightness, 0..255, of a room that is too bright for a veil; 0 if it is dark."""
    border, peak = _border(*moves.shape), brightest(resting)
    lit = peak[border & (peak > _SCENE) & (moves < _MIN_THING)]
    return 255 * float(np.median(lit)) if lit.size > border.sum() / 2 else 0.0


def _veil(resting: NDArray[np.float32], things: Plane, grain: Plane) -> NDArray[np.float32]:
    """Return the veil (H, W, 3) around ``things``, 0 if there is none.

    Args:
        resting: (H, W, 3) the least of each pixel over time, sRGB in 0..1.
        things: (H, W) 0..1; their light is none of the veil's.
        grain: (H, W) standard deviation of each pixel over time.
    """
    height, width = things.shape
    beside, spread = as_plane(things < _MIN_THING), ((0, 0), _SMOOTH * height)
    weight = cv2.GaussianBlur(beside, *spread)[..., None]
    smooth = cv2.GaussianBlur(resting * beside[..., None], *spread)
    smooth = as_plane(smooth / np.maximum(weight, _MIN_COVERAGE))
    peak = brightest(smooth)
    border = _border(height, width) & (things < _MIN_THING)
    is_veil = (peak > _VEIL) & (peak < _SCENE)
    reached = peak[border & is_veil]
    if is_veil.mean() < _WIDE or reached.size < _REACHED * max(border.sum(), 1):
        return np.zeros_like(resting)
    level = float(np.percentile(reached, 90))
    own = smooth_step((peak - level) / ((_REMAINS - 1) * level))
    room = as_plane(1 - np.maximum(own, things))
    return as_plane((smooth + np.float32(_GRAIN * np.median(grain[is_veil]))) * room[..., None])


def _whole(things: Plane, resting: Plane) -> Plane:
    """Return ``things`` (H, W) without notches, each continued down to the frame's border where it
    fades into the dark: the flame lights no more of it.

    ``resting`` (H, W) is the least brightness over time, sRGB in 0..1.
    """
    height = len(things)
    side = 2 * max(1, round(_NOTCH * height / 2)) + 1
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    solid = cv2.morphologyEx((things > 0.5).view(np.uint8), cv2.MORPH_CLOSE, around)
    solid = cv2.erode(solid, np.ones((3, 3), np.uint8))
    count, parts = cv2.connectedComponents(solid)
    for part in range(1, count):
        here = parts == part
        columns = np.flatnonzero(here.any(axis=0))
        ends = height - 1 - np.argmax(here[::-1, columns], axis=0)
        if np.median(resting[ends, columns]) < _UNLIT * np.percentile(resting[here], 90):
            for column, end in zip(columns, ends, strict=True):
                solid[end:, column] = 1
    return as_plane(cv2.blur(solid.astype(np.float32), (3, 3)))


def without_room(clip: Clip, workers: Workers, note: Callable[[str], None]) -> Clip:
    """Return a filmed clip of fire on black without the veil of its room; ``note`` is told what was
    found."""
    if clip.body < _LEAST:
        return clip
    room = DarkRoom.of(clip, workers)
    if room.haze:
        note(
            f"the border of the frame is {room.haze:.0f} of 255 bright, which stays as a veil "
            f"around the fire: set source.black to that, or source.crop to the fire"
        )
    has_veil, has_things = bool(room.veil.any()), bool(room.things.any())
    if not (has_veil or has_things):
        return clip
    found = [
        *(["the veil of the room goes"] if has_veil else []),
        *(["what stands in it stays opaque"] if has_things else []),
    ]
    note(f"filmed in the dark: {', and '.join(found)} (source.black: 0 keeps it as it is)")
    return replace(clip, picture=lambda i: room.cleared(clip.picture(i), clip.blend_space))


def _shown(pixels: Pixels, blend_space: str) -> NDArray[np.float32]:
    """Return what a client shows of pixels over black, (H, W, 3), sRGB in 0..1."""
    added = light_added(pixels, blend_space)
    return encode_unit(np.ascontiguousarray(added)) if blend_space == "linear" else added
