"""Embers for players to draw: as the tracks state them, and as our own frames show them."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import encode_unit, expose
from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks

SIDE = 100
"""Width and height of a frame, px."""

Picture = NDArray[np.float64]
"""(SIDE, SIDE, 3) sRGB, 0..255 in whole steps unless stated otherwise."""

_COLOUR = 1.0, 0.13, 0.021


def ember(light: float, size: float, **known: float) -> NDArray[np.float64]:
    """Return an ember as a row of the tracks: round and in the middle, unless stated otherwise."""
    row = dict.fromkeys(COLUMNS, 0.0) | {"x": 49.6, "y": 50.3, "stretch": 1.0, "tail": 1.0}
    row |= dict(zip("rgb", _COLOUR, strict=True)) | {"a": light, "size": size, "life": 1.0}
    return np.array([(row | known)[name] for name in COLUMNS])


SINGLE = {
    "dim": ember(0.05, 10.0),
    "middling": ember(0.7, 10.0, stretch=2.4, rotation=-0.9, tail=0.5),
    "bright": ember(9.0, 18.0, stretch=1.6, rotation=2.2, tail=0.7),
    "brightest": ember(110.0, 24.0, stretch=1.3, rotation=0.4, tail=0.8),
    "long": ember(2.0, 10.0, stretch=5.0, rotation=-2.0, tail=0.45),
    "blurred": ember(0.3, 20.0, blur=12.0),
    "coloured": ember(3.0, 16.0, r=0.02, g=0.4, b=1.0),
}
"""Embers of every kind, so large that it matters little where rasterisers put corners of quads
(SwiftShader: on sixteenths of a pixel), and that samples at the centres of pixels add up."""


SMALL = {
    "thin": ember(0.6, 1.9, x=49.9, y=50.6),
    "typical": ember(1.0, 2.8, stretch=1.7, rotation=-1.3, tail=0.8),
    "fast": ember(20.0, 3.3, stretch=3.0, rotation=0.5, tail=0.5),
}
"""Embers as small as most are in frames 320 px high."""


def overlapping() -> NDArray[np.float64]:
    """Return embers of all kinds that lie over each other."""
    rows = np.array([*SINGLE.values()])
    x, y = np.random.default_rng(5).uniform(38, 62, (2, len(rows)))
    rows[:, COLUMNS.index("x")], rows[:, COLUMNS.index("y")] = x, y
    rows[:, 0] = np.arange(len(rows))
    return rows


def tracks_of(rows: NDArray[np.float64], frames: int = 9) -> Tracks:
    """Return the tracks of a loop that shows the same embers in all its frames."""
    rows = rows.reshape(-1, len(COLUMNS))
    spawns = np.ones((len(rows), len(SPAWN_COLUMNS)))
    spawns[:, 0] = spawns[:, SPAWN_COLUMNS.index("x")] = rows[:, 0]
    return replace(Tracks.one_shot(24, (SIDE, SIDE), 0, spawns, [rows] * frames), loop=True)


def shown(light: NDArray[np.floating]) -> Picture:
    """Return what film shows of linear light, as sRGB 0..255."""
    picture: Picture = encode_unit(expose(light.astype(np.float32))).astype(float) * 255
    return np.rint(picture)


def own_frame(rows: NDArray[np.float64]) -> Picture:
    """Return what our own frame shows of embers over black."""
    return shown(draw_flakes(rows.reshape(-1, len(COLUMNS)), SIDE, SIDE).rgb())


def sampled(rows: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Yield the linear light of each ember at the centres of pixels, as ``Tracks`` states it."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    for row in rows.reshape(-1, len(COLUMNS)):
        column = dict(zip(COLUMNS, row, strict=True))
        cos, sin = np.cos(column["rotation"]), np.sin(column["rotation"])
        dx, dy = x - column["x"], y - column["y"]
        along, across = dx * cos + dy * sin, dy * cos - dx * sin
        rgb = np.array([column[name] for name in "rgb"]) * column["a"]
        length, width = column["size"] * column["stretch"], column["size"]
        light = np.zeros((SIDE, SIDE))
        for wider, share in ((0, 1), (1.5 * width, 0.004)):
            u, v = 2 * along / (length + wider), 2 * across / (width + wider)
            inside = np.maximum(1 - np.abs(u) ** 3 - v**2, 0)
            light += share * (column["tail"] + (1 - column["tail"]) * (1 + u) / 2) * inside**3
        yield light[..., None] * rgb


def blended(rows: NDArray[np.float64], blend: Callable[[Picture, Picture], Picture]) -> Picture:
    """Return embers over black that a client shows one by one.

    ``blend(ember, behind)`` is what it shows of two pictures, sRGB 0..1; each is kept in bytes.
    """
    picture = np.zeros((SIDE, SIDE, 3))
    for light in sampled(rows):
        picture = np.rint(blend(shown(light) / 255, picture / 255) * 255)
    return picture
