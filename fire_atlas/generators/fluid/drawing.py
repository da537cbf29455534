"""Draw gas: light that hot soot gives along the lines of sight, and smoke in the light about it."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from fire_atlas.core.blackbody import blackbody
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.fluid.combustion import FUEL, SMOKE, TEMPERATURE, smoothed
from fire_atlas.generators.fluid.fires import Look
from fire_atlas.generators.fluid.grid import Field

_HOTTEST, _STEPS = 1.5, 512
"""Temperature up to which light is tabulated, and the number of entries."""

_DARK = 0.12
"""Temperature below which soot does not glow."""

_CORE = 0.6
"""Fuel from which on gas has not caught fire yet."""

_FED, _FED_FROM = 0.6, 1.8
"""Of its temperature, what a flame shows of it where its fuel is gone, and how steeply that grows
to all of it with its fuel: yellow feet, red tips."""

_CROSSTALK = np.array([[0, 0.0225, 0.0225], [0.0158, 0, 0.0135], [0.0158, 0.0292, 0]])
"""Part of the light of a channel (columns) that exposes another one (rows). Without it the densest
fire is as yellow as paint, with it nearly white."""

_KEY, _AMBIENT = np.array([1.15, 1.08, 1.0]), np.array([0.24, 0.28, 0.35])
"""Light from above, left and front on smoke, and from all sides."""

_SCATTERED, _PENETRATION = 0.22, 0.3
"""Part of that light that reaches smoke after several turns, and the optical depth of its way, of
that of the straight one."""

_GLOW_REACH = 0.035
"""Standard deviation, heights, of the glow of fire in its smoke; a wider one has twice that."""

_LEAST_FUEL, _LEAST_SMOKE = 1e-3, 2e-3
"""Values up to which nothing is seen of gas."""

_AROUND = 2
"""Cubes around what is seen of a layer that are drawn too: a bicubic filter reaches them."""


@dataclass(frozen=True, slots=True)
class SeenGas:
    """A picture of gas before it is exposed.

    Attributes:
        fire: (height, width, 3) light of what burns and its glow in smoke, as it is seen through
            smoke.
        smoke: (height, width, 3) daylight that smoke scatters, seen likewise.
        depth: (height, width) optical depth of the smoke.
    """

    fire: NDArray[np.float32]
    smoke: NDArray[np.float32]
    depth: Plane


@dataclass(frozen=True)
class Painter:
    """Draws gas as a look says.

    Attributes:
        look: The look.
        heat: Factor of the temperature.
        cell: Edge of a cube, heights.
    """

    look: Look
    heat: float
    cell: float

    @cached_property
    def table(self) -> NDArray[np.float32]:
        """Light by temperature, (3, entries)."""
        look, hot = self.look, np.linspace(0, _HOTTEST, _STEPS)
        kelvin = look.coldest + (look.hottest - look.coldest) * hot
        bright = np.clip((hot - _DARK) / (1 - _DARK), 0, None) ** look.contrast
        return as_plane((look.emission * blackbody(kelvin) * bright[:, None]).T)

    def draw(self, gas: Field, size: tuple[int, int], pitch: float) -> SeenGas:
        """Draw gas (layers, rows, columns, 4) into a frame of (height, width) px, from the nearest
        layer to the farthest; ``pitch`` is the size of a cube, px."""
        # Light by channel in planes: numpy is slow along an axis of three.
        fire, day = (np.zeros((count, *size), np.float32) for count in (3, 2))
        depth, passed = np.zeros(size, np.float32), np.ones(size, np.float32)
        gas = self._without_weave(gas)
        lit, glow, is_seen = self.lit_smoke(gas), self.glowing_smoke(gas), _is_seen(gas)
        for number in np.flatnonzero(is_seen.any(axis=(1, 2))):
            part = _around(is_seen[number], size, pitch)
            layer, front = gas[number], passed[part.window]
            own = np.zeros(front.shape, np.float32)
            if lit is not None:
                (sooty,) = part.enlarged(layer[..., SMOKE : SMOKE + 1], cv2.INTER_CUBIC)
                own += np.maximum(sooty, 0) * np.float32(self.look.extinction)
            thick = own
            if burns := bool((layer[..., FUEL] > _LEAST_FUEL).any()):
                fuel, hot = part.enlarged(layer[..., :SMOKE], cv2.INTER_CUBIC)
                shine = self.burning(fuel)
                own = thick + np.float32(self.look.absorption) * shine
            kept = as_plane(cv2.exp(own * np.float32(-self.cell)))
            share = front * (1 - kept) / (own + np.float32(1e-6))
            if burns:
                entry, burnt = self._entry(fuel, hot), share * shine
                for plane, light in zip(fire, self.table, strict=True):
                    plane[part.window] += light.take(entry) * burnt
            if lit is not None:
                depth[part.window] += thick * np.float32(self.cell)
                share *= thick
                for plane, light in zip(day, part.enlarged(lit[number]), strict=True):
                    plane[part.window] += light * share
            if glow is not None and glow[number].any():
                for plane, light in zip(fire, part.enlarged(glow[number]), strict=True):
                    plane[part.window] += light * share
            front *= kept
        key, around = day
        albedo = np.array(self.look.albedo)
        smoke = [
            np.float32(of_key) * key + np.float32(of_all) * around
            for of_key, of_all in zip(albedo * _KEY, albedo * _AMBIENT, strict=True)
        ]
        return SeenGas(as_plane(cv2.merge(list(fire))), as_plane(cv2.merge(smoke)), depth)

    def smoke_depth(self, gas: Field, size: tuple[int, int], pitch: float) -> Plane:
        """Return the optical depth of the smoke of gas alone, as ``draw`` does, in less time."""
        if not self._has_smoke(gas):
            return np.zeros(size, np.float32)
        sooty = self._without_weave(gas)[..., SMOKE].sum(axis=0)
        seen = enlarged(as_plane(sooty), pitch, cv2.INTER_CUBIC)[: size[0], : size[1]]
        return as_plane(np.maximum(seen, 0) * np.float32(self.look.extinction * self.cell))

    def _without_weave(self, gas: Field) -> Field:
        """Return gas whose smoke is smooth from cube to cube: edges that are thinner than a cube
        would be steps, and what no step of the simulation sees a pattern of threads."""
        if not self._has_smoke(gas):
            return gas
        sooty = np.ascontiguousarray(gas[..., SMOKE])
        gas = gas.copy()
        gas[..., SMOKE] = smoothed(sooty, slice(0, len(gas)))
        return gas

    def burning(self, fuel: Plane) -> Plane:
        """Return how much gas burns by its fuel: thin one less, and least where it is whole."""
        look = self.look
        core = np.clip((fuel - np.float32(_CORE)) / np.float32(1 - _CORE), 0, 1)
        return as_plane(
            smooth_step(fuel / np.float32(look.dense)) * (1 - np.float32(look.hollow) * core)
        )

    def emission(self, gas: Field) -> NDArray[np.float32]:
        """Return the light that a height of gas (..., 4) gives, (..., 3)."""
        fuel = gas[..., FUEL]
        shine = self.burning(fuel)
        entry = self._entry(fuel, gas[..., TEMPERATURE])
        return np.stack([light.take(entry) * shine for light in self.table], axis=-1)

    def _entry(self, fuel: Plane, hot: Plane) -> NDArray[np.intp]:
        """Return the entry of the table that gas shows."""
        fed = np.float32(_FED) + np.float32(1.1 - _FED) * np.minimum(
            fuel * np.float32(_FED_FROM), 1
        )
        shown = hot * fed * np.float32(self.heat * (_STEPS - 1) / _HOTTEST)
        return np.asarray(np.clip(shown, 0, _STEPS - 1), np.intp)

    def lit_smoke(self, gas: Field) -> NDArray[np.float32] | None:
        """Return the shares of the light from above, left and front, and of that from all sides,
        which reach smoke, (layers, rows, columns, 2); None without smoke."""
        if not self._has_smoke(gas):
            return None
        thickness = gas[..., SMOKE] * np.float32(self.look.extinction * self.cell)
        front, top, left = (_passed(thickness, axis) for axis in range(3))
        below, right = (_passed(thickness, axis, backwards=True) for axis in (1, 2))
        found = np.empty((*thickness.shape, 2), np.float32)
        found[..., 0] = 0.6 * top + 0.25 * left + 0.15 * front
        found[..., 1] = 0.3 * top + 0.2 * left + 0.2 * right + 0.2 * front + 0.1 * below
        return found

    def glowing_smoke(self, gas: Field) -> NDArray[np.float32] | None:
        """Return the light of the fire that its smoke scatters, (layers, rows, columns, 3), from
        every second cube; None without smoke or fire."""
        if not self._has_smoke(gas) or not self.look.emission * self.look.glow:
            return None
        found = np.zeros((*gas.shape[:3], 3), np.float32)
        half = np.ascontiguousarray(gas[::2, ::2, ::2])
        emission = self.emission(half)
        sigma = _GLOW_REACH / (2 * self.cell)
        tint = np.array([1.0, 0.8, 0.65])
        for channel in range(3):
            if not emission[..., channel].any():
                continue
            near, far = (
                gaussian_filter(emission[..., channel], reach, mode="constant", truncate=3)
                for reach in (sigma, 2.2 * sigma)
            )
            strength = self.look.glow / max(self.look.emission, 1e-6) * tint[channel]
            glow = (near + np.float32(1.5) * far) * np.float32(strength)
            for axis, length in enumerate(gas.shape[:3]):
                glow = glow.repeat(2, axis=axis).take(np.arange(length), axis=axis)
            found[..., channel] = glow
        return found

    def _has_smoke(self, gas: Field) -> bool:
        return self.look.extinction > 0 and gas[..., SMOKE].max(initial=0) > _LEAST_SMOKE


def exposed(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return light (height, width, 3) as a camera exposes it, 0..1: each channel saturates by
    itself, and a little of it exposes the others."""
    mixed = as_plane(cv2.transform(light, np.eye(3) + _CROSSTALK))
    return 1 - as_plane(cv2.exp(-mixed))


