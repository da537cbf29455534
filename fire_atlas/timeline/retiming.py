"""Another frame rate for the same fire: what lies between two frames is made from both."""

from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Skipped, cached
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.vision.flow import SMALL, flow_size, optical_flow, thumbnail
from fire_atlas.vision.thumbnails import distance
from fire_atlas.vision.warp import (
    Motion,
    blurred,
    met,
    motion_between,
    over_channels,
    resized,
    shapes,
    warped,
)

_SOFTNESS = 0.008
"""Neighbouring places move alike over this part of the height."""

_WHOLE = 1e-3
"""Nearer to a frame than this, it is shown as it is."""

_TRIALS = 6
"""Frames that are made from their neighbours, to see whether that works."""

_HELPS = 0.95
"""It does if they are nearer to the truth than a neighbour is, by this factor."""

_PAIRS = 8
"""Pairs of frames whose motion is remembered."""

_SKIPPING = 1.5
"""From so many frames of the clip for one of the result, there are some that nothing shows."""

_HALFWAY = 0.2
"""So near to the middle of a step, in steps, a frame is about halfway."""

_ALIKE = 0.25
"""Places whose two sides differ by this share of their light have nothing in common."""


def retimed(clip: Clip, fps: float, count: int, is_smooth: bool) -> Clip:
    """Return ``clip`` with ``count`` frames at ``fps``; the fire keeps its speed.

    A loop is spread evenly over its frames; else frames are ``clip.fps / fps`` apart, or as much
    less as they must be for the last one not to lie beyond the clip.

    Args:
        clip: At its own rate.
        fps: Frames per second of the result.
        count: Frames of the result.
        is_smooth: Whether frames in between are made by optical flow; else the nearest is shown.
    """
    if clip.loop:
        pace = clip.count / count
    else:
        pace = min(clip.fps / fps, (clip.count - 1) / max(count - 1, 1))
    anew = _Retiming(clip, pace, is_smooth)
    places = [anew.place(i) for i in range(count)]
    made = {i for i, place in enumerate(places) if place.part > _WHOLE}
    steps = count if clip.loop else count - 1
    return replace(
        clip,
        count=count,
        fps=fps,
        picture=cached(anew.picture, made),
        flow=anew.flow if clip.count > 1 else clip.flow,
        backwards=frozenset(i for i, place in enumerate(places) if place.before in clip.backwards),
        skipped={i: shown for i in range(steps) if (shown := anew.skipped(i)) is not None},
    )


class _Place(NamedTuple):
    """Where a frame of the result lies: between two frames of the clip, ``part`` of the way; not
    at all between them where nothing is made there."""

    before: int
    after: int
    part: float


class _Retiming:
    """Frames of a clip, and how they move, at another pace."""

    def __init__(self, clip: Clip, pace: float, is_smooth: bool) -> None:
        """``pace``: frames of ``clip`` for one of the result; ``is_smooth`` as of ``retimed``."""
        self._clip, self._pace, self._is_smooth = clip, pace, is_smooth
        # A pair of frames has several of the result between them.
        self._motion = lru_cache(_PAIRS)(self._find_motion)
        self._velocity = lru_cache(_PAIRS)(self._find_velocity)

    def place(self, i: int) -> _Place:
        """Where frame ``i`` of the result lies."""
        place = i * self._pace
        before = int(place + _WHOLE)
        part = place - before
        if not self._is_smooth:
            before, part = (before if part <= 0.5 else self._following(before)), 0.0
        before %= self._clip.count
        return _Place(before, self._following(before), part)

    def picture(self, i: int) -> Picture:
        """Frame ``i`` of the result."""
        (before, after, part), clip = self.place(i), self._clip
        if part <= _WHOLE:
            return clip.picture(before)
        return _between(clip.read(before), clip.read(after), self._motion(before, after), part)

    def flow(self, i: int) -> NDArray[np.float32]:
        """How what frame ``i`` shows moves, as of ``Clip.flow``: as in the nearer frame of the
        clip, from which its shapes came."""
        (before, after, part), clip = self.place(i), self._clip
        near = before if part <= 0.5 else after
        if clip.flow is not None:
            moves = clip.flow(near)
        else:
            small, size = self._velocity(near), (clip.width, clip.height)
            moves = np.dstack([resized(small[..., n], size) for n in (0, 1)])
        if part <= _WHOLE:
            return moves
        to_before, to_after = met(self._motion(before, after), part)
        return warped(moves, to_before if near == before else to_after)

    def skipped(self, i: int) -> Skipped | None:
        """A frame of the clip that nothing shows, about halfway from frame ``i`` to the next."""
        middle = round((i + 0.5) * self._pace)
        part = middle / self._pace - i
        if self._pace < _SKIPPING or abs(part - 0.5) > _HALFWAY:
            return None
        return Skipped(part, partial(self._clip.read, middle % self._clip.count))

    def _following(self, i: int) -> int:
        count = self._clip.count
        return (i + 1) % count if self._clip.loop else min(i + 1, count - 1)

    def _find_motion(self, before: int, after: int) -> Motion:
        clip = self._clip
        return _motion(clip.read(before), clip.read(after), clip.blend_space)

    def _find_velocity(self, i: int) -> NDArray[np.float32]:
        following = self._following(i)
        return _velocity(self._clip, *((i - 1, i) if following == i else (i, following)))


