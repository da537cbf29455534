"""Defaults of flakes: how many each class of fire sheds, and how they look in each style."""

from dataclasses import dataclass
from typing import Literal

from fire_atlas.effect.flakes.emission import EMBER_SIZE
from fire_atlas.recipe.effect import FireClass, FlakeStyle

GREYS = ("#8c8c8c", "#c8c8c8", "#ffffff")
"""Colours of the embers of grey fire, from slow to fast: the same tint suits both."""


@dataclass(frozen=True, slots=True)
class ClassDefaults:
    """What the class of a fire decides where the recipe states nothing.

    Attributes:
        rate: Factor of the automatic spawn rate; 0: no flakes.
        sparks: Share of sparks among its flakes; None: as many as the automatic bursts throw.
    """

    rate: float
    sparks: float | None = None


CLASSES: dict[FireClass, ClassDefaults] = {
    "none": ClassDefaults(rate=0.0, sparks=0.0),
    "gas": ClassDefaults(rate=0.0, sparks=0.0),
    "candle": ClassDefaults(rate=0.12, sparks=0.0),
    "campfire": ClassDefaults(rate=1.0),
    "torch": ClassDefaults(rate=0.8),
    "wall": ClassDefaults(rate=1.0),
    "explosion": ClassDefaults(rate=1.0, sparks=0.6),
}
"""By class."""


@dataclass(frozen=True, slots=True)
class StyleDefaults:
    """What a style decides where the recipe states nothing.

    Attributes:
        rate: Factor of the spawn rate of the fire's class.
        size: Minimum and maximum width, heights.
        colours: Of its flakes: those of ``embers``, the flame's ``own`` ramp, its few ``flat``
            colours, or ``grey``.
        hard: Whether flakes are opaque, painted on in colours that occur in the clip, and none is
            thrown as a spark.
        pixel: Whether they are hard squares too.
    """

    rate: float = 1.0
    size: tuple[float, float] = EMBER_SIZE
    colours: Literal["embers", "own", "flat", "grey"] = "embers"
    hard: bool = False
    pixel: bool = False


STYLES: dict[FlakeStyle, StyleDefaults] = {
    "film": StyleDefaults(),
    "anime": StyleDefaults(rate=0.6, colours="own"),
    "cartoon": StyleDefaults(rate=0.15, size=(0.014, 0.03), colours="flat", hard=True),
    "pixel": StyleDefaults(rate=0.12, size=(0.014, 0.03), colours="flat", hard=True, pixel=True),
    "grey": StyleDefaults(rate=0.5, colours="grey"),
}
"""By style."""
