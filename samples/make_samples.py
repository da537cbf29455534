"""Make the samples of fire-atlas again: ``python samples/make_samples.py [OUT_DIR [NAME...]]``.

The same on every run: seeded Philox generators, no clock, nothing copied from elsewhere.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from candle import candle_frames
from cartoon import cartoon_frames
from crate import crate
from explosion import explosion_frames
from noise import Field, LoopNoise
from painting import (
    Pixels,
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
from simulation import Burner, Jet, Physics, burn_loop

LEVELS = 128  #: colours of a palette: fewer bytes than with 256, and no step to be seen
HERE = Path(__file__).resolve().parent


def bed(
    seed: int, count: int, base: float, spread: float, radii: tuple[float, float], uneven: float
) -> list[Jet]:
    """Jets among the logs of a fire, at golden angles about the middle of row ``base``.

    Smaller, weaker and lower the further out; up to ``uneven`` pixels above the row.
    """
    rng = np.random.Generator(np.random.Philox(seed))
    jets = []
    for number in range(count):
        out = np.sqrt((number + 0.5) / count)
        angle = 2.4 * number + rng.uniform(-0.4, 0.4)
        lift = uneven * rng.uniform(-0.1, 1) * (1 - 0.6 * out)
        jets.append(
            Jet(
                right=spread * out * np.cos(angle),
                down=base - lift,
                away=0.8 * spread * out * np.sin(angle),
                radius=rng.uniform(*radii) * (1.2 - 0.5 * out),
                strength=rng.uniform(0.8, 1) * (1 - 0.2 * out),
            )
        )
    return jets


def ball(seed: int, count: int, base: float, reach: float, radii: tuple[float, float]) -> list[Jet]:
    """Jets that make a lumpy ball about the middle of row ``base``."""
    rng = np.random.Generator(np.random.Philox(seed))
    jets = [Jet(0, base, 0, 1.5 * radii[1], flat=1)]
    for way in rng.normal(size=(count, 3)):
        right, down, away = reach * way / np.linalg.norm(way)
        jets.append(Jet(right, base + down, away, rng.uniform(*radii), rng.uniform(0.8, 1), 1))
    return jets


CAMPFIRE = Burner(
    size=(200, 320, 256),
    frames=48,
    seed=9,
    base=285,
    jets=bed(2, 14, 285, 68, (20, 30), 16),
    ragged=0.5,
    gust=1.5,
    inflow=0.012,
    draught=2.0,
    physics=Physics(life=34, lift=0.5),
)
TORCH = Burner(
    size=(120, 240, 160),
    cell=1.5,
    frames=32,
    seed=4,
    base=210,
    jets=bed(6, 6, 208, 10, (18, 22), 8),
    ragged=0.5,
    pulse=0.35,
    draught=3.0,
    gust=6.0,
    inflow=0.012,
    closing=20,
    physics=Physics(life=44, lift=0.4),
)
FIREBALL = Burner(
    size=(140, 256, 160),
    cell=1.5,
    frames=24,
    seed=15,
    base=210,
    jets=ball(3, 7, 208, 16, (13, 20)),
    ragged=0.7,
    speed=3.0,
    wander=0.7,
    draught=4.5,
    gust=0.8,
    inflow=0.008,
    closing=12,
    physics=Physics(life=42, lift=0, thinning=3, swelling=0.5, confinement=0.6),
)


def glow(fuel: Field, hollow: float) -> Field:
    """Light of flame half a cube deep, per pixel of the cube's width, of its fuel in [0, 1].

    It is a sheet of soot with sharp edges, brighter where there is more fuel.

    Fuel that has just come out burns at its edges only: a share ``hollow`` of its light is
    missing, so that the foot of a flame is dim inside.
    """
    hot = 0.006 + 0.2 * fuel**2.2
    light = soft_step(0.04, 0.2, fuel) * hot * (1 - hollow * soft_step(0.6, 1.0, fuel))
    return np.asarray(light, dtype=np.float32)


def front_view(fuel: Field, burner: Burner, hollow: float) -> Field:
    """Light of a fire from the front, (height, width), of its ``fuel`` (depth, height, width).

    What is near hides a little of what is far.  Twice as many slices as the grid has, each at the
    size of the picture, so that the edges of the flame are found between cubes, too.
    """
    _, height, width = burner.size
    light = np.zeros((height, width), np.float32)
    clear = np.ones((height, width), np.float32)
    for near, far in pairwise(fuel):
        for part in (near, (near + far) / 2):
            if part.max() > 0.04:
                large = cv2.resize(part, (width, height), interpolation=cv2.INTER_CUBIC)
                share = burner.cell * glow(np.clip(large, 0, 1), hollow)
                light += clear * share
                clear *= np.exp(-np.float32(0.15) * share)
    return light


def visibility(burner: Burner, height: float) -> Field:
    """Share of the light that is seen in each row, (rows, 1): none at the burner's jets, all of it
    from ``height`` pixels above them."""
    rows = np.arange(burner.size[1], dtype=np.float32)[:, None]
    return soft_step(-8, height, burner.base - rows)


def coals(burner: Burner, half_width: float, depth: float) -> Iterator[Field]:
    """Light, frame by frame, of the glowing bed that the flames stand in, (height, width).

    Coals of unlike heat, which swells and fades slowly; seen from the side, so they look flat.
    """
    _, height, width = burner.size
    rng = np.random.Generator(np.random.Philox(burner.seed + 2000))
    grains = LoopNoise.draw(rng, (5.0, 14.0), burner.frames, 0.0)
    slow = LoopNoise.draw(rng, (14.0, 60.0), burner.frames, 0.0)
    rows, columns = np.arange(height), np.arange(width)
    x = (columns - (width - 1) / 2) / half_width
    y = (rows[:, None] - burner.base) / depth
    bed = soft_step(0.0, 0.6, np.clip(1 - np.hypot(x, y), 0, 1))
    ground = 2.2 * rows, columns
    hot = np.clip(0.35 + 0.5 * grains.sample(ground, 0), 0, 1.1) ** 2
    for frame in range(burner.frames):
        swell = np.clip(0.6 + 0.5 * slow.sample(ground, frame), 0.05, 1.3)
        yield np.asarray(0.8 * bed * (0.3 + hot * swell), dtype=np.float32)


def starting_at(loop: list[Pixels], frame: int) -> list[Pixels]:
    """The frames of ``loop``, from ``frame`` on and around.

    The best first frame is one into which the flame changes about as much as into most others.
    """
    return loop[frame:] + loop[:frame]


def make_campfire(folder: Path) -> None:
    """48 transparent frames of a campfire at 24 fps."""
    flames = (
        visibility(CAMPFIRE, 34) * front_view(fuel, CAMPFIRE, 0.7) for fuel in burn_loop(CAMPFIRE)
    )
    lights = (flame + bed for flame, bed in zip(flames, coals(CAMPFIRE, 76, 18), strict=True))
    levels = [quantise(exposure(light, 0.8), LEVELS) for light in lights]
    save_frames(folder, starting_at(levels, 26), fire_palette(LEVELS))


def make_torch(path: Path) -> None:
    """32 frames of a torch's flame on black at 20 fps, one GIF."""
    lights = (visibility(TORCH, 24) * front_view(fuel, TORCH, 0.5) for fuel in burn_loop(TORCH))
    levels = [quantise(exposure(light, 0.9), LEVELS) for light in lights]
    save_gif(path, starting_at(levels, 18), over_black(fire_palette(LEVELS)), fps=20)


