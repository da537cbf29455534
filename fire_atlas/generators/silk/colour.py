"""Convert heat to light, with the colours of a fuel or of a black body, and expose the result."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.blackbody import radiance
from fire_atlas.core.easing import saturated, smooth_step
from fire_atlas.core.pixels import REC709, Plane, as_plane, srgb_to_linear
from fire_atlas.generators.silk.fuel import Fuel
from fire_atlas.generators.silk.texture_loop import Image
from fire_atlas.vision.warp import sample_at

_HEAT = np.linspace(0.0, 1.25, 512)
"""Values of heat for which light is tabulated."""

_TABLES = 25
"""Number of tables for black bodies, from the slowest sheets to the fastest."""

_TEMPERATURE_RANGE = 0.15
"""Relative difference in temperature between a sheet at the reference speed and the fastest."""

_MOST_BRIGHTENED = 4.0
"""Limit of how many times as bright as a sheet at the reference speed the fastest is, and of how
many times dimmer the slowest is. Planck's law has three to ten, by fuel."""

_WIEN = 2.6e4
"""hc/λk at 555 nm, K: light of a temperature T is about proportional to exp(−hc/λkT) (Wien)."""

_OPACITY_EXPONENTS = np.array([1.0, 1.7, 3.0])
"""Exponents for red, green and blue of a warm fire, so that thin fire is dimmer and redder."""

_BLUE = "#3050ff"
_BLUE_HEIGHT, _SOOT_HEIGHT = 0.12, 0.4
"""Height of a blue foot, above which soot has formed that hides what is behind it; and height up to
which the soot is still so cool that the flame is dim: sheet heights."""

_DENSE_HEAT = 0.3
"""Heat (or light, of images of light) from which on a flame is as dense as it can be."""


_SPILL, _SPILLS_FROM = np.float32(0.45), np.float32(4.0)
"""Part of light far beyond white that exposes the neighbouring colours too, and the light of which
half as large a part does."""


def expose(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return HDR light (..., 3) as a camera exposes it, 0..1: channels saturate one by one.

    Light far beyond white spills into the neighbouring colours, as in film and in the eye: red and
    blue into green, green into both. So the densest fire is nearly white and not yellow, and dim
    fire keeps its colour.
    """
    red, green, blue = np.moveaxis(light, -1, 0)
    green = green + _spilled(red) + _spilled(blue)
    beside = _spilled(green)
    spilled = np.stack([red + beside, green, blue + beside], axis=-1)
    return saturated(spilled)


def unexposed(shown: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the light (..., 3) of which ``expose`` shows ``shown``, 0 or more and less than 1;
    where there is none, the nearest."""
    red, green, blue = np.moveaxis(-np.log1p(-shown), -1, 0)
    beside = _spilled(green)
    red, blue = np.maximum(red - beside, 0), np.maximum(blue - beside, 0)
    green = np.maximum(green - _spilled(red) - _spilled(blue), 0)
    return np.asarray(np.stack([red, green, blue], axis=-1), np.float32)


def _spilled(light: Plane) -> Plane:
    """Return what a channel's light adds to a neighbouring colour: next to none below white."""
    square = light * light
    return as_plane(_SPILL * light * square / (square + _SPILLS_FROM * _SPILLS_FROM))


@dataclass(frozen=True, slots=True)
class ColourMap:
    """Converts images of heat to light, and scales images of light.

    Attributes:
        tables: (n, 512, 4) light and optical depth by heat: one table, or several from slow to
            fast sheets.
        reference_speed: v_rms of a sheet that uses the middle table, heights/s.
        gain: Factor for images of light.
        opacity_exponents: (3,) exponents of a sheet's opacity for red, green and blue.
        blue: (3,) light of the flame's blue foot; 0 for none.
        soot: Optical depth of the hottest part.
    """

    tables: NDArray[np.float32]
    reference_speed: float
    gain: float
    opacity_exponents: NDArray[np.float64]
    blue: NDArray[np.float32]
    soot: float

    @classmethod
    def of(cls, fuel: Fuel, grading: str, oxygen: float, gain: float, soot: float) -> Self:
        """Return the colour map of a fuel that burns in ``oxygen``, 1: as much as usual; its light
        and soot are multiplied by ``gain`` and ``soot``.

        ``grading`` is ``fuel`` (its own colours) or ``blackbody``.
        """
        exponents = _OPACITY_EXPONENTS
        brightness = fuel.brightness * oxygen * gain
        if grading == "blackbody":
            hottest = fuel.temperature * oxygen**0.2
            light = _blackbody_light(hottest, fuel.contrast)
        else:
            stops = _linear_of_hex(fuel.ramp)
            white_hot = _linear_of_hex([fuel.white_hot])[0]
            colours = _ramp_colours(stops, white_hot, oxygen**0.6)
            light = colours[None] * (_HEAT**fuel.contrast)[:, None]
            # Thin parts of a red fire are redder, those of a blue fire bluer.
            exponents = exponents if stops[0, 0] > stops[0, 2] else exponents[::-1]
        depth = soot * fuel.soot * smooth_step(_HEAT / _DENSE_HEAT)
        tables = np.dstack([brightness * light, np.broadcast_to(depth, light.shape[:2])])
        blue = _linear_of_hex([_BLUE])[0] * np.float32(fuel.blue_light * gain)
        return cls(
            as_plane(tables), fuel.reference_speed, gain * oxygen, exponents, blue, fuel.soot * soot
        )

    @property
    def dimming(self) -> NDArray[np.float64]:
        """How much an optical depth dims red, green and blue, (3,), in the mean over luminance 1.

        Grey dimming would show a bright flame behind another as mud. So light that has passed a
        flame has the tint of thin flame: soot absorbs the more, the shorter the wavelength.
        """
        return np.asarray(self.opacity_exponents / (self.opacity_exponents @ REC709), np.float64)

    def light(self, image: Image, v_rms: float) -> NDArray[np.float32]:
        """Return light (height, width, 3) and optical depth of the flame and soot, as a fourth
        channel, of an image on a sheet that moves at ``v_rms``."""
        if image.shape[2] == 3:
            dense = np.float32(self.soot) * smooth_step(image.max(axis=-1) / _DENSE_HEAT)
            light = np.dstack([image * np.float32(self.gain), dense])
        else:
            light = _look_up(image[..., 0], self.tables[self._table_index(v_rms)])
        if self.blue.any():
            if image.shape[2] == 1:
                foot = np.exp(-((_up(light) / _BLUE_HEIGHT) ** 2))[:, None, None]
                light[..., :3] *= _risen(light, _SOOT_HEIGHT)[:, None, None]
                light[..., :3] += image * foot * self.blue
            light[..., 3] *= _risen(light, _BLUE_HEIGHT)[:, None]
        return light

    def _table_index(self, v_rms: float) -> int:
        """Return a sheet's table index: temperature grows with v_rms² (eq. 20), up to a limit."""
        energy = (v_rms / self.reference_speed) ** 2
        return round((len(self.tables) - 1) * energy / (1 + energy))


def _up(image: Image) -> NDArray[np.float32]:
    """Return the height of each row of an image above its lower edge, 0..1."""
    height = len(image)
    return np.asarray((height - np.arange(height, dtype=np.float32)) / height, np.float32)


def _risen(image: Image, height: float) -> NDArray[np.float32]:
    """Return a factor for each row of an image: 0 at its lower edge, about 1 above ``height``."""
    return np.asarray(1 - np.exp(-((_up(image) / height) ** 2)), np.float32)


def _linear_of_hex(colours: Sequence[str]) -> NDArray[np.float32]:
    """Return the linear light (n, 3) of sRGB colours like ``#ff8000``."""
    values = [[int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)] for colour in colours]
    return srgb_to_linear(np.array(values))


