"""The light of an image on a sheet."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import hex_to_linear
from fire_atlas.generators.silk.fuel import Fuel
from fire_atlas.generators.silk.grading import body_colours, graded, light_table, ramp_colours

_BLUE = "#3050ff"
_FOOT = 0.1
"""Height of the blue foot, sheet heights."""

_DARK_FOOT = 0.26
"""Height up to which such a flame is darker, sheet heights: soot has yet to form."""

_HOTTER = 0.15
"""How much hotter than at its own speed, and no more, a fast black body is."""

_THIN = np.array([1.0, 1.7, 3.0])

_SHADES = 24
"""Tables of black bodies, from the coolest sheet to the hottest."""


@dataclass(frozen=True, slots=True)
class Tint:
    """From images to light.

    Attributes:
        tables: (shades, 512, 3) light by heat; one shade, or several from slow to fast sheets.
        speed: v_rms at the middle of the shades, heights/s.
        gain: What images that are light already are multiplied with.
        thin: (3,) powers of how much of a sheet shows, for red, green and blue: thin fire is not
            only dimmer but nearer to the cool end of its colours.
        blue: (3,) light of the blue foot.
    """

    tables: NDArray[np.float32]
    speed: float
    gain: float
    thin: NDArray[np.float64] = field(default_factory=lambda: _THIN)
    blue: NDArray[np.float32] = field(default_factory=lambda: np.zeros(3, np.float32))

    @classmethod
    def of(cls, fuel: Fuel, grading: str, gain: float) -> "Tint":
        """Tint of ``fuel`` by its own colours or a black body's, ``gain`` times as bright."""
        light = fuel.light * gain
        if grading == "blackbody":
            hottest = fuel.temperature * (1 + _HOTTER * np.linspace(-1, 1, _SHADES))
            colours = [body_colours(kelvin) for kelvin in hottest]
        else:
            colours = [ramp_colours(fuel.ramp, fuel.reach)]
        tables = np.stack([light_table(each, light, fuel.contrast) for each in colours])
        (blue,) = hex_to_linear([_BLUE])
        # Red fire thins to red, blue fire to blue.
        (cool,) = hex_to_linear(fuel.ramp[:1])
        thin = _THIN if grading == "blackbody" or cool[0] > cool[2] else _THIN[::-1]
        return cls(tables, fuel.speed, gain, thin, blue * np.float32(fuel.blue * gain))

    def light(self, image: NDArray[np.float32], v_rms: float) -> NDArray[np.float32]:
        """Light (height, width, 3) of an image of heat (..., 1) or light (..., 3)."""
        if image.shape[2] == 3:
            return image * np.float32(self.gain)
        heat = image[..., 0]
        lit = graded(heat, self.tables[self._shade(v_rms)])
        if not self.blue.any():
            return lit
        height = len(heat)
        up = ((height - np.arange(height, dtype=np.float32)) / height)[:, None, None]
        foot, sooty = np.exp(-((up / _FOOT) ** 2)), 1 - np.exp(-((up / _DARK_FOOT) ** 2))
        return np.asarray(lit * sooty + heat[..., None] * foot * self.blue, np.float32)

    def _shade(self, v_rms: float) -> int:
        """The table for a sheet: temperature goes with v_rms² (eq. 20), up to a limit."""
        energy = (v_rms / self.speed) ** 2
        return round((len(self.tables) - 1) * energy / (1 + energy))
