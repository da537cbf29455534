"""The ramps that the tool brings along, those of colours and hues, and those of images."""

import colorsys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import Alpha, BlendSpace, encode_frame
from fire_atlas.atlas.sheet import RAMP_WIDTH
from fire_atlas.core.blackbody import blackbody
from fire_atlas.core.pixels import Bytes, as_plane, hex_to_srgb, premultiply, srgb_to_linear
from fire_atlas.effect.composition.cover import thin_cover
from fire_atlas.heat.ramp import finished_ramp

_Stops = tuple[tuple[float, str, float], ...]
"""Heat 0..1, straight colour and coverage 0..1 there."""

_STOPS: dict[str, _Stops] = {
    "campfire": (
        (0.0, "#3c0600", 0.0), (0.14, "#640c00", 0.22), (0.32, "#b42a00", 0.52),
        (0.52, "#ee6408", 0.8), (0.7, "#ffa024", 0.94), (0.87, "#ffd764", 1.0),
        (1.0, "#fff6d2", 1.0),
    ),
    "gas": (
        (0.0, "#00103c", 0.0), (0.16, "#0a2aa0", 0.2), (0.42, "#1e5cf0", 0.52),
        (0.66, "#46a0ff", 0.78), (0.86, "#96d8ff", 0.94), (1.0, "#f0fbff", 1.0),
    ),
    "copper": (
        (0.0, "#001e14", 0.0), (0.16, "#00643c", 0.2), (0.42, "#00be78", 0.52),
        (0.66, "#2deeb4", 0.78), (0.86, "#91ffe1", 0.94), (1.0, "#f2fff9", 1.0),
    ),
    "poison": (
        (0.0, "#0c1900", 0.0), (0.16, "#2a5a00", 0.22), (0.42, "#5ab400", 0.55),
        (0.66, "#9bf01e", 0.82), (0.86, "#d7ff5f", 0.96), (1.0, "#fbffdc", 1.0),
    ),
    "soul": (
        (0.0, "#190032", 0.0), (0.16, "#460a96", 0.22), (0.42, "#8c2ee6", 0.55),
        (0.66, "#c468ff", 0.82), (0.86, "#ebafff", 0.96), (1.0, "#fff5ff", 1.0),
    ),
    "frost": (
        (0.0, "#0a2846", 0.0), (0.16, "#2d6ea5", 0.16), (0.42, "#64b4dc", 0.42),
        (0.66, "#aae1f5", 0.7), (0.86, "#e1f7ff", 0.92), (1.0, "#ffffff", 1.0),
    ),
}  # fmt: skip

_KELVIN = 1000.0, 3600.0
"""Temperatures of the coldest and the hottest entry of a black body."""

_EXPOSURE = 5.0
"""Of the hottest entry of a black body, over that which film shows at 1 - 1/e."""


_TINTS = (
    (0.0, 0.2, 1.0, 0.0), (0.16, 0.55, 0.95, 0.22), (0.42, 0.9, 0.82, 0.55),
    (0.66, 1.0, 0.6, 0.82), (0.86, 1.0, 0.32, 0.96), (1.0, 1.0, 0.04, 1.0),
)  # fmt: skip
"""Of a ramp of one hue: heat 0..1, brightest channel, saturation and coverage there."""

NATURAL = "campfire"
"""The ramp of a natural fire."""

RampLight = NDArray[np.float32]
"""(256, 4): the light of each entry of a ramp, linear and premultiplied, and its coverage."""


def ready_light(name: str) -> RampLight:
    """Return the light of a ready ramp."""
    if name != "blackbody":
        at, colours, covers = zip(*_STOPS[name], strict=True)
        shown = _between(at, hex_to_srgb(colours) / 255)
        return _premultiplied(shown, _between(at, np.array(covers)[:, None]))
    heat = np.linspace(0, 1, RAMP_WIDTH)
    kelvin = _KELVIN[0] + (_KELVIN[1] - _KELVIN[0]) * heat
    cover = np.minimum(1, 1.6 * heat)
    light = 1 - np.exp(-_EXPOSURE * blackbody(kelvin) * heat[:, None] ** 2)
    return np.column_stack([light, cover]).astype(np.float32)


def hue_light(hue: float) -> RampLight:
    """Return the light of the ramp of a hue, degrees."""
    at, values, saturations, covers = zip(*_TINTS, strict=True)
    tints = zip(saturations, values, strict=True)
    shown = np.array([colorsys.hsv_to_rgb(hue / 360, *tint) for tint in tints])
    return _premultiplied(_between(at, shown), _between(at, np.array(covers)[:, None]))


def colours_light(colours: Sequence[str]) -> RampLight:
    """Return the light of the ramp of sRGB hex colours, evenly spaced, that covers as much as a
    natural fire."""
    at = np.linspace(0, 1, len(colours)).tolist()
    return _premultiplied(_between(at, hex_to_srgb(colours) / 255), ready_light(NATURAL)[:, 3:])


def _between(at: Sequence[float], stops: NDArray[Any]) -> NDArray[np.float64]:
    """Return each channel of ``stops`` (n, channels) ``at`` these heats for all of a ramp's."""
    heat = np.linspace(0, 1, RAMP_WIDTH)
    return np.column_stack([np.interp(heat, at, channel) for channel in stops.T])


def _premultiplied(straight: NDArray[np.float64], cover: NDArray[np.floating]) -> RampLight:
    """Return the light of straight sRGB colours (256, 3), 0..1, and their coverage (256, 1)."""
    coverage = as_plane(cover).T
    return as_plane(premultiply(srgb_to_linear(straight)[None], coverage)[0])


def ramp_of_light(row: RampLight, alpha: Alpha, blend_space: BlendSpace, *, thins: bool) -> Bytes:
    """Return the ramp (256, 4) that is nearest to linear premultiplied light (256, 4); settings as
    of ``Atlas``."""
    light = row[None]
    cover = thin_cover(light, np.zeros_like(light[..., 3]), blend_space) if thins else None
    curve = encode_frame(light, alpha, blend_space, cover)[0].astype(np.float64)
    return finished_ramp(curve, alpha, blend_space)
