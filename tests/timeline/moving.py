"""Clips of known motion, and helpers that tests of the timeline share."""

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.arrange import arrange
from tests.support.clips import clip_of

Place = tuple[float, float]


class Notes:
    """A ``Progress`` that keeps its notes."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def stage(self, name: str, total: int) -> None:
        """Stages are of no interest."""

    def advance(self, done: int = 1) -> None:
        """Nor are steps."""

    def note(self, message: str) -> None:
        self.notes.append(message)


def arranged(clip: Clip, progress: Notes | None = None, jobs: int = 2, **keys: Any) -> Clip:
    """Return ``clip`` as a timeline of ``keys`` plays it; flakes live up to a second."""
    with Workers(jobs) as workers:
        made = arrange(clip, Timeline(**keys), 1.0, workers, progress or Notes())
        # Pictures are read while the workers are there, as in a build.
        frames = [made.read(i) for i in range(made.count)]
    assert all(frame.shape == (clip.height, clip.width, 4) for frame in frames)
    assert all(frame.dtype == np.float32 and np.isfinite(frame).all() for frame in frames)
    return made


def blob(x: float, y: float, size: int = 96, sigma: float = 5.0, light: float = 1.0) -> Pixels:
    """Return a soft orange blob around (x, y) px, in a square frame."""
    at = np.arange(size) + 0.5
    cover = light * np.exp(-((at[None] - x) ** 2 + (at[:, None] - y) ** 2) / (2 * sigma**2))
    colour = np.array([1.0, 0.45, 0.1, 1.0])
    return np.asarray(cover[..., None] * colour, np.float32)


def moving(path: Callable[[int], Place], count: int, fps: float = 24.0, **look: Any) -> Clip:
    """Return a blob that is at ``path(i)`` in frame i."""
    return clip_of([blob(*path(i), **look) for i in range(count)], fps)


def circling(period: float, count: int, fps: float = 24.0) -> Clip:
    """Return a blob that goes round in ``period`` frames."""

    def at(i: int) -> Place:
        turn = 2 * math.pi * i / period
        return 48 + 24 * math.cos(turn), 48 + 24 * math.sin(turn)

    return moving(at, count, fps)


@cache
def turbulent(count: int, seed: int = 1, size: int = 64, fps: float = 24.0) -> Clip:
    """Return smoke-like light that drifts up and changes, and never comes back to itself."""
    chance = np.random.default_rng(seed)
    waves = 24
    kx, ky = chance.integers(-5, 6, waves), chance.integers(1, 6, waves)
    phase, swing = chance.uniform(0, 2 * np.pi, waves), chance.uniform(0.02, 0.12, waves)
    at = 2 * np.pi * np.arange(size) / size
    frames = []
    for i in range(count):
        inside = kx[:, None, None] * at[None, None] + ky[:, None, None] * (at[None, :, None])
        turn = inside + (phase + i * (swing + 0.1 * ky))[:, None, None]
        level = np.cos(turn).sum(axis=0) / math.sqrt(waves / 2)
        cover = 1 / (1 + np.exp(-2.5 * level))
        frames.append(np.asarray(cover[..., None] * np.array([1, 0.4, 0.1, 1]), np.float32))
    return clip_of(frames, fps)


def ramp_fire(
    ramp: Sequence[tuple[float, float, float]], count: int, size: int = 96, steps: int | None = None
) -> Clip:
    """Return turbulent light, hotter towards the bottom, whose colours are on a ramp of its heat.

    Args:
        ramp: Linear colours from cold to hot, evenly spread.
        count: Number of frames.
        size: Side of the frames, px.
        steps: The heat is rounded to this many values, as in flat art; None: it is smooth.
    """
    shape, frames = turbulent(count, size=size), []
    for i in range(count):
        heat = np.clip(1.25 * shape.read(i)[..., 3] * np.linspace(0, 1, size)[:, None], 0, 1)
        if steps:
            heat = np.minimum(np.floor(heat * steps), steps - 1) / (steps - 1)
        at = np.linspace(0, 1, len(ramp))
        colour = [np.interp(heat, at, channel) for channel in zip(*ramp, strict=True)]
        frames.append(np.dstack([*colour, np.clip(3 * heat, 0, 1)]).astype(np.float32))
    return clip_of(frames)


def centre(pixels: Pixels) -> Place:
    """Return the centre of a frame's light, px."""
    cover = pixels[..., 3].astype(np.float64)
    rows, columns = (np.arange(n) + 0.5 for n in cover.shape)
    total = cover.sum()
    return float((cover.sum(axis=0) * columns).sum() / total), float(
        (cover.sum(axis=1) * rows).sum() / total
    )


def steps(clip: Clip) -> NDArray[np.float64]:
    """Return the distance of each frame to the next; in a loop, of the last to the first too."""
    frames = [clip.read(i) for i in range(clip.count)]
    after = [*frames[1:], frames[0]] if clip.loop else frames[1:]
    pairs = zip(frames, after, strict=clip.loop)
    return np.array([np.sqrt(np.mean((a - b) ** 2)) for a, b in pairs])
