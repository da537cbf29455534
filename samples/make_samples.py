"""Make the samples of fire-atlas again: ``python samples/make_samples.py [OUT_DIR [NAME...]]``.

The same on every run: seeded Philox generators, no clock, nothing copied from elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from candle import candle_frames
from cartoon import cartoon_frames
from explosion import explosion_frames
from painting import (
    exposure,
    fire_palette,
    over_black,
    quantise,
    save_frames,
    save_gif,
    save_painted,
    save_sheet,
    soft_step,
)
from pixel_flame import pixel_frames
from simulation import Burner, Field, LoopNoise, burn_loop, finer

DETAIL = 1.5  #: grid cells per pixel of a frame
LEVELS = 128  #: colours of a palette: fewer bytes than with 256, and no step to be seen
HERE = Path(__file__).resolve().parent

CAMPFIRE = Burner(
    size=(320, 256),
    frames=48,
    seed=9,
    base=285,
    half_width=60,
    depth=22,
    life=54,
    draught=3.0,
    inflow=0.005,
    buoyancy=0.55,
    drag=0.04,
    swelling=0.1,
    turbulence=0.11,
    confinement=0.05,
    eddies=(14.0, 80.0),
    tongues=(8.0, 50.0),
)
TORCH = Burner(
    size=(240, 160),
    frames=32,
    seed=4,
    base=210,
    half_width=24,
    depth=13,
    life=56,
    thinning=5.0,
    draught=3.2,
    sway=2.8,
    inflow=0.013,
    buoyancy=0.35,
    drag=0.07,
    swelling=0.06,
    flicker=0.9,
    turbulence=0.2,
    confinement=0.04,
    eddies=(14.0, 66.0),
    steepest=0.4,
    tongues=(14.0, 50.0),
    ragged=0.25,
)
FIREBALL = Burner(
    size=(256, 160),
    frames=24,
    seed=15,
    base=210,
    half_width=30,
    depth=33,
    life=38,
    thinning=6.0,
    draught=4.2,
    inflow=0.012,
    buoyancy=0.0,
    drag=0.03,
    swelling=0.03,
    turbulence=0.18,
    confinement=0.05,
    eddies=(9.0, 50.0),
    tongues=(12.0, 40.0),
    ragged=0.8,
)


class Slice(NamedTuple):
    """One of the thin flames that, behind one another, make a deep one."""

    weight: float  #: brightness
    width: float  #: relative to the burner's
    flicker: float  #: how far its fuel supply varies
    offset: float = 0.0  #: of its burner to the right, pixels
    life: float = 1.0  #: relative to the burner's
    jets: int = 0  #: places along its bed where fuel comes out; 0: all over it


CAMPFIRE_SLICES = (
    Slice(0.45, 0.95, 0.6, life=0.38),
    Slice(0.5, 0.8, 0.95, life=0.65),
    Slice(0.75, 1.0, 1.1, jets=7),
    Slice(0.65, 0.7, 1.1, -12.0, jets=5),
)
TORCH_SLICES = (
    Slice(0.75, 0.85, 0.8, -1.7),
    Slice(0.7, 0.72, 0.9, -1.0, jets=5),
    Slice(0.7, 0.75, 1.0, -4.25, 0.85),
    Slice(0.6, 0.65, 1.0, 5.1, 0.8),
)
#: The narrower, the shorter they burn: hottest in the middle of the head.
FIREBALL_SLICES = (
    Slice(0.65, 1.0, 0.5),
    Slice(0.5, 0.85, 0.8),
    Slice(0.5, 0.7, 0.4, life=0.6),
    Slice(1.1, 0.5, 0.2, life=0.35),
)


def glow(fuel: Field, hollow: float) -> Field:
    """Light from a slice of flame: a sharp-edged sheet of soot, hotter where fuel is plenty.

    Fuel that has just come out burns at its edges only: a share ``hollow`` of its light is
    missing, so that feet are dim inside.
    """
    hot = 0.2 + 2.2 * fuel**1.5
    light = soft_step(0.04, 0.2, fuel) * hot * (1 - hollow * soft_step(0.6, 1.0, fuel))
    return np.asarray(light, dtype=np.float32)


def stacked(burner: Burner, slices: Sequence[Slice], hollow: float = 0.6) -> Field:
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
            jets=piece.jets,
        )
        for frame, fuel in zip(light, burn_loop(finer(part, DETAIL)), strict=True):
            frame += piece.weight * cv2.resize(
                glow(fuel, hollow), frame.shape[::-1], interpolation=cv2.INTER_AREA
            )
    return light


def coals(burner: Burner) -> Field:
    """Light of the glowing bed that the flames stand in, shape (frames, height, width).

    Coals of unlike heat, which swells and fades slowly.
    """
    height, width = burner.size
    rng = np.random.Generator(np.random.Philox(burner.seed + 2000))
    still = LoopNoise.draw(rng, (5.0, 18.0), burner.frames, 0.0, 36).sample(height, width, 0)
    slow = LoopNoise.draw(rng, (14.0, 60.0), burner.frames, 0.0, 36)
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
    x = (columns - (width - 1) / 2) / (1.05 * burner.half_width)
    y = (rows - burner.base - 0.5 * burner.depth) / (0.75 * burner.depth)
    bed = soft_step(0.0, 0.6, np.clip(1 - np.hypot(x, y), 0, 1))
    hot = np.clip(0.45 + 0.55 * still, 0, 1.1) ** 1.5
    light = [
        bed * (0.08 + hot * np.clip(0.6 + 0.3 * slow.sample(height, width, frame), 0.1, 1.2))
        for frame in range(burner.frames)
    ]
    return np.asarray(light, dtype=np.float32)


def make_campfire(folder: Path) -> None:
    """48 transparent frames of a campfire at 24 fps."""
    light = stacked(CAMPFIRE, CAMPFIRE_SLICES) + coals(CAMPFIRE)
    save_frames(folder, [quantise(exposure(f, 0.8), LEVELS) for f in light], fire_palette(LEVELS))


def make_torch(path: Path) -> None:
    """32 frames of a torch's flame on black at 20 fps, one GIF."""
    light = stacked(TORCH, TORCH_SLICES, 0.2)
    frames = [quantise(exposure(f, 1.0), LEVELS) for f in light]
    save_gif(path, frames, over_black(fire_palette(LEVELS)), fps=20)


def make_fireball(folder: Path) -> None:
    """24 transparent frames of a fireball flying to the right at 24 fps."""
    light = stacked(FIREBALL, FIREBALL_SLICES, 0.0)
    frames = [quantise(exposure(np.rot90(f).copy(), 0.75), LEVELS) for f in light]
    save_frames(folder, frames, fire_palette(LEVELS))


#: What makes each sample, by the name it has in the folder of samples.
MAKERS: dict[str, Callable[[Path], None]] = {
    "campfire": make_campfire,
    "torch.gif": make_torch,
    "cartoon_flame.png": lambda path: save_sheet(path, cartoon_frames(), columns=6),
    "fireball": make_fireball,
    "candle": lambda path: save_painted(path, candle_frames()),
    "explosion": lambda path: save_painted(path, explosion_frames()),
    "pixel_flame.png": lambda path: save_sheet(path, pixel_frames(), columns=8),
}


def make(out: Path, names: Sequence[str]) -> None:
    """Write the samples ``names`` below ``out``."""
    cv2.setNumThreads(1)
    out.mkdir(parents=True, exist_ok=True)
    for name in names:
        MAKERS[name](out / name)


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE, sys.argv[2:] or list(MAKERS))
