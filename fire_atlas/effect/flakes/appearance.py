"""Appearance: size, streak, colour and opacity of flying flakes, as rows of the tracks.

Embers cool, dim and flicker; their colour follows their speed (Figure 9), their streaks eq. 17.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.effect.flakes.emission import TICK, Spawns
from fire_atlas.effect.flakes.flight import ParticleState

HOTTEST, COOLEST = 1600.0, 980.0
"""Temperature, K, of a new ember, and of one that has become invisible."""

_WIEN = 23930.0
"""Luminance is proportional to exp(−_WIEN / T): × 7,900 from 1000 K to 1600 K."""

_CONTRAST = 0.32
"""Exponent of the luminance, which compresses its range as an eye or a film would."""

_FADE_IN = 0.05
"""Time a new ember takes to reach full light, s."""

_FLICKER_DEPTH = 0.4
"""Maximum fraction of its light that an ember loses by flicker."""

_FULL_SPEED = 0.9
"""Speed, heights/s, at which a flake has the last of the colours."""

_BORDER, _BORDER_FRAMES = 0.05, 3.0
"""Flakes fade in a strip along the frame's border. It is the larger of this many heights and the
distance that the flake travels in this many frames."""

_MAX_HALF_LENGTH = 0.25
"""Limit on a sprite's half length in the border fade, as a fraction of the frame's shorter side: a
larger sprite would be at the border wherever it is."""

_PIXEL_SHADES = 3
"""Number of brightness steps of hard flakes."""

_BATCH = 4096
"""Minimum number of flakes per numpy call: a call for only a few takes as long."""


@dataclass(frozen=True, slots=True)
class Appearance:
    """How the flakes of a recipe look.

    Attributes:
        colours: (stops, 3) linear light by speed, slow to fast.
        intensity: Light of a new flake.
        stretch: Streak length besides motion blur, in frames of travel.
        shutter: Fraction of a frame during which the shutter is open.
        kappa: (H, W) κ of each pixel, a factor of a flake's light and of its blur (eq. 17).
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


def track_rows(
    states: Iterable[ParticleState], spawns: Spawns, look: Appearance, workers: Workers
) -> Iterator[NDArray[np.float64]]:
    """Yield one (flakes, 14) table per frame, columns ``tracks.COLUMNS``, while the flight goes on.

    A row's velocity leads to the flake's place in the next frame, so that an engine that moves it
    by ``v / fps`` arrives there; in a flake's last row it is the simulated velocity.
    """
    moving = (
        _with_frame_velocity(*pair, look.fps)
        for pair in pairwise(chain(states, [ParticleState.empty()]))
    )
    for tables in workers.map(lambda batch: _tables(batch, spawns, look), _batches(moving)):
        yield from tables


def _with_frame_velocity(
    state: ParticleState, following: ParticleState, fps: float
) -> ParticleState:
    """Return the state of a frame, velocities (px/s) leading to the places of the following one."""
    # Both are sorted by id: find where each flake would be in the following frame's arrays.
    there = np.searchsorted(following.id, state.id)
    here = np.flatnonzero(np.append(following.id, -1)[there] == state.id)
    there = there[here]
    vx, vy = state.vx.copy(), state.vy.copy()
    vx[here] = (following.x[there] - state.x[here]) * fps
    vy[here] = (following.y[there] - state.y[here]) * fps
    return replace(state, vx=vx, vy=vy)


def _batches(states: Iterable[ParticleState]) -> Iterator[list[ParticleState]]:
    """Yield the states in groups of successive frames, each of ``_BATCH`` flakes or more."""
    batch, flakes = list[ParticleState](), 0
    for state in states:
        batch.append(state)
        flakes += len(state.id)
        if flakes >= _BATCH:
            yield batch
            batch, flakes = [], 0
    if batch:
        yield batch


def _tables(
    states: list[ParticleState], spawns: Spawns, look: Appearance
) -> list[NDArray[np.float64]]:
    """Return the table of rows of each state."""
    ends = np.cumsum([len(state.id) for state in states])
    return np.split(_table(ParticleState.concatenate(states), spawns, look), ends[:-1])


