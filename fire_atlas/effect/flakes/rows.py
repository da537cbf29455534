"""From flying flakes to what is drawn and written: the rows of the tracks."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.effect.flakes.embers import colour_by_speed, glow, twinkle
from fire_atlas.effect.flakes.emission import TICK, Spawns
from fire_atlas.effect.flakes.flight import Swarm

_BORDER, _FADING = 0.05, 3.0
"""Width of the strip along the border in which flakes fade, heights; for fast ones it is as wide as
their way in so many frames."""

_REACH = 0.25
"""Most of a sprite's half length that counts there, of the frame's shorter side: a large one would
be at the border wherever it is."""

_SHADES = 3
"""Steps in which hard flakes dim."""

_TOGETHER = 4096
"""Flakes that are worth a call; numpy takes as long for a few."""


@dataclass(frozen=True, slots=True)
class Appearance:
    """How flakes look.

    Attributes:
        colours: (stops, 3) linear light by speed, slow to fast.
        intensity: Light of a fresh flake.
        stretch: Length along the velocity, in frames of travel, beside the blur.
        shutter: Part of a frame the shutter is open.
        kappa: (H, W) κ of each pixel: weight of flakes and of their blur.
        fades: Whether flakes fade towards the frame's border.
        pixel: Whether flakes are hard squares.
        fps: Frames per second.
    """

    colours: NDArray[np.float64]
    intensity: float
    stretch: float
    shutter: float
    kappa: Plane
    fades: bool
    pixel: bool
    fps: float


def rows_of(
    swarms: Iterable[Swarm], spawns: Spawns, look: Appearance, workers: Workers
) -> Iterator[NDArray[np.float64]]:
    """Yield one (flakes, 14) table a frame, columns ``tracks.COLUMNS``, made while flakes fly on.

    Velocity is the way to the flake's place in the next frame, so that an engine that moves it
    by ``v / fps`` arrives there; in a flake's last row it is its velocity then.
    """
    moving = (_moving(*pair, look.fps) for pair in pairwise(chain(swarms, [Swarm.empty()])))
    for tables in workers.map(lambda some: _tables(some, spawns, look), _gathered(moving)):
        yield from tables


def _moving(swarm: Swarm, following: Swarm, fps: float) -> Swarm:
    """Return the swarm; its velocity, px/s, leads from each flake's place to the following one."""
    # Both are in order of id: where a flake would be in the following frame, if it is still there.
    there = np.searchsorted(following.id, swarm.id)
    here = np.flatnonzero(np.append(following.id, -1)[there] == swarm.id)
    there = there[here]
    vx, vy = swarm.vx.copy(), swarm.vy.copy()
    vx[here] = (following.x[there] - swarm.x[here]) * fps
    vy[here] = (following.y[there] - swarm.y[here]) * fps
    return replace(swarm, vx=vx, vy=vy)


def _gathered(swarms: Iterable[Swarm]) -> Iterator[list[Swarm]]:
    """Yield the swarms of several frames together, where they are small."""
    some, flakes = list[Swarm](), 0
    for swarm in swarms:
        some.append(swarm)
        flakes += len(swarm.id)
        if flakes >= _TOGETHER:
            yield some
            some, flakes = [], 0
    if some:
        yield some


def _tables(swarms: list[Swarm], spawns: Spawns, look: Appearance) -> list[NDArray[np.float64]]:
    """One frame's rows for each of the swarms."""
    ends = np.cumsum([len(swarm.id) for swarm in swarms])
    return np.split(_table(Swarm.joined(swarms), spawns, look), ends[:-1])


def _table(swarm: Swarm, spawns: Spawns, look: Appearance) -> NDArray[np.float64]:
    """Rows of flakes: a streak is straight along the velocity, x(t) + (δ − t) v κ (eq. 17)."""
    speed = np.hypot(swarm.vx, swarm.vy)
    life, wide = spawns.life.take(swarm.id), spawns.size.take(swarm.id)
    size = drawn_width(wide, look.pixel)
    height, width = look.kappa.shape
    weight = look.kappa[
        np.clip(swarm.y.astype(np.intp), 0, height - 1),
        np.clip(swarm.x.astype(np.intp), 0, width - 1),
    ]
    streak = speed / look.fps * (look.stretch + look.shutter * weight)
    stretch = 1 + streak / size
    light = glow(swarm.age, life) * twinkle(
        swarm.age, spawns.twinkle.take(swarm.id), spawns.phase.take(swarm.id)
    )
    colour = colour_by_speed(swarm.pace, height, look.colours) * look.intensity
    if look.pixel:
        stretch = np.ones_like(size)
        opacity = np.ceil(light * _SHADES) / _SHADES
    else:
        # The same light over more pixels where fast sprites are drawn out. Small ones are widened
        # and keep some of their brightness, or nobody would see them.
        opacity = light * weight * wide / size / stretch
    if look.fades:
        opacity = opacity * _inside(swarm, size * stretch / 2, speed / look.fps, height, width)
    # A column lies in one piece: whoever reads the table reads columns.
    return np.stack([
        swarm.id, swarm.x, swarm.y, swarm.vx, swarm.vy, size, stretch,
        np.arctan2(swarm.vy, swarm.vx), *colour, opacity, swarm.age, life,
    ]).T  # fmt: skip


def _inside(
    swarm: Swarm,
    reach: NDArray[np.float64],
    way: NDArray[np.float64],
    height: int,
    width: int,
) -> NDArray[np.float64]:
    """How far sprites that ``reach`` so many px, on their ``way`` of px a frame, are from the
    border: 0 at it, 1 beyond the strip along it."""
    gap = np.minimum.reduce([swarm.x, swarm.y, width - swarm.x, height - swarm.y])
    gap -= np.minimum(reach, _REACH * min(height, width))
    return smooth_step(np.asarray(gap / np.maximum(way * _FADING, _BORDER * height), np.float64))


def spawn_table(swarms: list[Swarm], spawns: Spawns, hard: bool) -> NDArray[np.float64]:
    """Return the (flakes, 9) births of all flakes that are ever seen; ``tracks.SPAWN_COLUMNS``.

    ``hard``: whether they are drawn as squares.
    """
    order = np.concatenate([swarm.id for swarm in swarms])
    seen, first = np.unique(order, return_index=True)
    vx, vy = (np.concatenate([getattr(s, name) for s in swarms])[first] for name in ("vx", "vy"))
    return np.column_stack([
        seen, spawns.tick[seen] * TICK, spawns.life[seen], spawns.x[seen], spawns.y[seen], vx, vy,
        drawn_width(spawns.size[seen], hard), np.zeros(len(seen)),
    ])  # fmt: skip
