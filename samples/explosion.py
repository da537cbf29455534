"""A one-shot explosion: a flash, a fireball that billows, and smoke that rises and thins out.

Thin sheets of gas, each with a life of its own, lie behind one another; the rules of the flow are
those of ``plane_flow``.  Fuel glows until it has burnt, the soot that comes with it stays.

Units: pixels and frames.  Fields are float32 arrays of shape ``(height, width)``, rows downwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from noise import LoopNoise
from painting import Field, Pixels, coarser, fire_colours, layer_over, soft_step, straight
from plane_flow import advect, burn, confine, project
from simulation import margin_window, open_laplacian

SIZE = 192  #: height and width of a frame
DETAIL = 1.5  #: grid cells per pixel
ROOM = 288  #: height and width of the gas, pixels: it takes the shape of walls that are near
FRAMES = 32
SUBSTEPS = 2
HEART = (118.0, 96.0)  #: row and column of the charge, pixels
SHEETS = (31, 32, 33)  #: seed of each sheet of gas, the farthest first

BLAST = 1.1  #: expansion of the gas at the start, 1/frame
SPENT = 3.6  #: frames in which the blast falls to 1/e
LIFE = 28.0  #: frames a parcel of fuel burns
LINGER = 50.0  #: frames its soot stays
THINNING = 8.0  #: how much faster thin gas burns out
LIFT = 0.95 * DETAIL  #: upward acceleration of burning gas, cells/frame²
DRAG = 0.08  #: share of the velocity lost per frame
STIR = 1.5 * DETAIL  #: acceleration of the stirring, cells/frame²

EDDIES = (8 * DETAIL, 46 * DETAIL)  #: wavelengths of the stirring, cells
LUMPY = 1.1  #: how unevenly the gas expands
GRAIN = (1.6 * DETAIL, 9 * DETAIL)  #: wavelengths of the fuel's unevenness, cells
BILLOWS = (2.5 * DETAIL, 16 * DETAIL)  #: wavelengths of the soot's unevenness, cells

SMOKE = np.array([40.0, 35.0, 33.0])
FIRELIGHT = np.array([190.0, 66.0, 14.0])


@dataclass(frozen=True)
class Gas:
    """State of a sheet: unburnt fuel and soot in [0, 1], velocity in cells per frame."""

    fuel: Field
    soot: Field
    u: Field  #: to the right
    v: Field  #: downwards


@dataclass
class Sheet:
    """One sheet of gas with everything precomputed from its seed."""

    seed: int
    rows: Field = field(init=False)
    columns: Field = field(init=False)
    laplacian: Field = field(init=False)
    calm: Field = field(init=False)
    fuel: Field = field(init=False)
    soot: Field = field(init=False)
    stirring: LoopNoise = field(init=False)

    def __post_init__(self) -> None:
        """Lay out the grid, the lumpy charge with its soot, and the stirring."""
        n = round(ROOM * DETAIL)
        rng = np.random.Generator(np.random.Philox(self.seed))
        self.rows, self.columns = np.mgrid[0:n, 0:n].astype(np.float32)
        self.laplacian = open_laplacian((n, n))
        self.calm = margin_window((n, n), 18)
        outside = (ROOM - SIZE) / 2
        charge = lumps(rng, self.rows / DETAIL - outside, self.columns / DETAIL - outside)
        places = (self.rows[:, 0], self.columns[0])
        grain = LoopNoise.draw(rng, GRAIN, 1, 0.0, 80).sample(places, 0.0)
        billows = LoopNoise.draw(rng, BILLOWS, 1, 0.0, 60).sample(places, 0.0)
        self.fuel = np.clip(charge * (1 + 0.28 * np.minimum(grain, 1)), 0, 1)
        self.soot = soft_step(0.0, 0.35, self.fuel) * np.clip(0.72 + 0.22 * billows, 0.2, 1)
        self.stirring = LoopNoise.draw(rng, EDDIES, 2 * FRAMES, 0.6, 40)

    def start(self) -> Gas:
        """The charge, at rest."""
        still = np.zeros_like(self.fuel)
        return Gas(self.fuel, self.soot, still, still)

    def advance(self, gas: Gas, time: float, dt: float) -> Gas:
        """The state ``dt`` frames after ``time``."""
        fuel, soot, u, v = (
            advect(q, gas.u, gas.v, self.rows, self.columns, dt)
            for q in (gas.fuel, gas.soot, gas.u, gas.v)
        )
        fuel = burn(fuel, LIFE, dt, THINNING) * self.calm
        soot = burn(soot, LINGER, dt, THINNING) * self.calm
        stream = self.stirring.sample((self.rows[:, 0], self.columns[0]), time)
        push_x, push_y = self.forces(Gas(fuel, soot, u, v), stream)
        keep = np.float32(1 - DRAG * dt) * self.calm
        u, v = (u + push_x * np.float32(dt)) * keep, (v + push_y * np.float32(dt)) * keep
        blast = np.float32(BLAST * np.exp(-time / SPENT))
        swelling = blast * soot * np.clip(1 + LUMPY * stream, 0, None)
        u, v = project(u, v, swelling, self.laplacian)
        return Gas(fuel, soot, u, v)

    def forces(self, gas: Gas, stream: Field) -> list[Field]:
        """Accelerations to the right and down: lift, confinement, stirring within the gas."""
        fuel, soot, u, v = gas.fuel, gas.soot, gas.u, gas.v
        scale = STIR * EDDIES[0] / (2 * np.pi)
        stir_y, stir_x = np.gradient(stream * np.float32(scale))
        swirl_x, swirl_y = confine(u, v, 0.2)
        lift = np.float32(LIFT) * (fuel + 0.4 * soot)
        return [swirl_x + soot * stir_y, swirl_y - soot * stir_x - lift]


def lumps(rng: np.random.Generator, rows: Field, columns: Field) -> Field:
    """Fuel in [0, 1] of a charge: a handful of balls of unlike size about its heart."""
    charge = np.zeros_like(rows)
    for turn in np.arange(8) / 8:
        angle = 2 * np.pi * (turn + rng.uniform(-0.05, 0.05))
        reach, radius = rng.uniform(4, 17), rng.uniform(4, 11)
        y, x = HEART[0] - reach * np.sin(angle), HEART[1] + reach * np.cos(angle)
        away = np.clip(1 - np.hypot(columns - x, rows - y) / radius, 0, 1)
        charge = np.maximum(charge, away * (2 - away) * rng.uniform(0.65, 0.95))
    heart = np.clip(1.2 - np.hypot(columns - HEART[1], rows - HEART[0]) / 11, 0, 1)
    return np.asarray(np.maximum(charge, heart), dtype=np.float32)


def shrunk(q: Field) -> Field:
    """A field of the room at the pixels of a frame, in its middle."""
    edge, length = round((ROOM - SIZE) / 2 * DETAIL), round(SIZE * DETAIL)
    frame = q[edge : edge + length, edge : edge + length]
    return np.asarray(cv2.resize(frame, (SIZE, SIZE), interpolation=cv2.INTER_AREA), np.float32)


def burn_out(sheet: Sheet) -> list[Gas]:
    """``FRAMES`` states of a sheet, resampled to pixels."""
    gas, states, dt = sheet.start(), [], 1 / SUBSTEPS
    for frame in range(FRAMES):
        for part in range(SUBSTEPS):
            gas = sheet.advance(gas, frame + part * dt, dt)
        parts = (gas.fuel, gas.soot, gas.u, gas.v)
        states.append(Gas(*(shrunk(q) for q in parts)))
    return states


def relief(depth: Field) -> Field:
    """Brightness of a cloud, about 1, lit from above; its surface bulges where it is deep."""
    fine, coarse = cv2.GaussianBlur(depth, (0, 0), 0.8), cv2.GaussianBlur(depth, (0, 0), 3.0)
    slope = 4 * np.gradient(fine, axis=0) + 7 * np.gradient(coarse, axis=0)
    return np.asarray(np.clip(1 + slope, 0.25, 2.4), dtype=np.float32)


def add_sheet(image: Field, gas: Gas, glow: Field, flash: Field, thinned: float) -> Field:
    """``image`` behind a sheet: its smoke, lit by the ``glow`` of all the fire, then its fire."""
    smoke = np.asarray(0.85 * thinned * soft_step(0.06, 0.6, gas.soot), dtype=np.float32)
    shade = SMOKE * relief(1.4 * gas.soot)[..., None] + (glow**1.5)[..., None] * FIRELIGHT
    image = layer_over(image, shade, smoke)
    heat = gas.fuel**0.8 * (0.48 + 1.25 * glow) * relief(gas.fuel) ** 0.35
    level = soft_step(0.02, 0.3, gas.fuel) * (0.14 + heat) + flash
    colours = fire_colours(np.clip(level, 0, 1))
    return layer_over(image, colours[..., :3], (colours[..., 3] / 255).astype(np.float32))


def flash_at(time: float) -> Field:
    """Fire level of the flash, white-hot at first and gone within a few frames."""
    rows, columns = np.mgrid[0:SIZE, 0:SIZE].astype(np.float32)
    away = np.hypot(columns - HEART[1], rows - HEART[0]) / (15 + 5 * time)
    return np.asarray(1.7 * np.exp(-time / 1.6) * np.exp(-(away**2)), dtype=np.float32)


def paint(sheets: list[Gas], frame: int) -> Pixels:
    """Straight-alpha RGBA of the ``sheets``, the farthest first, at ``frame``."""
    heat = np.sum([gas.fuel for gas in sheets], axis=0) / len(sheets)
    glow = cv2.GaussianBlur(heat, (0, 0), 9.0)
    thinned = float(1 - np.clip((frame - 15) / (FRAMES - 1 - 15), 0, 1) ** 1.8)
    image = np.zeros((SIZE, SIZE, 4), np.float32)
    for gas in sheets:
        image = add_sheet(image, gas, glow, flash_at(frame), thinned)
    return coarser(straight(image), 44)


def explosion_frames() -> list[Pixels]:
    """The explosion, ``FRAMES`` straight-alpha RGBA frames; the last one is empty."""
    states = [burn_out(Sheet(seed)) for seed in SHEETS]
    return [paint(list(now), frame) for frame, now in enumerate(zip(*states, strict=True))]