def make_fireball(folder: Path) -> None:
    """24 transparent frames of a fireball flying to the right at 24 fps."""
    lights = (np.rot90(front_view(fuel, FIREBALL, 0)).copy() for fuel in burn_loop(FIREBALL))
    # A film of much contrast: only the head is white.
    levels = [quantise(exposure(light**1.6, 0.2), LEVELS) for light in lights]
    save_frames(folder, levels, fire_palette(LEVELS))


#: What makes each sample, by the name it has in the folder of samples.
MAKERS: dict[str, Callable[[Path], None]] = {
    "campfire": make_campfire,
    "torch.gif": make_torch,
    "cartoon_flame.png": lambda path: save_sheet(path, cartoon_frames(), columns=6),
    "fireball": make_fireball,
    "candle": lambda path: save_painted(path, candle_frames()),
    "explosion": lambda path: save_painted(path, explosion_frames()),
    "pixel_flame.png": lambda path: save_sheet(path, pixel_frames(), columns=8),
    "crate.png": lambda path: save_sheet(path, [crate()], columns=1),
}


def make(out: Path, names: Sequence[str]) -> None:
    """Write the samples ``names`` below ``out``."""
    cv2.setNumThreads(1)
    out.mkdir(parents=True, exist_ok=True)
    for name in names:
        MAKERS[name](out / name)


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE, sys.argv[2:] or list(MAKERS))