def _ramp_colours(
    stops: NDArray[np.float32], white_hot: NDArray[np.float32], end: float
) -> NDArray[np.float64]:
    """Return linear colours (512, 3) of ``_HEAT`` on a ramp of evenly spaced ``stops`` (n, 3) up to
    the position 1, and on to ``white_hot`` (3,) at 2.

    A heat of 1 is at the position ``end`` of the ramp; with no more oxygen than usual, 1, no heat
    goes beyond the stops.
    """
    at = np.append(np.linspace(0.0, 1.0, len(stops)), 2.0)
    place = np.minimum(_HEAT, 1.0) * end
    channels = np.vstack([stops, white_hot]).astype(np.float64).T
    return np.stack([np.interp(place, at, channel) for channel in channels], axis=1)


@lru_cache(maxsize=8)  # the fires of a fuel differ in their gain alone
def _blackbody_light(hottest: float, contrast: float) -> NDArray[np.float64]:
    """Return the light (n, 512, 3) of ``_HEAT`` as that of black bodies, from slow sheets to fast.

    Hue and brightness are both Planck's (eq. 16). A heat is the temperature at which, by Wien's
    approximation, a body's light is heat to the power of ``contrast`` of that of heat 1, as with a
    fuel's own colours. Heat 1 on a sheet at the reference speed is at ``hottest`` K, has a light of
    1 in its brightest channel, and faster sheets are brighter by Planck's law, up to
    ``_MOST_BRIGHTENED``.
    """
    light = []
    unit = float(radiance(np.array([hottest])).max())
    for speed in np.linspace(-1, 1, _TABLES):
        peak = hottest * (1 + _TEMPERATURE_RANGE * speed)
        kelvin = 1 / (1 / peak - contrast * np.log(np.maximum(_HEAT, 1e-3)) / _WIEN)
        brighter = float(radiance(np.array([peak])).max()) / unit
        limited = np.clip(brighter, 1 / _MOST_BRIGHTENED, _MOST_BRIGHTENED)
        light.append(radiance(kelvin) * (limited / brighter / unit))
    return np.stack(light)


def _look_up(heat: Plane, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the row of a table (512, 4) for each ``heat``, interpolated: (height, width, 4)."""
    at = heat * np.float32((len(_HEAT) - 1) / _HEAT[-1])
    return sample_at(table[None], at, np.zeros_like(at))