def flow_helps(clip: Clip, workers: Workers) -> bool:
    """Whether frames made from both neighbours are nearer to the truth than a neighbour is."""
    if clip.count < 3:
        return True
    middles = sorted({round(i) for i in np.linspace(1, clip.count - 2, _TRIALS)})
    missed = list(workers.map(lambda i: _trial(clip, i), middles))
    made, nearest = (float(np.mean([trial[side] for trial in missed])) for side in (0, 1))
    return made <= _HELPS * nearest


def _trial(clip: Clip, i: int) -> tuple[float, float]:
    """How far frame ``i`` made from its neighbours is from the truth, and how far these are."""
    size = flow_size(clip.width, clip.height, SMALL)
    before, truth, after = (resized(clip.read(n), size) for n in (i - 1, i, i + 1))
    made = _between(before, after, _motion(before, after, clip.blend_space), 0.5)
    return distance(made, truth), (distance(before, truth) + distance(after, truth)) / 2


def _velocity(clip: Clip, before: int, after: int) -> NDArray[np.float32]:
    """Velocity of what frame ``before`` shows, (h, w, 2), px/s of the whole frame."""
    is_small = clip.width * clip.height <= SMALL
    shown = (clip.brightness(i) for i in (before, after))
    one, other = (thumbnail(plane, is_small) for plane in shown)
    if before in clip.backwards:
        one, other = other, one
    scale = clip.width / one.shape[1], clip.height / one.shape[0]
    return optical_flow(one, other, is_small) * np.array(scale, np.float32) * np.float32(clip.fps)


def _motion(before: Pixels, after: Pixels, blend_space: str) -> Motion:
    size = flow_size(before.shape[1], before.shape[0], SMALL)
    one, other = (shapes(resized(frame, size), blend_space) for frame in (before, after))
    return motion_between(one, other, _SOFTNESS)


def _between(before: Pixels, after: Pixels, motion: Motion, part: float) -> Pixels:
    """Return the frame ``part`` of the way from ``before`` to ``after``.

    Where both, warped to it, agree, they are mixed; where they do not, a mix would show both, and
    the nearer one counts more.
    """
    to_before, to_after = met(motion, part)
    one, other = warped(before, to_before), warped(after, to_after)
    share = _share(one, other, part)[..., None]
    return as_plane(one + (other - one) * share)


def _share(one: Pixels, other: Pixels, part: float) -> Plane:
    """How much of ``other`` each place takes, (H, W) in 0..1."""
    reach = max(0.004 * one.shape[0], 0.8)
    apart = blurred(over_channels(cv2.absdiff(one, other)), reach)
    light = blurred(over_channels(cv2.add(one, other)), reach)
    unlike = np.clip(apart / (_ALIKE * light + np.float32(0.02)), 0, 1)
    steepness = 1 + 2 * unlike
    return as_plane(np.clip((part - 0.5) * steepness + 0.5, 0, 1))
