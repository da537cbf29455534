"""From flying flakes to what is drawn and written: the rows of the tracks."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane
from fire_atlas.core.workers import Workers
from fire_atlas.flakes.drawing import SMALLEST
from fire_atlas.flakes.embers import colour_by_speed, glow, twinkle
from fire_atlas.flakes.emission import TICK, Spawns
from fire_atlas.flakes.flight import Swarm

_BORDER = 0.05
"""Width of the strip along the border in which flakes fade, heights."""

_SHADES = 3
"""Steps in which hard flakes dim."""


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
    pairs = pairwise(chain(swarms, [Swarm.empty()]))
    return workers.map(
        lambda pair: _table(pair[0], *_velocity(*pair, look.fps), spawns, look), pairs
    )


def _velocity(
    swarm: Swarm, following: Swarm, fps: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity, px/s, from each flake's place to that in the following frame."""
    _, here, there = np.intersect1d(swarm.id, following.id, assume_unique=True, return_indices=True)
    vx, vy = swarm.vx.copy(), swarm.vy.copy()
    vx[here] = (following.x[there] - swarm.x[here]) * fps
    vy[here] = (following.y[there] - swarm.y[here]) * fps
    return vx, vy


def _table(
    swarm: Swarm,
    vx: NDArray[np.float64],
    vy: NDArray[np.float64],
    spawns: Spawns,
    look: Appearance,
) -> NDArray[np.float64]:
    """One frame's rows: a streak is straight along the velocity, x(t) + (δ − t) v κ (eq. 17)."""
    speed = np.hypot(vx, vy)
    life, wide = spawns.life[swarm.id], spawns.size[swarm.id]
    size = np.clip(np.rint(wide), 1, 2) if look.pixel else np.maximum(wide, SMALLEST)
    height, width = look.kappa.shape
    weight = look.kappa[
        np.clip(swarm.y.astype(np.intp), 0, height - 1),
        np.clip(swarm.x.astype(np.intp), 0, width - 1),
    ]
    streak = speed / look.fps * (look.stretch + look.shutter * weight)
    stretch = 1 + streak / size
    light = glow(swarm.age, life) * twinkle(
        swarm.age, spawns.twinkle[swarm.id], spawns.phase[swarm.id]
    )
    colour = colour_by_speed(speed, height, look.colours) * look.intensity
    if look.pixel:
        stretch = np.ones_like(size)
        opacity = np.ceil(light * _SHADES) / _SHADES
    else:
        # The same light over more pixels: small sprites are widened, fast ones drawn out.
        opacity = light * weight * (wide / size) ** 2 / stretch
    if look.fades:
        opacity = opacity * _inside(swarm, size * stretch / 2, height, width)
    return np.column_stack([
        swarm.id, swarm.x, swarm.y, vx, vy, size, stretch, np.arctan2(vy, vx), colour, opacity,
        swarm.age, life,
    ])  # fmt: skip


def _inside(
    swarm: Swarm, reach: NDArray[np.float64], height: int, width: int
) -> NDArray[np.float64]:
    """How far sprites that ``reach`` so many px are from the border: 0 at it, 1 from ``_BORDER``
    on."""
    gap = np.minimum.reduce([swarm.x, swarm.y, width - swarm.x, height - swarm.y]) - reach
    return smooth_step(np.asarray(gap / (_BORDER * height), np.float64))


def spawn_table(swarms: list[Swarm], spawns: Spawns) -> NDArray[np.float64]:
    """Return the (flakes, 9) births of all flakes that are ever seen; ``tracks.SPAWN_COLUMNS``."""
    order = np.concatenate([swarm.id for swarm in swarms])
    seen, first = np.unique(order, return_index=True)
    vx, vy = (np.concatenate([getattr(s, name) for s in swarms])[first] for name in ("vx", "vy"))
    return np.column_stack([
        seen, spawns.tick[seen] * TICK, spawns.life[seen], spawns.x[seen], spawns.y[seen], vx, vy,
        np.maximum(spawns.size[seen], SMALLEST), np.zeros(len(seen)),
    ])  # fmt: skip
