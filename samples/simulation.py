"""A small 2-D combustion simulation whose every burn closes into a seamless loop.

Stable fluids with one reacting scalar: *fuel* (1 at the burner, 0 once burnt out) is carried by
an incompressible flow, burns down at a steady rate, and lifts the air it heats.  Everything that
stirs the flow repeats with the loop.  The draught carries every eddy out of the frame, so nothing
older than a loop or two is remembered, and the flame itself comes to repeat: there is no seam to
hide.

Units: pixels and frames.  Fields are float32 arrays of shape ``(height, width)``, rows downwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Burner:
    """What burns, how it is stirred, and for how long; lengths in pixels, times in frames."""

    size: tuple[int, int]  #: height, width of the grid
    frames: int  #: length of the loop
    seed: int
    base: float  #: row of the burner
    half_width: float  #: half the width of the burner
    offset: float = 0.0  #: of the burner, to the right of the middle
    depth: float = 7.0  #: half the height of the burner
    jets: int = 0  #: places along the bed where fuel comes out; 0: all over it
    life: float = 44.0  #: frames a parcel of fuel burns
    thinning: float = 4.5  #: how much faster thin flames burn out
    buoyancy: float = 0.12  #: upward acceleration of burning gas
    draught: float = 1.2  #: steady upward wind
    inflow: float = 0.008  #: air drawn in from the sides and up with height, 1/frame
    sway: float = 0.0  #: swing of the side wind, per frame height above the burner
    swelling: float = 0.06  #: expansion of the gas at the burner, 1/frame
    confinement: float = 0.10  #: vorticity confinement
    turbulence: float = 0.10  #: acceleration of the periodic stirring
    eddies: tuple[float, float] = (26.0, 90.0)  #: wavelengths of the stirring
    steepest: float = np.pi  #: of its waves, radians from sideways: small ones stir up and down
    flicker: float = 0.55  #: how far the fuel supply varies along the burner
    tongues: tuple[float, float] = (14.0, 60.0)  #: wavelengths of that variation
    ragged: float = 0.0  #: how far moving noise of these wavelengths eats into the burner's rim
    drag: float = 0.02  #: share of the velocity lost per frame
    substeps: int = 2
    settling: int = 3  #: loops burnt before the one recorded


@dataclass(frozen=True)
class LoopNoise:
    """Band-limited noise, a sum of plane waves that repeats every ``period`` frames."""

    wave_x: Field  #: (n,) radians per pixel
    wave_y: Field  #: (n,) radians per pixel
    turns: Field  #: (n,) whole turns per period
    phase: Field  #: (n,) radians
    period: float

    @classmethod
    def draw(
        cls,
        rng: np.random.Generator,
        wavelengths: tuple[float, float],
        period: float,
        speed: float,
        count: int = 28,
        steepest: float = np.pi,
    ) -> LoopNoise:
        """Draw ``count`` waves which drift upwards at about ``speed`` pixels a frame."""
        shortest, longest = wavelengths
        wavelength = shortest * (longest / shortest) ** rng.uniform(0, 1, count)
        angle = rng.uniform(-steepest, steepest, count)
        wave_x = 2 * np.pi / wavelength * np.cos(angle)
        wave_y = 2 * np.pi / wavelength * np.sin(angle)
        drift = wave_y * speed * period / (2 * np.pi)
        turns = np.round(drift + rng.normal(0.0, 0.8, count))
        phase = rng.uniform(0, 2 * np.pi, count)
        return cls(
            wave_x.astype(np.float32),
            wave_y.astype(np.float32),
            turns.astype(np.float32),
            phase.astype(np.float32),
            period,
        )

    def sample(self, height: int, width: int, time: float) -> Field:
        """Values of about unit variance on a (height, width) grid at ``time`` frames."""
        now = self.phase + 2 * np.pi * self.turns * np.float32((time / self.period) % 1.0)
        along_y = np.exp(1j * (np.arange(height)[:, None] * self.wave_y + now))
        along_x = np.exp(1j * (np.arange(width)[:, None] * self.wave_x))
        waves = along_y.astype(np.complex64) @ along_x.astype(np.complex64).T
        return np.asarray(waves.real * np.sqrt(2.0 / len(now)), dtype=np.float32)


@dataclass(frozen=True)
class Flame:
    """State of the gas: fuel in [0, 1] and velocity in pixels per frame."""

    fuel: Field
    u: Field  #: to the right
    v: Field  #: downwards


@dataclass
class Furnace:
    """A burner together with everything precomputed from it."""

    burner: Burner
    rows: Field = field(init=False)
    columns: Field = field(init=False)
    laplacian: Field = field(init=False)
    wind_u: Field = field(init=False)
    wind_v: Field = field(init=False)
    heights: Field = field(init=False)  #: of each row above the burner, in frame heights
    bed: Field = field(init=False)
    bed_rows: tuple[int, int] = field(init=False)  #: first row of the bed, and the one after it
    calm: Field = field(init=False)
    supply: LoopNoise = field(init=False)
    stirring: LoopNoise = field(init=False)
    rim: LoopNoise = field(init=False)

    def __post_init__(self) -> None:
        """Lay out the grid, the burner's bed and the noises."""
        burner = self.burner
        height, width = burner.size
        rng = np.random.Generator(np.random.Philox(burner.seed))
        grid = np.mgrid[0:height, 0:width].astype(np.float32)
        self.rows, self.columns = grid[0], grid[1]
        self.laplacian = open_laplacian(height, width)
        self.wind_u, self.wind_v = wind(burner, self.rows, self.columns)
        self.heights = np.clip(burner.base - self.rows[:, :1], 0, None) / np.float32(height)
        place = jets if burner.jets else smooth_bed
        self.bed = place(burner, self.rows, self.columns)
        lit = np.flatnonzero(self.bed.any(axis=1))
        self.bed_rows = int(lit[0]), int(lit[-1]) + 1
        self.calm = margin_window(height, width, 18)
        period, speed = burner.frames, burner.draught + 1.2
        self.supply = LoopNoise.draw(rng, burner.tongues, period, 0.5, 18, 0.6)
        self.stirring = LoopNoise.draw(rng, burner.eddies, period, speed, 36, burner.steepest)
        self.rim = LoopNoise.draw(rng, burner.tongues, period, speed / 2, 24)

    def advance(self, flame: Flame, time: float, dt: float) -> Flame:
        """The state ``dt`` frames after ``time``."""
        burner = self.burner
        along, up = flame.u + self.wind_u + self.breeze(time), flame.v + self.wind_v
        fuel, u, v = (
            advect(q, along, up, self.rows, self.columns, dt)
            for q in (flame.fuel, flame.u, flame.v)
        )
        fuel = self.feed(burn(fuel, burner.life, dt, burner.thinning), time)
        push_x, push_y = self.forces(fuel, u, v, time)
        keep = np.float32(1 - burner.drag * dt) * self.calm
        u, v = (u + push_x * np.float32(dt)) * keep, (v + push_y * np.float32(dt)) * keep
        u, v = project(u, v, self.bed * np.float32(burner.swelling), self.laplacian)
        return Flame(fuel, u, v)

    def breeze(self, time: float) -> Field:
        """Side wind by row: a slow swing and a quick one, both of which climb the flame.

        What leans one way at the foot leans the other way further up, and breaks the symmetry of
        the curls on either side.
        """
        turn = 2 * np.pi * time / self.burner.frames
        slow = np.sin(turn - 3.0 * self.heights)
        quick = np.sin(3 * turn - 9.0 * self.heights + 1.9)
        return np.asarray(self.burner.sway * self.heights**0.7 * (slow + 0.6 * quick), np.float32)

    def feed(self, fuel: Field, time: float) -> Field:
        """Renew the fuel at the burner, in a row of tongues that swell and starve."""
        burner, (top, bottom) = self.burner, self.bed_rows
        ripple = self.supply.sample(bottom - top, fuel.shape[1], time)
        share = np.clip(1 - burner.flicker * (0.5 - 0.6 * ripple), 0, 1)
        fuel = fuel * self.calm
        bed = self.bed[top:bottom]
        if burner.ragged:
            bite = np.clip(0.5 + 0.5 * self.rim.sample(bottom - top, fuel.shape[1], time), 0, 1.5)
            bed = np.clip(bed - np.float32(burner.ragged) * bite * (1 - bed), 0, 1)
        strength = bed * share * (2 - share)
        fuel[top:bottom] = np.maximum(fuel[top:bottom], strength)
        return fuel

    def forces(self, fuel: Field, u: Field, v: Field, time: float) -> tuple[Field, Field]:
        """Accelerations: buoyancy, vorticity confinement, periodic stirring near the flame."""
        burner = self.burner
        height, width = fuel.shape
        heat = np.sqrt(np.clip(fuel, 0, 1))
        stream = self.stirring.sample(height, width, time)
        scale = burner.turbulence * burner.eddies[0] / (2 * np.pi)
        stir_y, stir_x = np.gradient(stream * np.float32(scale))
        swirl_x, swirl_y = confine(u, v, burner.confinement)
        push_x = swirl_x + stir_y
        push_y = swirl_y - stir_x - np.float32(burner.buoyancy) * heat
        return push_x.astype(np.float32), push_y.astype(np.float32)


