"""Retime a clip to another frame rate: in-between frames are interpolated by optical flow."""

from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Skipped, cached
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import Pixels, Plane, as_plane, luminance
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.holds import Holds
from fire_atlas.vision.flat_art import is_flat_art
from fire_atlas.vision.flow import SMALL, flow_size, optical_flow, resized, thumbnail
from fire_atlas.vision.palette import Palette
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.thumbnails import distance
from fire_atlas.vision.warp import (
    BidirectionalFlow,
    bidirectional_flow,
    blurred,
    flow_input,
    intermediate_flows,
    over_channels,
    warp,
)

_FLOW_SMOOTHING = 0.008
"""Standard deviation of the Gaussian that smooths the flow, as a fraction of the height."""

_WHOLE = 1e-3
"""A time within this many steps of a clip's frame shows that frame as it is."""

_HELD_OUT = 6
"""Number of frames that are interpolated from their neighbours, to test whether that works."""

_MAX_ERROR = 0.95
"""Interpolation works if its error is at most this fraction of the error of showing a neighbour."""

_CACHED_PAIRS = 8
"""Number of frame pairs whose flow is cached."""

_SKIPPING = 1.5
"""From this many clip frames per frame of the result, some clip frames are never shown."""

_HALFWAY = 0.2
"""A frame within this many steps of the middle of a step is about halfway."""

_UNLIKE = 0.25
"""Where the two warped frames differ by this fraction of their brightness, they count as fully
different."""


def at_rate(clip: Clip, fps: float, count: int, workers: Workers, progress: Progress) -> Clip:
    """Return a clip at another frame rate: frames between two of its own are interpolated, or the
    nearest one is shown where that looks better.

    Args:
        clip: The clip at its own rate.
        fps: Frames per second of the result.
        count: Number of frames of the result.
        workers: Read and compare frames in parallel.
        progress: Receives a note on what was decided, and why.
    """
    change = f"{clip.count} frames at {clip.fps:g} fps become {count} at {fps:g}"
    if clip.loop and count == clip.count:
        progress.note(f"{change}: each is shown as it is (timeline.frames)")
        return replace(clip, fps=fps, count=count)
    holds, palette = Holds.of(clip, workers), Palette.of(clip, workers)
    why = _why_not_interpolated(clip, holds, palette, workers)
    shown = f"those between two are interpolated along the optical flow{_rhythm_clause(holds)}"
    progress.note(f"{change}: {f'the nearest are shown, as {why}' if why else shown}")
    return _retimed(clip, fps, count, holds, None if why else palette)


def _why_not_interpolated(
    clip: Clip, holds: Holds, palette: Palette, workers: Workers
) -> str | None:
    """Return, as a clause, why frames in between are not interpolated; None if they are."""
    if is_flat_art(clip):
        return "it has too few colours to mix them unseen"
    if (holds.length > 1).all():
        return f"the clip holds each drawing for {holds.usual} frames"
    if not _flow_helps(clip, holds, palette, workers):
        return "interpolated ones are further from frames that were held out"
    return None


def _rhythm_clause(holds: Holds) -> str:
    """Return a clause on the frames that the clip holds; empty if there are none."""
    held = int((holds.length > 1).sum())
    return f"; {held} that show a drawing for longer stay as they are" if held else ""


def _retimed(clip: Clip, fps: float, count: int, holds: Holds, palette: Palette | None) -> Clip:
    """Return ``clip`` with ``count`` frames at ``fps``; the fire keeps its speed.

    The frames of a loop are spread evenly over the clip. Others are ``clip.fps / fps`` frames of
    the clip apart, or less if the last one would otherwise lie beyond its end. A drawing that the
    clip holds stays until the next one: nothing lies between a frame and itself.

    Args:
        clip: The clip at its own rate.
        fps: Frames per second of the result.
        count: Number of frames of the result.
        holds: Which frames of the clip show the same drawing.
        palette: Colours of the clip, in which frames are interpolated by optical flow; None if the
            nearest one is shown instead.
    """
    if clip.loop:
        pace = clip.count / count
    else:
        pace = min(clip.fps / fps, (clip.count - 1) / max(count - 1, 1))
    retiming = _Retiming(clip, pace, holds, palette)
    places = [retiming.place(i) for i in range(count)]
    made = {i for i, place in enumerate(places) if place.time > _WHOLE}
    steps = count if clip.loop else count - 1
    return replace(
        clip,
        count=count,
        fps=fps,
        picture=cached(retiming.picture, made),
        flow=retiming.flow if clip.count > 1 else clip.flow,
        backwards=frozenset(i for i, place in enumerate(places) if place.before in clip.backwards),
        skipped={i: shown for i in range(steps) if (shown := retiming.skipped(i)) is not None},
    )


