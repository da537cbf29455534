"""A cartoon flame: flat layers of swaying tongues that pinch off blobs.

Every layer is the inside of a signed distance field, the smooth union of tapered tongues and of
drops which leave their tips.  Lengths are in pixels of a ``CELL``-sized frame, time in loops.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from painting import straight

Field = npt.NDArray[np.float32]
Pixels = npt.NDArray[np.uint8]

CELL = (160, 128)  #: height, width
SUPERSAMPLE = 2
BASE = 146.0  #: row the tongues stand on
TAU = 2 * np.pi


@dataclass(frozen=True)
class Tongue:
    """One lick: where it stands, how tall and fat it is, how it sways."""

    x: float  #: foot, pixels right of the middle
    height: float
    radius: float  #: at the foot
    lean: float  #: pixels the tip stands to the right of the foot
    sway: float  #: amplitude at the tip
    phase: float  #: in loops
    beats: int = 1  #: sways per loop


TONGUES = (
    Tongue(-2, 86, 25, 5, 10, 0.00),
    Tongue(-22, 56, 17, -9, 8, 0.35),
    Tongue(22, 62, 16, 9, 8, 0.62),
    Tongue(-33, 30, 11, -6, 4, 0.80, 2),
    Tongue(34, 33, 10, 6, 4, 0.15, 2),
)

#: Layers from the outside in: size relative to the outermost, delay in loops, red, green, blue.
LAYERS = (
    (1.00, 0.00, (226, 58, 24)),
    (0.80, 0.04, (255, 128, 26)),
    (0.58, 0.08, (255, 202, 48)),
    (0.34, 0.12, (255, 246, 190)),
)


def smooth_union(a: Field, b: Field, radius: float) -> Field:
    """Distance to the union of two shapes, filleted over ``radius`` pixels."""
    h = np.maximum(radius - np.abs(a - b), 0) / radius
    return np.asarray(np.minimum(a, b) - h * h * (radius / 4), dtype=np.float32)


def spine(tongue: Tongue, s: float, time: float) -> tuple[float, float]:
    """Offset right of the middle and height above the base at share ``s`` of the tongue."""
    wave = np.sin(TAU * (tongue.beats * time - 0.7 * s + tongue.phase))
    breath = 1 + 0.10 * np.sin(TAU * (tongue.beats * time + tongue.phase + 0.3))
    x = tongue.x * (1 - 0.45 * s) + tongue.lean * s**2 + tongue.sway * s**1.4 * wave
    return float(x), float(tongue.height * breath * s)


def tongue_distance(tongue: Tongue, x: Field, y: Field, time: float) -> Field:
    """Signed distance to a tongue: a string of discs shrinking to a point along its spine."""
    nearest = np.full(x.shape, 1e3, np.float32)
    for s in 1 - np.linspace(1, 0, 36) ** 2:
        cx, cy = spine(tongue, float(s), time)
        bulge = np.sin(TAU * (2 * tongue.beats * time - 1.2 * s + tongue.phase))
        taper = (1 - s) ** 0.85 * (0.86 + 0.9 * s * (1 - s))
        radius = tongue.radius * taper * (1 + 0.22 * s * bulge)
        nearest = np.minimum(nearest, np.hypot(x - cx, y - cy) - np.float32(radius))
    return nearest


def drop_distance(tongue: Tongue, x: Field, y: Field, time: float) -> Field:
    """Signed distance to the blob which leaves the tongue's tip once per beat and burns out."""
    age = (time * tongue.beats + tongue.phase) % 1.0
    cx, cy = spine(tongue, 0.62, time - age * 0.3)
    cy += tongue.height * 0.8 * age
    cx += tongue.lean * 0.6 * age
    radius = 0.4 * tongue.radius * min(1.0, 5 * age) * (1 - age) ** 0.7 - 0.4
    nearest = np.full(x.shape, 1e3, np.float32)
    for s in np.linspace(0, 1, 16):
        part = np.hypot(x - cx, y - cy - 2.4 * radius * s) - np.float32(radius * (1 - s))
        nearest = np.minimum(nearest, part.astype(np.float32))
    return nearest if radius > 0.3 else nearest + 1e3


def flame_distance(scale: float, time: float) -> Field:
    """Signed distance, in pixels of the cell, to the flame shrunk by ``scale`` to its base."""
    height, width = CELL[0] * SUPERSAMPLE, CELL[1] * SUPERSAMPLE
    grid = (np.mgrid[0:height, 0:width].astype(np.float32) + 0.5) / SUPERSAMPLE
    lift = 6.0 * (1 - scale)
    x = (grid[1] - CELL[1] / 2) / np.float32(scale)
    y = (np.float32(BASE - 22 - lift) - grid[0]) / np.float32(scale)
    y += 22 * (1 - scale) / scale
    total = np.full(x.shape, 1e3, np.float32)
    for tongue in TONGUES:
        total = smooth_union(total, tongue_distance(tongue, x, y, time), 9.0)
    for tongue in TONGUES[:3]:
        total = smooth_union(total, drop_distance(tongue, x, y, time), 5.0)
    return total * np.float32(scale)


def paint(time: float) -> Pixels:
    """RGBA frame at ``time``: flat layers, each over the one outside it, with smooth edges."""
    height, width = CELL[0] * SUPERSAMPLE, CELL[1] * SUPERSAMPLE
    image = np.zeros((height, width, 4), np.float32)
    outer = np.full((height, width), -1e3, np.float32)
    for scale, delay, colour in LAYERS:
        outer = np.maximum(outer + 1.5, flame_distance(scale, time - delay))
        cover = np.clip(0.5 - outer * SUPERSAMPLE, 0, 1)[..., None]
        image += cover * (np.array([*colour, 255], np.float32) - image)
    return resolve(image)


def resolve(image: Field) -> Pixels:
    """Average supersampled RGBA, its colours multiplied by opacity, down to straight RGBA."""
    small: Field = cv2.resize(image, CELL[::-1], interpolation=cv2.INTER_AREA).astype(np.float32)
    return straight(small)


def cartoon_frames(count: int = 24) -> list[Pixels]:
    """One loop of the cartoon flame, RGBA frames of ``CELL`` size."""
    return [paint(number / count) for number in range(count)]