def wind(burner: Burner, rows: Field, columns: Field) -> tuple[Field, Field]:
    """Steady, divergence-free air: a draught that narrows and quickens above the burner."""
    u = -burner.inflow * (columns - (burner.size[1] - 1) / 2)
    v = -burner.draught - burner.inflow * (burner.base - rows)
    return u.astype(np.float32), np.minimum(v, 0).astype(np.float32)


def smooth_bed(burner: Burner, rows: Field, columns: Field) -> Field:
    """Soft-edged ellipse of fuel, 1 in its middle."""
    x = (columns - (burner.size[1] - 1) / 2 - burner.offset) / burner.half_width
    y = (rows - burner.base) / burner.depth
    r = np.clip(1 - np.hypot(x, y), 0, 1)
    return np.asarray(r * (2 - r), dtype=np.float32)


def jets(burner: Burner, rows: Field, columns: Field) -> Field:
    """Fuel that comes out of gaps between logs: spots of unlike size and height, weaker outside.

    The feet of the flames are ragged by it, and tongues are as wide as the spots.
    """
    rng = np.random.Generator(np.random.Philox(burner.seed + 1000))
    middle, pitch = (burner.size[1] - 1) / 2 + burner.offset, burner.half_width / burner.jets
    bed = np.zeros_like(rows)
    for place in (np.arange(burner.jets) + 0.5) / burner.jets * 2 - 1:
        x = middle + burner.half_width * place + pitch * rng.uniform(-0.5, 0.5)
        y = burner.base + burner.depth * rng.uniform(-1, 0.2) * np.sqrt(1 - place**2)
        radius = pitch * rng.uniform(1.0, 2.0)
        r = np.clip(1 - np.hypot((columns - x) / radius, (rows - y) / (0.8 * radius)), 0, 1)
        bed = np.maximum(bed, r * (2 - r) * (1 - 0.45 * place**2) * rng.uniform(0.85, 1))
    return np.asarray(bed, dtype=np.float32)


