"""Draw gas: light that hot soot gives along the lines of sight, and smoke in the light about it.

What absorbs light gives as much of it as its temperature says (Kirchhoff's law): fuel that burns,
and the smoke that it leaves while that is hot. So smoke cools from glowing to black, from outside.
"""

import math
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

_KEY, _AMBIENT = np.array([1.6, 1.52, 1.42]), np.array([0.13, 0.155, 0.19])
"""Light from above, left and front on smoke, and from all sides."""

_SCATTERED, _PENETRATION = (0.14, 0.36), 0.3
"""Part of that light that reaches black smoke after several turns, and what white smoke, which
keeps none of it, adds to that; and the optical depth of its way, of that of the straight one."""

_FRESH, _BLACK = 0.7, 0.85
"""Temperature from which on soot is as fresh as it gets, and part of the light that such soot does
not scatter: it is black, and gets paler as it ages."""

_GLOW_REACH = 0.035
"""Standard deviation, heights, of the glow of fire in its smoke; a wider one has twice that."""

_LEAST_FUEL, _LEAST_SMOKE, _LEAST_LIGHT = 1e-3, 2e-3, 1e-3
"""Values up to which nothing is seen of gas, and of its light."""

_SOFT = 0.008
"""Standard deviation, heights, by which flames are softened along the lines of sight."""

_AROUND = 2
"""Cubes around what is seen of a layer that are drawn too: a bicubic filter reaches them."""


@dataclass(frozen=True, slots=True)
class SeenGas:
    """A picture of gas before it is exposed.

    Attributes:
        fire: (height, width, 3) light of what is hot, and the fire's glow in its smoke, as it is
            seen through smoke.
        smoke: (height, width, 3) daylight that smoke scatters, seen likewise.
        depth: (height, width) optical depth of the smoke.
    """

    fire: NDArray[np.float32]
    smoke: NDArray[np.float32]
    depth: Plane


