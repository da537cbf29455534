"""Regenerate the sample clips of fire-atlas: ``python samples/make_samples.py [OUT_DIR]``.

The same bytes on every run: seeded Philox generators, no clock, nothing copied from elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from candle import candle_frames
from cartoon import cartoon_frames
from explosion import explosion_frames
from painting import (
    brighter,
    exposure,
    fire_palette,
    over_black,
    quantise,
    save_frames,
    save_gif,
    save_painted,
    save_sheet,
    soft_step,
    wood_palette,
)
from pixel_flame import pixel_frames
from simulation import Burner, Field, burn_loop, finer

DETAIL = 1.5  #: grid cells per pixel of a frame
HERE = Path(__file__).resolve().parent

CAMPFIRE = Burner(
    size=(320, 256),
    frames=48,
    seed=9,
    base=285,
    half_width=60,
    depth=15,
    life=50,
    draught=2.6,
    inflow=0.005,
    buoyancy=0.28,
    drag=0.04,
    swelling=0.1,
    turbulence=0.14,
    confinement=0.02,
    tongues=(18.0, 60.0),
)
TORCH = Burner(
    size=(240, 160),
    frames=32,
    seed=15,
    base=172,
    half_width=18,
    depth=9,
    life=43,
    draught=2.2,
    sway=3.0,
    inflow=0.01,
    buoyancy=0.2,
    drag=0.04,
    swelling=0.08,
    turbulence=0.08,
    confinement=0.02,
    eddies=(20.0, 70.0),
    tongues=(12.0, 40.0),
)
FIREBALL = Burner(
    size=(256, 160),
    frames=24,
    seed=15,
    base=210,
    half_width=27,
    depth=27,
    life=32,
    draught=5.5,
    inflow=0.012,
    buoyancy=0.0,
    drag=0.03,
    swelling=0.03,
    turbulence=0.26,
    confinement=0.02,
    eddies=(17.0, 55.0),
    tongues=(18.0, 50.0),
)


class Slice(NamedTuple):
    """One of the thin flames that, behind one another, make a deep one."""

    weight: float  #: brightness
    width: float  #: relative to the burner's
    flicker: float  #: how far its fuel supply varies
    offset: float = 0.0  #: of its burner to the right, pixels
    life: float = 1.0  #: relative to the burner's


CAMPFIRE_SLICES = (
    Slice(0.9, 1.0, 0.7),
    Slice(0.9, 0.7, 1.5, -16.0),
    Slice(0.8, 0.65, 1.7, 16.0),
    Slice(0.7, 0.85, 0.6, 0.0, 0.4),
)
TORCH_SLICES = (Slice(1.0, 1.0, 0.4), Slice(0.8, 0.8, 1.0))
FIREBALL_SLICES = (Slice(1.0, 1.0, 0.3), Slice(0.8, 0.8, 0.6))


def glow(fuel: Field) -> Field:
    """Light from a slice of flame: a sharp-edged sheet of soot, hotter where fuel is plenty."""
    return soft_step(0.05, 0.17, fuel) * (0.34 + 1.6 * fuel**1.8)


def stacked(burner: Burner, slices: Sequence[Slice]) -> Field:
    """Light of thin flames behind one another, shape (frames, height, width)."""
    light = np.zeros((burner.frames, *burner.size), np.float32)
    for number, piece in enumerate(slices):
        part = replace(
            burner,
            seed=burner.seed + number,
            half_width=burner.half_width * piece.width,
            flicker=piece.flicker,
            offset=piece.offset,
            life=burner.life * piece.life,
        )
        for frame, fuel in zip(light, burn_loop(finer(part, DETAIL)), strict=True):
            frame += piece.weight * cv2.resize(
                glow(fuel), frame.shape[::-1], interpolation=cv2.INTER_AREA
            )
    return light


def torch_head(height: int, width: int) -> Field:
    """Shade in [0, 1] of a round, rag-wrapped torch head on its stick, lit from above."""
    fine = 4
    grid = (np.mgrid[0 : height * fine, 0 : width * fine].astype(np.float32) + 0.5) / fine
    x, y = grid[1] - width / 2, grid[0] - TORCH.base
    bowl = np.interp(y, [1, 5, 14, 26, 27], [13, 15, 14, 8, 0])
    stick = np.interp(y, [22, 58, 60], [5.2, 4.0, 0]) * (y < 60)
    reach = np.where((y > 1) & (y < 27), np.maximum(bowl, stick), stick)
    across = x / np.maximum(reach, 1e-3)
    inside = (np.abs(across) < 1) & (y > 1)
    round_off = np.sqrt(np.clip(1 - across**2, 0, 1))
    wraps = 0.72 + 0.28 * np.abs(np.sin((y + 0.35 * x - 3 * round_off) * (np.pi / 6.5)))
    wraps = np.where(y < 26, wraps, 0.9)
    lit = 0.16 + 0.84 * np.exp(-np.clip(y, 0, None) / 15)
    shade = np.where(inside, (0.25 + 0.75 * round_off) * wraps * lit, 0).astype(np.float32)
    return np.asarray(cv2.resize(shade, (width, height), interpolation=cv2.INTER_AREA))


def make_campfire(folder: Path) -> None:
    """48 transparent frames of a campfire at 24 fps."""
    light = stacked(CAMPFIRE, CAMPFIRE_SLICES)
    save_frames(folder, [quantise(exposure(f, 0.7)) for f in light], fire_palette())


def make_torch(path: Path) -> None:
    """32 frames of a torch on black at 20 fps, one GIF."""
    light = stacked(TORCH, TORCH_SLICES)
    flame_colours, wood_colours = over_black(fire_palette(224)), wood_palette(32)
    wood = quantise(torch_head(*TORCH.size), 32)
    frames = [
        brighter(quantise(exposure(f, 0.9), 224), flame_colours, wood, wood_colours) for f in light
    ]
    save_gif(path, frames, np.vstack([flame_colours, wood_colours]), fps=20)


def make_fireball(folder: Path) -> None:
    """24 transparent frames of a fireball flying to the right at 24 fps."""
    light = stacked(FIREBALL, FIREBALL_SLICES)
    frames = [quantise(exposure(np.rot90(f).copy(), 1.2)) for f in light]
    save_frames(folder, frames, fire_palette())


def make_all(out: Path) -> None:
    """Write every sample below ``out``."""
    cv2.setNumThreads(1)
    out.mkdir(parents=True, exist_ok=True)
    make_campfire(out / "campfire")
    make_torch(out / "torch.gif")
    save_sheet(out / "cartoon_flame.png", cartoon_frames(), columns=6)
    make_fireball(out / "fireball")
    save_painted(out / "candle", candle_frames())
    save_painted(out / "explosion", explosion_frames())
    save_sheet(out / "pixel_flame.png", pixel_frames(), columns=8)


if __name__ == "__main__":
    make_all(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