class _Place(NamedTuple):
    """The two frames of the clip between which a frame of the result lies, and its time, 0..1.

    ``time`` is 0 where frame ``before`` is shown as it is.
    """

    before: int
    after: int
    time: float


class _Retiming:
    """Frames of a clip and their motion at another frame rate."""

    def __init__(self, clip: Clip, pace: float, holds: Holds, palette: Palette | None) -> None:
        """``pace``: clip frames per frame of the result; the others are those of ``_retimed``."""
        self._clip, self._pace, self._holds, self._palette = clip, pace, holds, palette
        # Several frames of the result may lie between the same two frames of the clip.
        self._flow_between = lru_cache(_CACHED_PAIRS)(self._find_flow)
        self._velocity = lru_cache(_CACHED_PAIRS)(self._find_velocity)

    def place(self, i: int) -> _Place:
        """Return where frame ``i`` of the result lies."""
        place = i * self._pace
        before = int(place + _WHOLE)
        time = place - before
        if self._palette is None:
            before, time = (before if time <= 0.5 else self._following(before)), 0.0
        before %= self._clip.count
        if self._holds.is_held(before):
            time = 0.0
        return _Place(before, self._following(before), time)

    def picture(self, i: int) -> Picture:
        """Return frame ``i`` of the result."""
        (before, after, time), clip = self.place(i), self._clip
        if time <= _WHOLE or self._palette is None:
            return clip.picture(before)
        flow = self._flow_between(before, after)
        return interpolated(clip.read(before), clip.read(after), flow, time, self._palette)

    def flow(self, i: int) -> NDArray[np.float32]:
        """Return the velocity of the fire in frame ``i``, like ``Clip.flow``.

        It is the velocity in the nearer frame of the clip, warped to the time of frame ``i``.
        """
        (before, after, time), clip = self.place(i), self._clip
        near = before if time <= 0.5 else after
        if clip.flow is not None:
            velocity = clip.flow(near)
        else:
            small, size = self._velocity(near), (clip.width, clip.height)
            velocity = np.dstack([resized(small[..., n], size) for n in (0, 1)])
        if time <= _WHOLE:
            return velocity
        to_before, to_after = intermediate_flows(self._flow_between(before, after), time)
        return warp(velocity, to_before if near == before else to_after)

    def skipped(self, i: int) -> Skipped | None:
        """Return a clip frame that is never shown, about halfway between frames ``i`` and i + 1.

        It is used to test motion vectors. None if there is no such frame.
        """
        middle = round((i + 0.5) * self._pace)
        time = middle / self._pace - i
        if self._pace < _SKIPPING or abs(time - 0.5) > _HALFWAY:
            return None
        return Skipped(time, partial(self._clip.read, middle % self._clip.count))

    def _following(self, i: int) -> int:
        count = self._clip.count
        return (i + 1) % count if self._clip.loop else min(i + 1, count - 1)

    def _find_flow(self, before: int, after: int) -> BidirectionalFlow:
        clip = self._clip
        return flow_between(clip.read(before), clip.read(after), clip.blend_space)

    def _find_velocity(self, i: int) -> NDArray[np.float32]:
        # A held drawing moves on by one step in all the time for which it is shown.
        first, length = int(self._holds.first[i]), int(self._holds.length[i])
        following = self._following(first + length - 1)
        is_last = self._holds.first[following] == first
        pair = (first - 1, first) if is_last else (first, following)
        return _velocity(self._clip, *pair) / np.float32(length)


