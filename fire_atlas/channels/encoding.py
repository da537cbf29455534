"""Encode motion vectors as the shaders of each engine decode them: signs, unit, bytes, formula.

All that draws vectors, tests them, describes them in files or shows them looks the encoding up here
by the engine's name. Inside the tool y points down; the green of an engine whose V grows upwards is
negated here.
"""

from dataclasses import dataclass
from typing import Literal, assert_never

import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.flow import Vectors
from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.recipe.output import Engine


@dataclass(frozen=True, slots=True)
class MotionEncoding:
    """How one engine's formula decodes a texel of motion vectors.

    A byte b stands for (b − ``zero``) / ``span`` of the scale, which is the motion of a decoded 1.

    Attributes:
        engine: Name of the engine.
        green: Direction of values above neutral in G. In R that is always right.
        zero, span: Of the bytes. Where ``zero`` is no whole number, no byte means "no motion":
            the nearest drifts by half a step, 1/255 of the scale.
        unit: Of the scale: the UV of one ``cell``, 0..1, or a ``pixel`` of the sheet.
        decode: The formula that turns a sample, 0..1, into -1..1.
        this, following: Where the current frame and the next one are sampled.
    """

    engine: Engine
    green: Literal["up", "down"]
    zero: float
    span: float
    unit: Literal["cell", "pixel"]
    decode: str
    this: str
    following: str

    @property
    def neutral(self) -> int:
        """The byte that means "no motion", or comes nearest."""
        return int(np.ceil(self.zero))

    @property
    def green_of_down(self) -> int:
        """Sign that motion downwards has in G: 1 or -1."""
        return 1 if self.green == "down" else -1

    def unit_pixels(self, cell: tuple[int, int] | None) -> tuple[float, float]:
        """Return how many px one unit of the scale is, along x and y, in cells of that size, px."""
        if self.unit == "pixel":
            return 1.0, 1.0
        assert cell is not None, "recipes with this unit have cells"
        return float(cell[0]), float(cell[1])

    def encode(self, share: Vectors) -> Bytes:
        """Return R and G, (h, w, 2) uint8, of vectors as shares of the scale, y down."""
        signed = share * np.array([1, self.green_of_down], np.float32)
        clipped = np.clip(signed, -1, 1) * np.float32(self.span) + np.float32(self.zero)
        # Upwards from between two bytes, so that no motion is the neutral byte.
        return np.asarray(np.clip(np.floor(clipped + np.float32(0.5)), 0, 255), np.uint8)

    def decoded(self, red_green: NDArray[np.uint8]) -> Vectors:
        """Return vectors decoded by the engine's formula from bytes (h, w, 2): its axes, -1..1."""
        return as_plane((red_green - np.float32(self.zero)) / np.float32(self.span))


_UV = ("rg * 2 - 1", "uv - mv * scale * blend", "uv + mvNext * scale * (1 - blend)")


def motion_encoding(engine: Engine) -> MotionEncoding:
    """Return how ``engine`` encodes motion vectors."""
    match engine:
        case "unity":
            return MotionEncoding("unity", "up", 127.5, 127.5, "cell", *_UV)
        case "unreal":
            return MotionEncoding("unreal", "down", 127.5, 127.5, "cell", *_UV)
        case "godot":
            return MotionEncoding(
                "godot", "down", 128, 127, "pixel", "(rg * 255 - 128) / 127",
                "position - mv * scale * blend", "position + mvNext * scale * (1 - blend)",
            )  # fmt: skip
        case _:
            assert_never(engine)