def margin_window(height: int, width: int, margin: int) -> Field:
    """1 inside, falling smoothly to 0 over ``margin`` pixels at the four borders."""

    def ramp(n: int) -> Field:
        inset = np.minimum(np.arange(n), np.arange(n)[::-1])
        t = np.clip((inset + 0.5) / margin, 0, 1)
        return np.asarray(t * t * (3 - 2 * t), dtype=np.float32)

    return np.outer(ramp(height), ramp(width))


def open_laplacian(height: int, width: int) -> Field:
    """Eigenvalues of the 5-point Laplacian, pressure zero outside: air may cross every border.

    Ordered for ``solve_pressure``, which meets the highest sine wave first.
    """

    def line(n: int) -> Field:
        return np.asarray(2 * np.cos(np.pi * np.arange(n, 0, -1) / n) - 2, dtype=np.float32)

    return np.add.outer(line(height), line(width)).astype(np.float32)


def solve_pressure(divergence: Field, laplacian: Field) -> Field:
    """Pressure, zero beyond the borders, whose Laplacian is ``divergence``; even sizes only.

    A sine transform is the cosine transform of the field with every other sign flipped.
    """
    flipped = divergence.copy()
    flipped[::2, 1::2] *= -1
    flipped[1::2, ::2] *= -1
    pressure = cv2.idct(cv2.dct(flipped) / laplacian)
    pressure[::2, 1::2] *= -1
    pressure[1::2, ::2] *= -1
    return np.asarray(pressure, dtype=np.float32)