def _table(state: ParticleState, spawns: Spawns, look: Appearance) -> NDArray[np.float64]:
    """Return the rows of flakes; their streaks follow x(δ) = x(t) + (δ − t) v κ (eq. 17)."""
    speed = np.hypot(state.vx, state.vy)
    life, full_size = spawns.life.take(state.id), spawns.size.take(state.id)
    size = drawn_width(full_size, look.pixel)
    height, width = look.kappa.shape
    weight = look.kappa[
        np.clip(state.y.astype(np.intp), 0, height - 1),
        np.clip(state.x.astype(np.intp), 0, width - 1),
    ]
    streak = speed / look.fps * (look.stretch + look.shutter * weight)
    stretch = 1 + streak / size
    light = ember_light(state.age, life) * ember_flicker(
        state.age, spawns.flicker_rate.take(state.id), spawns.flicker_phase.take(state.id)
    )
    colour = colour_by_speed(state.smoothed_speed, height, look.colours) * look.intensity
    if look.pixel:
        stretch = np.ones_like(size)
        opacity = np.ceil(light * _PIXEL_SHADES) / _PIXEL_SHADES
    else:
        # A streak spreads the same light over more pixels. A small flake, drawn wider in both axes,
        # is dimmed for one only: else it would be invisible.
        opacity = light * weight * full_size / size / stretch
    if look.fades:
        opacity = opacity * _border_fade(state, size * stretch / 2, speed / look.fps, height, width)
    # Each column is contiguous in memory, because tables are read by column.
    return np.stack([
        state.id, state.x, state.y, state.vx, state.vy, size, stretch,
        np.arctan2(state.vy, state.vx), *colour, opacity, state.age, life,
    ]).T  # fmt: skip


def _border_fade(
    state: ParticleState,
    half_length: NDArray[np.float64],
    travel: NDArray[np.float64],
    height: int,
    width: int,
) -> NDArray[np.float64]:
    """Factor by which sprites fade near the frame's border: 0 at the border, 1 inside the strip.

    Sprites extend ``half_length`` px from their centre and move ``travel`` px per frame.
    """
    gap = np.minimum.reduce([state.x, state.y, width - state.x, height - state.y])
    gap -= np.minimum(half_length, _MAX_HALF_LENGTH * min(height, width))
    strip = np.maximum(travel * _BORDER_FRAMES, _BORDER * height)
    return smooth_step(np.asarray(gap / strip, np.float64))


def temperature(age_share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Temperature, K, of embers that have lived ``age_share`` (0..1) of their lifetime.

    Radiation cools hot embers faster than dim ones.
    """
    return COOLEST + (HOTTEST - COOLEST) * (1 - np.clip(age_share, 0, 1)) ** 1.4


def ember_light(age: NDArray[np.float64], life: NDArray[np.float64]) -> NDArray[np.float64]:
    """Light, 0..1, of embers ``age`` s old that live ``life`` s: falls to 0 as they cool."""
    strength = _WIEN * _CONTRAST
    heat = np.exp(strength * (1 / HOTTEST - 1 / temperature(age / life)))
    dullest = math.exp(strength * (1 / HOTTEST - 1 / COOLEST))
    lit = np.minimum(age / _FADE_IN, 1.0)
    return np.maximum(heat - dullest, 0.0) / (1 - dullest) * lit


def ember_flicker(
    age: NDArray[np.float64], rate: NDArray[np.float64], phase: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Factor, at most 1, by which flicker dims embers; ``age`` in s, ``rate`` Hz, ``phase`` rad."""
    return 1 - _FLICKER_DEPTH * (0.5 - 0.5 * np.sin(2 * np.pi * rate * age + phase))


def colour_by_speed(
    speed: NDArray[np.float64], height: int, stops: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Colour (3, flakes), linear light, of flakes at ``speed`` px/s in frames of ``height`` px."""
    at = np.clip(speed / (_FULL_SPEED * height), 0, 1) * (len(stops) - 1)
    known = np.arange(len(stops))
    return np.stack([np.interp(at, known, stops[:, c]) for c in range(3)])


def spawn_table(states: list[ParticleState], spawns: Spawns, hard: bool) -> NDArray[np.float64]:
    """Return the spawn data of all flakes ever seen, (flakes, 9): ``tracks.SPAWN_COLUMNS``.

    ``hard``: whether they are drawn as hard squares.
    """
    order = np.concatenate([state.id for state in states])
    seen, first = np.unique(order, return_index=True)
    vx, vy = (np.concatenate([getattr(s, name) for s in states])[first] for name in ("vx", "vy"))
    return np.column_stack([
        seen, spawns.tick[seen] * TICK, spawns.life[seen], spawns.x[seen], spawns.y[seen], vx, vy,
        drawn_width(spawns.size[seen], hard), np.zeros(len(seen)),
    ])  # fmt: skip