def _flow_helps(clip: Clip, holds: Holds, palette: Palette, workers: Workers) -> bool:
    """Whether interpolation predicts held-out frames better than showing a neighbour does.

    Only frames that lie between two other drawings can tell.
    """
    single = holds.length == 1
    between = np.flatnonzero(single[:-2] & single[1:-1] & single[2:]) + 1
    if not len(between):
        return True
    held_out = [int(between[k - 1]) for k in evenly_spread(1, len(between), _HELD_OUT)]
    errors = list(workers.map(lambda i: _errors(clip, i, palette), held_out))
    interpolated, nearest = (float(np.mean([pair[side] for pair in errors])) for side in (0, 1))
    return interpolated <= _MAX_ERROR * nearest


def _errors(clip: Clip, i: int, palette: Palette) -> tuple[float, float]:
    """Return the distance from frame ``i`` to its interpolation, and to its neighbours (mean)."""
    size = flow_size(clip.width, clip.height, SMALL)
    before, truth, after = (resized(clip.read(n), size) for n in (i - 1, i, i + 1))
    flow = flow_between(before, after, clip.blend_space)
    made = interpolated(before, after, flow, 0.5, palette)
    return distance(made, truth), (distance(before, truth) + distance(after, truth)) / 2


def _velocity(clip: Clip, before: int, after: int) -> NDArray[np.float32]:
    """Velocity of the fire in frame ``before``, (h, w, 2), in px/s of the full-size frame."""
    is_small = clip.width * clip.height <= SMALL
    shown = (clip.brightness(i) for i in (before, after))
    one, other = (thumbnail(plane, is_small) for plane in shown)
    if before in clip.backwards:  # played in reverse: find the velocity of the fire as filmed
        one, other = other, one
    scale = clip.width / one.shape[1], clip.height / one.shape[0]
    return optical_flow(one, other, is_small) * np.array(scale, np.float32) * np.float32(clip.fps)


def flow_between(before: Pixels, after: Pixels, blend_space: str) -> BidirectionalFlow:
    """Return the flow between two frames (H, W, 4), estimated on small copies."""
    size = flow_size(before.shape[1], before.shape[0], SMALL)
    one, other = (flow_input(resized(frame, size), blend_space) for frame in (before, after))
    return bidirectional_flow(one, other, _FLOW_SMOOTHING)


def interpolated(
    before: Pixels, after: Pixels, flow: BidirectionalFlow, time: float, palette: Palette
) -> Pixels:
    """Return the frame at ``time``, 0..1, between two frames.

    Both are warped to that time and mixed in colours of the clip. Where they disagree, a mix would
    show both as ghosts, so the nearer one gets more weight.
    """
    to_before, to_after = intermediate_flows(flow, time)
    one, other = warp(before, to_before), warp(after, to_after)
    weight = _weight(one, other, time)
    light, coverage = (
        _mixed(plane_of(one), plane_of(other), weight) for plane_of in (luminance, _coverage)
    )
    return palette.mix(one, other, weight, light, coverage)


def _mixed(one: Plane, other: Plane, weight: Plane) -> Plane:
    return as_plane(one + (other - one) * weight)


def _coverage(pixels: Pixels) -> Plane:
    return as_plane(cv2.extractChannel(pixels, 3))


def _weight(one: Pixels, other: Pixels, time: float) -> Plane:
    """Return the weight of ``other`` in the mix at each place, (H, W) in 0..1."""
    sigma = max(0.004 * one.shape[0], 0.8)
    difference = blurred(over_channels(cv2.absdiff(one, other)), sigma)
    light = blurred(over_channels(cv2.add(one, other)), sigma)
    unlike = np.clip(difference / (_UNLIKE * light + np.float32(0.02)), 0, 1)
    steepness = 1 + 2 * unlike
    return as_plane(np.clip((time - 0.5) * steepness + 0.5, 0, 1))
