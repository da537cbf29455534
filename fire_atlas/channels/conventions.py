"""How each engine reads motion vectors: the signs, the unit, the bytes, the formula.

Inside the tool y points down; an engine whose V grows upwards has its green turned here.
"""

from dataclasses import dataclass
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.flow import Vectors
from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.recipe.output import Engine


@dataclass(frozen=True, slots=True)
class Convention:
    """What one engine's formula makes of a texel.

    A byte b stands for (b − ``zero``) / ``span`` of the scale.

    Attributes:
        engine: Whose formula it is.
        green: What more than neutral means in G: ``up`` or ``down``. In R it always is ``right``.
        zero, span: Of the bytes. Where ``zero`` is no whole number, no byte means "no motion":
            the nearest drifts by half a step, 1/255 of the scale.
        unit: What the scale counts: ``cell`` (the UV of one cell, 0..1) or ``pixel``.
        decode: The formula that turns a sample, 0..1, into -1..1.
        this, following: Where the frame that goes and the one that comes are sampled.
    """

    engine: str
    green: str
    zero: float
    span: float
    unit: str
    decode: str
    this: str
    following: str

    @property
    def neutral(self) -> int:
        """The byte that means "no motion", or comes nearest."""
        return int(np.ceil(self.zero))

    def encode(self, share: Vectors) -> Bytes:
        """Return R and G, (h, w, 2) uint8, of vectors as shares of the scale, y down."""
        turned = share * np.array([1, -1 if self.green == "up" else 1], np.float32)
        clipped = np.clip(turned, -1, 1) * np.float32(self.span) + np.float32(self.zero)
        # Upwards from between two bytes, so that no motion is the neutral byte.
        return np.asarray(np.clip(np.floor(clipped + np.float32(0.5)), 0, 255), np.uint8)

    def decoded(self, red_green: NDArray[np.uint8]) -> Vectors:
        """Return what the engine's formula makes of bytes (h, w, 2): its own axes, -1..1."""
        return as_plane((red_green - np.float32(self.zero)) / np.float32(self.span))


_UV = ("rg * 2 - 1", "uv - mv * scale * blend", "uv + mvNext * scale * (1 - blend)")


def convention(engine: Engine) -> Convention:
    """Return how ``engine`` reads motion vectors."""
    match engine:
        case "unity":
            return Convention("unity", "up", 127.5, 127.5, "cell", *_UV)
        case "unreal":
            return Convention("unreal", "down", 127.5, 127.5, "cell", *_UV)
        case "godot":
            return Convention(
                "godot", "down", 128, 127, "pixel", "(rg * 255 - 128) / 127",
                "position - mv * scale * blend", "position + mvNext * scale * (1 - blend)",
            )  # fmt: skip
        case _:
            assert_never(engine)