@dataclass(frozen=True, slots=True)
class LitSmoke:
    """The light that falls on smoke.

    Attributes:
        light: (layers, rows, columns, 2 or 3) of that from above, left and front, and of that from
            all sides, the share which reaches each cube; and the light of the fire, if any.
        glow: (3,) colour of the fire's.
    """

    light: NDArray[np.float32]
    glow: NDArray[np.float64]


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
        """Light of opaque gas by its temperature, (3, entries)."""
        look, hot = self.look, np.linspace(0, _HOTTEST, _STEPS)
        kelvin = look.coldest + (look.hottest - look.coldest) * hot
        bright = np.clip((hot - _DARK) / (1 - _DARK), 0, None) ** look.contrast
        opaque = look.emission / look.absorption if look.emission else 0.0
        return as_plane((opaque * blackbody(kelvin) * bright[:, None]).T)

    def draw(self, gas: Field, size: tuple[int, int], pitch: float) -> SeenGas:
        """Draw gas (layers, rows, columns, 4) into a frame of (height, width) px, from the nearest
        layer to the farthest; ``pitch`` is the size of a cube, px."""
        # Light by channel in planes: numpy is slow along an axis of three.
        fire, (key, around, glow) = (np.zeros((3, *size), np.float32) for _ in range(2))
        depth, passed = np.zeros(size, np.float32), np.ones(size, np.float32)
        gas = self._without_cubes(gas)
        smoke, is_seen = self.lit_smoke(gas), self._is_seen(gas)
        for number in np.flatnonzero(is_seen.any(axis=(1, 2))):
            part = _around(is_seen[number], size, pitch)
            layer, front = gas[number], passed[part.window]
            thick = np.zeros(front.shape, np.float32)
            if smoke is not None:
                (sooty,) = part.enlarged(layer[..., SMOKE : SMOKE + 1], cv2.INTER_CUBIC)
                thick = as_plane(self.smoke(sooty) * np.float32(self.look.extinction))
                depth[part.window] += thick
            own, fuel = thick, np.zeros((1, 1), np.float32)
            if burns := bool((layer[..., FUEL] > _LEAST_FUEL).any()):
                (fuel,) = part.enlarged(layer[..., FUEL : FUEL + 1], cv2.INTER_CUBIC)
                own = as_plane(thick + np.float32(self.look.absorption) * self.burning(fuel))
            kept = as_plane(cv2.exp(own * np.float32(-self.cell)))
            hidden = front * (1 - kept)
            if burns or self._glows(layer):
                (hot,) = part.enlarged(layer[..., TEMPERATURE : TEMPERATURE + 1], cv2.INTER_CUBIC)
                entry = self._entry(fuel, hot)
                for plane, light in zip(fire, self.table, strict=True):
                    plane[part.window] += light.take(entry) * hidden
            if smoke is not None:
                share = hidden * thick / (own + np.float32(1e-6)) if burns else hidden
                lights = part.enlarged(smoke.light[number])
                for plane, light in zip((key, around, glow), lights, strict=False):
                    plane[part.window] += light * share
            front *= kept
        albedo = np.array(self.look.albedo)
        scattered = [
            np.float32(of_key) * key + np.float32(of_all) * around
            for of_key, of_all in zip(albedo * _KEY, albedo * _AMBIENT, strict=True)
        ]
        if glow.any() and smoke is not None:
            for plane, colour in zip(fire, albedo * smoke.glow, strict=True):
                plane += np.float32(colour) * glow
        depth *= np.float32(self.cell)
        return SeenGas(as_plane(cv2.merge(list(fire))), as_plane(cv2.merge(scattered)), depth)

    def smoke_depth(self, gas: Field, size: tuple[int, int], pitch: float) -> Plane:
        """Return the optical depth of the smoke of gas alone, as ``draw`` does but for edges finer
        than a cube, in less time."""
        if not self._has_smoke(gas):
            return np.zeros(size, np.float32)
        sooty = self.smoke(_without_weave(gas)).sum(axis=0)
        seen = enlarged(as_plane(sooty), pitch, cv2.INTER_CUBIC)[: size[0], : size[1]]
        return as_plane(np.maximum(seen, 0) * np.float32(self.look.extinction * self.cell))

    def _without_cubes(self, gas: Field) -> Field:
        """Return gas without what its cubes would show of themselves.

        Flames are smooth from layer to layer: one that is thinner than a layer, and lies aslant,
        would be a flight of steps. Smoke is so from cube to cube.
        """
        beside = np.float32(min(_SOFT**2 / (2 * self.cell**2), 0.25))
        found = np.pad(gas, ((1, 1), (0, 0), (0, 0), (0, 0)), mode="edge")
        found = as_plane((1 - 2 * beside) * found[1:-1] + beside * (found[:-2] + found[2:]))
        if self._has_smoke(gas):
            found[..., SMOKE] = _without_weave(gas)
        return found

    def burning(self, fuel: Plane) -> Plane:
        """Return how much gas burns by its fuel: thin one less, and least where it is whole."""
        look = self.look
        core = np.clip((fuel - np.float32(_CORE)) / np.float32(1 - _CORE), 0, 1)
        return as_plane(
            smooth_step(fuel / np.float32(look.dense)) * (1 - np.float32(look.hollow) * core)
        )

    def smoke(self, sooty: Plane) -> Plane:
        """Return how dense smoke is drawn by how dense it is: thin smoke less, so that it has edges
        finer than a cube, and is torn where it thins."""
        if not self.look.thin:
            return np.maximum(sooty, 0)
        return as_plane(sooty * smooth_step(sooty * np.float32(1 / self.look.thin)))

    def emission(self, gas: Field) -> NDArray[np.float32]:
        """Return the light that a height of gas (..., 4) gives, (..., 3)."""
        look, fuel = self.look, gas[..., FUEL]
        own = np.float32(look.absorption) * self.burning(fuel)
        own += np.float32(look.extinction) * self.smoke(gas[..., SMOKE])
        entry = self._entry(fuel, gas[..., TEMPERATURE])
        return np.stack([light.take(entry) * own for light in self.table], axis=-1)

    def _glows(self, layer: Field) -> bool:
        """Return whether gas (rows, columns, 4) is so hot that its smoke gives light."""
        return float(layer[..., TEMPERATURE].max()) * _FED * self.heat > self._dull

    @cached_property
    def _dull(self) -> float:
        """The temperature up to which nothing is seen of the light of opaque gas."""
        seen = self.table.max(axis=0) > _LEAST_LIGHT
        return float(np.argmax(seen)) * _HOTTEST / (_STEPS - 1) if seen.any() else math.inf

    def _entry(self, fuel: Plane, hot: Plane) -> NDArray[np.intp]:
        """Return the entry of the table that gas shows."""
        fed = np.float32(_FED) + np.float32(1.1 - _FED) * np.minimum(
            fuel * np.float32(_FED_FROM), 1
        )
        shown = hot * fed * np.float32(self.heat * (_STEPS - 1) / _HOTTEST)
        return np.asarray(np.clip(shown, 0, _STEPS - 1), np.intp)

    def lit_smoke(self, gas: Field) -> LitSmoke | None:
        """Return the light that falls on smoke; None without smoke."""
        if not self._has_smoke(gas):
            return None
        thickness = self.smoke(gas[..., SMOKE]) * np.float32(self.look.extinction * self.cell)
        glow, colour = self._glow(gas)
        light = np.empty((*thickness.shape, 2 if glow is None else 3), np.float32)
        sun = self._passed(_aslant(thickness))
        front, top, left = (_along(thickness, axis) for axis in range(3))
        right = thickness.sum(axis=2, keepdims=True) - left
        around = 0.25 * self._passed(front) + 0.35 * self._passed(top)
        around += 0.2 * self._passed(left) + 0.2 * self._passed(right)
        if self.look.emission:
            fresh = np.minimum(gas[..., TEMPERATURE] * np.float32(self.heat / _FRESH), 1)
            pale = 1 - np.float32(_BLACK) * fresh
            sun *= pale
            around *= pale
        light[..., 0], light[..., 1] = sun, around
        if glow is not None:
            light[..., 2] = glow
        return LitSmoke(light, colour)

    def _glow(self, gas: Field) -> tuple[Field | None, NDArray[np.float64]]:
        """Return the light of the fire on its smoke (layers, rows, columns), from every second
        cube, and its colour; None for a fire that gives none."""
        emission = self.emission(np.ascontiguousarray(gas[::2, ::2, ::2]))
        colour = emission.sum(axis=(0, 1, 2), dtype=np.float64)
        if not colour.any():
            return None, colour
        bright = emission.sum(axis=3)
        sigma = _GLOW_REACH / (2 * self.cell)
        near, far = (
            gaussian_filter(bright, reach, mode="constant", truncate=3)
            for reach in (sigma, 2.2 * sigma)
        )
        glow = (near + np.float32(1.5) * far) * np.float32(self.look.glow / self.look.emission)
        for axis, length in enumerate(gas.shape[:3]):
            glow = glow.repeat(2, axis=axis).take(np.arange(length), axis=axis)
        return glow, colour / colour.sum()

    def _passed(self, way: Field) -> Field:
        """Return the share of light, 0..1, that is left in smoke after an optical depth."""
        black, white = _SCATTERED
        scattered = black + white * sum(self.look.albedo) / 3
        flat = way.reshape(-1, way.shape[-1])
        straight = as_plane(cv2.exp(-flat)) * np.float32(1 - scattered)
        straight += as_plane(cv2.exp(flat * np.float32(-_PENETRATION))) * np.float32(scattered)
        return straight.reshape(way.shape)

    def _is_seen(self, gas: Field) -> NDArray[np.bool_]:
        """Return which cubes (layers, rows, columns) of gas show anything."""
        return (gas[..., FUEL] > _LEAST_FUEL) | (self.smoke(gas[..., SMOKE]) > _LEAST_SMOKE)

    def _has_smoke(self, gas: Field) -> bool:
        return self.look.extinction > 0 and gas[..., SMOKE].max(initial=0) > _LEAST_SMOKE