def advect(q: Field, u: Field, v: Field, rows: Field, columns: Field, dt: float) -> Field:
    """Carry ``q`` along (u, v) for ``dt`` frames: midpoint back-trace, limited bicubic lookup."""
    half = np.float32(dt / 2)
    mid_x, mid_y = columns - half * u, rows - half * v
    back_x = columns - 2 * half * cv2.remap(u, mid_x, mid_y, cv2.INTER_LINEAR)
    back_y = rows - 2 * half * cv2.remap(v, mid_x, mid_y, cv2.INTER_LINEAR)
    sharp = cv2.remap(q, back_x, back_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    box = np.ones((3, 3), np.uint8)
    near_x, near_y = np.rint(back_x), np.rint(back_y)
    low = cv2.remap(cv2.erode(q, box), near_x, near_y, cv2.INTER_NEAREST)
    high = cv2.remap(cv2.dilate(q, box), near_x, near_y, cv2.INTER_NEAREST)
    return np.clip(sharp, low, high)


def burn(fuel: Field, life: float, dt: float, thinning: float) -> Field:
    """Use up fuel at a steady rate, faster where the flame is thin and loses its heat."""
    around = cv2.GaussianBlur(fuel, (0, 0), 4.0)
    loss = (1 + np.float32(thinning) * np.clip(fuel - around, 0, 1)) * np.float32(dt / life)
    return np.asarray(np.clip(fuel - loss, 0, 1), dtype=np.float32)


def curl(u: Field, v: Field) -> Field:
    """Vorticity of (u, v), 1/frame."""
    return np.asarray(np.gradient(v, axis=1) - np.gradient(u, axis=0), dtype=np.float32)


def confine(u: Field, v: Field, strength: float) -> tuple[Field, Field]:
    """Vorticity confinement: the acceleration that gives eddies back what the grid smears."""
    spin = curl(u, v)
    slope_y, slope_x = np.gradient(cv2.GaussianBlur(np.abs(spin), (0, 0), 1.0))
    size = np.sqrt(slope_x**2 + slope_y**2) + np.float32(1e-4)
    gain = np.float32(strength) * spin / size
    return np.asarray(slope_y * gain), np.asarray(-slope_x * gain)


def project(u: Field, v: Field, swelling: Field, laplacian: Field) -> tuple[Field, Field]:
    """Remove the divergence of (u, v) except for ``swelling``."""
    divergence = np.gradient(u, axis=1) + np.gradient(v, axis=0) - swelling
    slope_y, slope_x = np.gradient(solve_pressure(divergence.astype(np.float32), laplacian))
    return u - slope_x, v - slope_y


def finer(burner: Burner, detail: float) -> Burner:
    """The same fire on a grid with ``detail`` times as many rows and columns."""
    height, width = burner.size
    low, high = burner.eddies
    thin, wide = burner.tongues
    return replace(
        burner,
        size=(round(height * detail), round(width * detail)),
        base=(burner.base + 0.5) * detail - 0.5,
        half_width=burner.half_width * detail,
        offset=burner.offset * detail,
        depth=burner.depth * detail,
        buoyancy=burner.buoyancy * detail,
        draught=burner.draught * detail,
        sway=burner.sway * detail,
        confinement=burner.confinement * detail,
        turbulence=burner.turbulence * detail,
        eddies=(low * detail, high * detail),
        tongues=(thin * detail, wide * detail),
    )


def burn_loop(burner: Burner) -> Field:
    """Fuel of a loop of ``burner.frames`` frames, shape (frames, height, width), in [0, 1]."""
    furnace = Furnace(burner)
    still = np.zeros(burner.size, np.float32)
    flame = Flame(still, still, still)
    dt = 1 / burner.substeps
    loop: list[Field] = []
    for frame in range(-burner.settling * burner.frames, burner.frames):
        for part in range(burner.substeps):
            flame = furnace.advance(flame, frame + part * dt, dt)
        if frame >= 0:
            loop.append(flame.fuel)
    return np.stack(loop)
