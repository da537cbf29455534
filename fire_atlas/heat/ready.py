"""The ramps that the tool brings along, and those of images."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import Alpha, BlendSpace, encode_frame
from fire_atlas.atlas.sheet import RAMP_WIDTH
from fire_atlas.core.blackbody import blackbody
from fire_atlas.core.pixels import Bytes, hex_to_srgb, premultiply, srgb_to_linear
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


def ready_ramp(name: str, alpha: Alpha, blend_space: BlendSpace) -> Bytes:
    """Return a ready ramp (256, 4) for pages with these settings."""
    heat = np.linspace(0, 1, RAMP_WIDTH)
    if name == "blackbody":
        kelvin = _KELVIN[0] + (_KELVIN[1] - _KELVIN[0]) * heat
        cover = np.minimum(1, 1.6 * heat)
        light = 1 - np.exp(-_EXPOSURE * blackbody(kelvin) * heat[:, None] ** 2)
        row = np.column_stack([light, cover]).astype(np.float32)
    else:
        at, colours, covers = zip(*_STOPS[name], strict=True)
        shown = hex_to_srgb(colours) / 255
        straight = np.column_stack([np.interp(heat, at, shown[:, i]) for i in range(3)])
        cover = np.interp(heat, at, covers).astype(np.float32)
        row = premultiply(srgb_to_linear(straight)[None], cover[None])[0]
    return ramp_of_light(row, alpha, blend_space)


def ramp_of_light(row: NDArray[np.float32], alpha: Alpha, blend_space: BlendSpace) -> Bytes:
    """Return the ramp (256, 4) that is nearest to linear premultiplied light (256, 4)."""
    curve = encode_frame(row[None], alpha, blend_space)[0].astype(np.float64)
    return finished_ramp(curve, alpha, blend_space)
