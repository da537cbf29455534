"""A fire texture of our own: burning gas carried up by a flow that repeats.

The flow is made, not solved: gas that speeds up as it rises, air drawn in towards the middle, and
eddies that drift up more slowly than the gas. All of it repeats after N images, and gas burns out
before it can remember the last round, so the images close into a circle by themselves. What is
carried is fuel that burns down at a steady rate: where it ends, tongues end, sharp at their tips.

Units: sheet heights and images; u to the right, 0 in the middle of the sheet; v up from its base.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.silk.texture import Sequence, framed

_EDDIES = 48
_WAVELENGTHS = (0.07, 0.5)
"""Shortest and longest eddy, sheet heights."""

_DRIFT = 0.62
"""Speed at which eddies rise, against that of the gas."""

_STEPS = 3
"""Steps from image to image."""

_FINGERS = 12
_FOOT, _ROUND, _MOUTH = 0.07, 0.10, 0.035
"""Height of the burner in its middle, how much higher its sides are, and its depth: sheet
heights."""

_MOTION_CELL = 2
"""Texture px to a cell of the recorded motion, which is smooth."""


@dataclass(frozen=True, slots=True)
class Burner:
    """What burns at the foot of a sheet and how.

    Attributes:
        gas: Speed of the gas half way up, sheet heights an image.
        eddies: Speed (rms) of the eddies, against the gas.
        life: How far up a parcel of the strongest fuel comes, sheet heights.
        width: Of the burner, against the width of the sheet.
        flicker: How much the fuel differs along the burner and with time, 0..1.
        tongue: Typical width of a tongue at the foot, sheet heights.
        draught: How fast air is drawn towards the middle, against the gas.
        swell: Height up to which the flame widens instead, sheet heights.
    """

    gas: float
    eddies: float
    life: float
    width: float
    flicker: float
    tongue: float
    draught: float
    swell: float = 0.0


@dataclass(frozen=True, slots=True)
class _Waves:
    """A sum of plane waves that repeats every ``period`` images.

    Attributes:
        ku, kv: (n,) wave numbers, rad per sheet height.
        omega: (n,) rad an image.
        phase: (n,) rad.
        amplitude: (n,).
    """

    ku: NDArray[np.float64]
    kv: NDArray[np.float64]
    omega: NDArray[np.float64]
    phase: NDArray[np.float64]
    amplitude: NDArray[np.float64]

    def at(self, time: float, u: NDArray[np.float64], v: NDArray[np.float64]) -> Plane:
        """Values (len(v), len(u)); sin(kv v + ku u + p) as one product of two matrices."""
        down = np.outer(self.kv, v) + (self.phase + self.omega * time)[:, None]
        across = np.outer(self.ku, u)
        rows = np.concatenate([np.sin(down), np.cos(down)])
        columns = np.concatenate([np.cos(across), np.sin(across)])
        columns *= np.tile(self.amplitude, 2)[:, None]
        return as_plane(rows).T @ as_plane(columns)


def burn(
    burner: Burner, images: int, shape: tuple[int, int], aspect: float, seed: int, index: int
) -> Sequence:
    """Paint a circle of images of fire.

    Args:
        burner: What burns.
        images: N, how many images until they begin anew.
        shape: (height, width) of an image, px.
        aspect: Width of the sheet against its height.
        seed: Of the build.
        index: Which of several sequences; each is another fire.

    Returns:
        One channel: heat, 0..1, 0 on every edge.
    """
    height, width = shape
    v = 1 - (np.arange(height) + 0.5) / height
    u = ((np.arange(width) + 0.5) / width - 0.5) * aspect
    chance = generator(seed, Stage.PLUME, index)
    flow = _Flow(burner, _eddies(chance, burner, images), u, v)
    grate = _Grate(burner, _fingers(chance, burner, images), u, v, aspect)
    path = _Path(shape, grate.risen(), height / _STEPS)
    burnt = np.float32(burner.gas / burner.life / _STEPS)
    fuel = np.zeros(shape, np.float32)
    heat = np.empty((images, height, width), np.float32)
    motion = np.empty((images, *path.shape, 2), np.float32)
    warm_up = int(2.2 * burner.life / burner.gas) + 1
    for step in range(-warm_up * _STEPS, images * _STEPS):
        n, part = divmod(step, _STEPS)
        right, up = flow.at(step / _STEPS)
        if n >= 0:
            if part == 0:
                heat[n] = fuel
                path.begin()
            path.follow(right, up)
            if part == _STEPS - 1:
                motion[n] = path.gone()
        fuel = as_plane(np.maximum(path.carried(fuel, right, up) - burnt, 0.0))
        fuel = grate.fed(fuel, step / _STEPS)
    heat = np.clip(heat, 0.0, 1.25) * framed(shape)
    return Sequence(heat[..., None], motion)


class _Grate:
    """Where fuel comes from: a round foot, fed unevenly along its width."""

    def __init__(
        self,
        burner: Burner,
        fingers: _Waves,
        u: NDArray[np.float64],
        v: NDArray[np.float64],
        aspect: float,
    ) -> None:
        across = np.abs(u) / (aspect * burner.width / 2)
        # At the sides of the burner, where this is 1, it burns higher up.
        self._above = v[:, None] - (_FOOT + _ROUND * np.minimum(across, 1.2)[None] ** 2)
        depth = np.where(self._above > 0, _MOUTH, 0.6 * _MOUTH)
        self._mouth = as_plane(0.95 * np.exp(-((self._above / depth) ** 2)))
        self._lip = np.clip(1 - across**2, 0, None) ** 0.75
        self._fingers, self._flicker, self._u = fingers, burner.flicker, u

    def fed(self, fuel: Plane, time: float) -> Plane:
        """Fuel after fresh one has come up."""
        uneven = self._fingers.at(time, self._u, np.zeros(1))
        supply = as_plane(self._lip * np.clip(1 + self._flicker * uneven, 0, 1.3))
        return as_plane(fuel + np.maximum(supply - fuel, 0.0) * self._mouth)

    def risen(self) -> Plane:
        """How far each place is out of the foot, which stays where it is, 0..1."""
        return as_plane(np.clip(self._above / (3 * _MOUTH), 0.0, 1.0))


class _Path:
    """Moves what is on an image, and remembers where it goes until the next one."""

    def __init__(self, shape: tuple[int, int], risen: Plane, px: float) -> None:
        height, width = shape
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        self._columns, self._rows = as_plane(columns), as_plane(rows)
        self._risen, self._px = risen, np.float32(px)
        self._x, self._y = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        self.shape = -(-height // _MOTION_CELL), -(-width // _MOTION_CELL)

    def begin(self) -> None:
        """Start from where everything is."""
        self._x[:], self._y[:] = 0, 0

    def follow(self, right: Plane, up: Plane) -> None:
        """Go on with the flow, where each place has come to, for a step."""
        at = self._columns + self._x, self._rows + self._y
        edge = cv2.BORDER_REPLICATE
        self._x += cv2.remap(right, *at, cv2.INTER_LINEAR, borderMode=edge) * self._px
        self._y -= cv2.remap(up, *at, cv2.INTER_LINEAR, borderMode=edge) * self._px

    def gone(self) -> NDArray[np.float32]:
        """How far each place has gone, px, on a coarser grid (h, w, 2)."""
        size = self.shape[1], self.shape[0]
        small = [
            cv2.resize(gone * self._risen, size, interpolation=cv2.INTER_AREA)
            for gone in (self._x, self._y)
        ]
        return as_plane(np.dstack(small))

    def carried(self, fuel: Plane, right: Plane, up: Plane) -> Plane:
        """``fuel`` after a step of the flow."""
        columns, rows = self._columns - right * self._px, self._rows + up * self._px
        return as_plane(
            cv2.remap(fuel, columns, rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)
        )


def _eddies(chance: np.random.Generator, burner: Burner, images: int) -> _Waves:
    """Stream function of the eddies, whose velocity has an rms of 1."""
    length = np.exp(chance.uniform(math.log(_WAVELENGTHS[0]), math.log(_WAVELENGTHS[1]), _EDDIES))
    heading = chance.uniform(0, 2 * np.pi, _EDDIES)
    number = 2 * np.pi / length
    ku, kv = number * np.cos(heading), number * np.sin(heading)
    own = chance.normal(0, 0.8, _EDDIES) * burner.gas / length
    amplitude = length**1.45
    amplitude /= np.sqrt(((amplitude * number) ** 2).sum() / 2)
    omega = _whole_turns(own - kv * _DRIFT * burner.gas, images)
    return _Waves(ku, kv, omega, chance.uniform(0, 2 * np.pi, _EDDIES), amplitude)


def _fingers(chance: np.random.Generator, burner: Burner, images: int) -> _Waves:
    """How the fuel varies along the burner: rms 1, slow against the gas."""
    length = burner.tongue * np.exp(chance.uniform(np.log(0.7), np.log(4.0), _FINGERS))
    omega = chance.normal(0, 1.0, _FINGERS) * burner.gas / burner.life * 2 * np.pi * 0.8
    return _Waves(
        2 * np.pi / length * chance.choice([-1.0, 1.0], _FINGERS),
        np.zeros(_FINGERS),
        _whole_turns(omega, images),
        chance.uniform(0, 2 * np.pi, _FINGERS),
        np.full(_FINGERS, np.sqrt(2 / _FINGERS)),
    )


def _whole_turns(omega: NDArray[np.float64], images: int) -> NDArray[np.float64]:
    """The nearest angular frequencies that come round in ``images``."""
    turn = 2 * np.pi / images
    return np.rint(omega / turn) * turn


class _Flow:
    """Velocity of the gas, sheet heights an image."""

    def __init__(
        self, burner: Burner, eddies: _Waves, u: NDArray[np.float64], v: NDArray[np.float64]
    ) -> None:
        self._eddies, self._u, self._v = eddies, u, v
        gas, spacing = burner.gas, v[0] - v[1]
        # Eddies grow with height: a flame is smooth at its foot.
        self._growth = as_plane(np.clip(1.7 * v + 0.08, 0.0, 1.0)[:, None])
        self._gain = np.float32(burner.eddies * gas / (2 * spacing))
        speed = gas * (0.4 + 0.85 * np.sqrt(v))
        self._up = as_plane(np.repeat(speed[:, None], len(u), axis=1))
        pull = burner.draught * gas * np.clip(1.2 - np.abs(v - 0.25), 0.3, 1.0)
        if burner.swell > 0:
            pull *= np.clip((v - burner.swell) / (0.5 * burner.swell), -1.4, 1.0)
        self._in = as_plane(-u[None] * pull[:, None])

    def at(self, time: float) -> tuple[Plane, Plane]:
        """(right, up), each (height, width), at ``time``: the eddies' curl and what is steady."""
        stream = self._eddies.at(time, self._u, self._v) * self._growth
        padded = cv2.copyMakeBorder(stream, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
        right = (padded[:-2, 1:-1] - padded[2:, 1:-1]) * self._gain + self._in
        up = (padded[1:-1, :-2] - padded[1:-1, 2:]) * self._gain + self._up
        return as_plane(right), as_plane(up)
