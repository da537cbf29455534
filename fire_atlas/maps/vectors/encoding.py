"""Encode motion vectors as the shaders of each engine decode them: signs, unit, bytes, formula.

Code that draws, tests, describes or shows vectors looks the encoding up here by the engine's name.
Inside the tool y points down; green is negated here for engines whose V grows upwards.
"""

from dataclasses import dataclass
from typing import Literal, assert_never

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.maps.vectors.flow import Vectors
from fire_atlas.recipe.output import Engine


@dataclass(frozen=True, slots=True)
class MotionEncoding:
    """How one engine's formula decodes a texel of motion vectors.

    A byte b means a motion of (b − ``zero``) / ``span`` times the scale.

    Attributes:
        engine: Name of the engine.
        green: Direction of motion that G above neutral means; R above neutral means right.
        zero, span: Offset and range of the bytes. If ``zero`` is no whole number, no byte means "no
            motion": the nearest is off by half a step, 1/255 of the scale.
        unit: Unit of the scale: the UV of one ``cell``, 0..1, or a ``pixel`` of the sheet.
        decode: Formula that turns a sample, 0..1, into -1..1.
        this, following: Formulas for where the current frame and the next one are sampled.
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
        """The byte that means "no motion", or the one nearest to it."""
        return int(np.ceil(self.zero))

    @property
    def green_of_down(self) -> int:
        """Sign of downward motion in G: 1 or -1."""
        return 1 if self.green == "down" else -1

    def unit_pixels(self, cell: tuple[int, int] | None) -> tuple[float, float]:
        """Return one unit of the scale in px, along x and y; ``cell`` is (width, height) in px."""
        if self.unit == "pixel":
            return 1.0, 1.0
        assert cell is not None, "recipes with this unit have cells"
        return float(cell[0]), float(cell[1])

    def encode(self, fractions: Vectors) -> Bytes:
        """Return R and G, (h, w, 2) uint8, of vectors given as fractions of the scale, y down."""
        signed = fractions * np.array([1, self.green_of_down], np.float32)
        clipped = np.clip(signed, -1, 1) * np.float32(self.span) + np.float32(self.zero)
        # Halves are rounded up, so that no motion gives the neutral byte.
        return np.asarray(np.clip(np.floor(clipped + np.float32(0.5)), 0, 255), np.uint8)

    def decoded(self, red_green: NDArray[np.uint8]) -> Vectors:
        """Decode bytes (h, w, 2) by the engine's formula: vectors in its axes, -1..1."""
        return as_plane((red_green - np.float32(self.zero)) / np.float32(self.span))


HAZE_ENGINE: Engine = "godot"
"""Engine in whose encoding haze is written for all clients: where the air is cold, nothing may be
shifted, and only this one has a byte that means exactly none."""

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