def _passed(thickness: Field, axis: int, *, backwards: bool = False) -> Field:
    """Return the share of light along an axis that reaches each cube, 0..1."""
    along = np.flip(thickness, axis) if backwards else thickness
    way = np.cumsum(along, axis=axis, dtype=np.float32)
    way -= along * np.float32(0.5)
    shape = way.shape
    flat = way.reshape(-1, shape[-1])
    straight = as_plane(cv2.exp(-flat)) * np.float32(1 - _SCATTERED)
    straight += as_plane(cv2.exp(flat * np.float32(-_PENETRATION))) * np.float32(_SCATTERED)
    found = straight.reshape(shape)
    return np.flip(found, axis) if backwards else found


def _is_seen(gas: Field) -> NDArray[np.bool_]:
    """Return which cubes (layers, rows, columns) of gas show anything."""
    return (gas[..., FUEL] > _LEAST_FUEL) | (gas[..., SMOKE] > _LEAST_SMOKE)


@dataclass(frozen=True, slots=True)
class _Part:
    """The part of a layer in which something is seen.

    Attributes:
        ends: Rows and columns of cubes from the frame's top left corner to its ends.
        window: Where it is in the frame, px.
        pitch: Size of a cube, px.
    """

    ends: tuple[int, int]
    window: tuple[slice, slice]
    pitch: float

    def enlarged(
        self, layer: NDArray[np.float32], interpolation: int = cv2.INTER_LINEAR
    ) -> list[Plane]:
        """Return each channel of this part of a layer (rows, columns, n) in px."""
        rows, columns = self.ends
        return [
            enlarged(layer[:rows, :columns, channel], self.pitch, interpolation)[self.window]
            for channel in range(layer.shape[2])
        ]


def enlarged(
    layer: NDArray[np.float32], pitch: float, interpolation: int = cv2.INTER_LINEAR
) -> NDArray[np.float32]:
    """Return a layer whose cubes are ``pitch`` px wide, from the same top left corner."""
    return as_plane(
        cv2.resize(
            np.ascontiguousarray(layer), None, fx=pitch, fy=pitch, interpolation=interpolation
        )
    )


def _around(is_seen: NDArray[np.bool_], size: tuple[int, int], pitch: float) -> _Part:
    """Return the part of a layer's cubes in which something is seen, in a frame of (height, width)
    px."""
    ends, windows = [], []
    for axis, length in enumerate(size):
        places = np.flatnonzero(is_seen.any(axis=1 - axis))
        end = min(int(places[-1]) + 1 + _AROUND, is_seen.shape[axis])
        ends.append(end)
        begin = int(max(0, int(places[0]) - _AROUND) * pitch)
        windows.append(slice(begin, min(round(end * pitch), length)))
    return _Part((ends[0], ends[1]), (windows[0], windows[1]), pitch)