def exposed(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return light (height, width, 3) as a camera exposes it, 0..1: each channel saturates by
    itself, and a little of it exposes the others."""
    mixed = as_plane(cv2.transform(light, np.eye(3) + _CROSSTALK))
    return 1 - as_plane(cv2.exp(-mixed))


def _without_weave(gas: Field) -> Field:
    """Return the smoke of gas (layers, rows, columns, 4), smooth from cube to cube: what no step of
    the simulation sees is a pattern of threads in it."""
    return smoothed(np.ascontiguousarray(gas[..., SMOKE]), slice(0, len(gas)))


def _along(thickness: Field, axis: int) -> Field:
    """Return the optical depth of smoke from its front along an axis to each cube."""
    way = np.cumsum(thickness, axis=axis, dtype=np.float32)
    way -= thickness * np.float32(0.5)
    return way


def _aslant(thickness: Field) -> Field:
    """Return the optical depth of smoke from above, left and front to each cube: a ray gets half a
    cube to the right and half a cube away in each row."""
    way = np.empty_like(thickness)
    step = np.float32(math.sqrt(1.5))
    passed = np.zeros((thickness.shape[0], thickness.shape[2]), np.float32)
    for row in range(thickness.shape[1]):
        own = thickness[:, row] * step
        way[:, row] = passed + own * np.float32(0.5)
        onward = np.pad(passed + own, ((1, 0), (1, 0)))
        passed = onward[1:, 1:] + onward[:-1, 1:] + onward[1:, :-1] + onward[:-1, :-1]
        passed *= np.float32(0.25)
    return way


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
