"""A calm candle flame: one teardrop on a wick that sways and breathes once per loop.

Lengths are in pixels of a ``SIZE`` frame, heights above the foot of the flame, time in loops.
Images are float RGBA, 0-255, colours multiplied by opacity, shape ``(height, width, 4)``.
"""

from __future__ import annotations

import numpy as np
from painting import Field, Pixels, fire_colours, layer_over, soft_step, straight

SIZE = (192, 96)  #: height, width
FOOT = 178.0  #: row the flame stands on
TALL = 102.0  #: height of the flame at rest
HALF_WIDTH = 15.5  #: of the flame where it is widest
WICK = (-9.0, 15.0)  #: heights of its two ends
BLUE = (48, 96, 255)
SOOT = (44, 30, 26)
EMBER = (255, 118, 40)
TAU = 2 * np.pi


def tall_at(time: float) -> float:
    """Height of the flame, which breathes."""
    return float(TALL * (1 + 0.035 * np.sin(TAU * time) + 0.018 * np.sin(TAU * (2 * time + 0.2))))


def spine(share: Field, time: float) -> Field:
    """Offset right of the middle at ``share`` of the height; the sway climbs the flame."""
    slow = 6.0 * np.sin(TAU * (time - 0.42 * share))
    quick = 1.6 * np.sin(TAU * (2 * time - 0.8 * share + 0.3))
    return np.asarray((slow + quick) * share**1.6, dtype=np.float32)


def teardrop(share: Field, time: float) -> Field:
    """Half the width at ``share`` of the height: round below, drawn out to a point above."""
    inside = np.clip(share, 0, 1)
    profile = 2.83 * inside**0.52 * (1 - inside) ** 1.22
    breath = 1 - 0.03 * np.sin(TAU * (time - 0.3 * inside))
    return np.asarray(HALF_WIDTH * profile * breath, dtype=np.float32)


def burning(share: Field, across: Field) -> Field:
    """Fire level in [0, 1]: dark about the wick, white-yellow above it, orange rim and tip."""
    vault = share - 0.13 * (1 - across**2)
    lit = soft_step(0.02, 0.32, vault)
    core = np.clip(1 - across**2, 0, 1) ** 0.55
    tip = 1 - 0.5 * soft_step(0.55, 1.0, share)
    return np.asarray((0.30 + 0.70 * lit) * (0.48 + 0.56 * core * tip), dtype=np.float32)


def flame_layer(x: Field, height: Field, time: float) -> Field:
    """The luminous body and, under it, the blue cup at its foot."""
    share = height / np.float32(tall_at(time))
    reach = teardrop(share, time)
    offset = np.abs(x - spine(np.clip(share, 0, 1.1), time))
    across = np.clip(offset / np.maximum(reach, 0.5), 0, 1)
    inside = soft_step(-1.6, 1.6, reach - offset) * soft_step(-0.02, 0.015, share)
    inside *= 1 - soft_step(0.9, 1.0, share)
    cup = (1 - soft_step(0.0, 0.30, share)) * (0.34 + 0.5 * across**2) * inside
    image = layer_over(np.zeros((*x.shape, 4), np.float32), BLUE, cup)
    colours = fire_colours(burning(share, across))
    rising = soft_step(0.02, 0.26, share + 0.05 * across)
    cover = colours[..., 3] / 255 * inside * (0.08 + 0.92 * rising)
    return layer_over(image, colours[..., :3], cover.astype(np.float32))


def with_wick(image: Field, x: Field, height: Field, time: float) -> Field:
    """``image`` with the bent wick in front, its tip an ember that pulses with the breath."""
    low, high = WICK
    bend = 2.6 * np.clip((height - 4) / (high - 4), 0, 1.2) ** 2
    along = np.clip(height, low + 1.6, high - 1.4)
    thick = np.interp(height, [low, high], [2.1, 1.5])
    cover = np.clip(thick + 0.5 - np.hypot(x - bend, height - along), 0, 1).astype(np.float32)
    hot = soft_step(high - 7, high, height) * np.float32(0.85 + 0.15 * np.sin(TAU * time))
    colour = np.array(SOOT) + hot[..., None] * (np.array(EMBER) - np.array(SOOT))
    return layer_over(image, colour, cover)


def candle_frames(count: int = 32) -> list[Pixels]:
    """One loop of the candle, straight-alpha RGBA frames of ``SIZE``."""
    rows, columns = np.mgrid[0 : SIZE[0], 0 : SIZE[1]].astype(np.float32) + np.float32(0.5)
    x, height = columns - SIZE[1] / 2, np.float32(FOOT) - rows
    times = [number / count for number in range(count)]
    return [straight(with_wick(flame_layer(x, height, t), x, height, t)) for t in times]
