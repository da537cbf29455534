"""Defaults of flakes for each class of fire: how many it sheds, and how they look."""

from dataclasses import dataclass
from typing import Literal

from fire_atlas.effect.flakes.emission import EMBER_SIZE
from fire_atlas.recipe.effect import FireClass

GREYS = ("#8c8c8c", "#c8c8c8", "#ffffff")
"""Colours of the embers of grey fire, from slow to fast: the same tint suits both."""


@dataclass(frozen=True, slots=True)
class FlakeDefaults:
    """What the class of a fire decides where the recipe states nothing.

    Attributes:
        rate: Factor of the automatic spawn rate; 0: no flakes.
        sparks: Share of sparks among its flakes; None: as many as the automatic bursts throw.
        size: Minimum and maximum width, heights.
        colours: Of its flakes: those of ``embers``, its ``own`` ramp, its own few ``flat`` colours,
            or ``grey``.
        hard: Whether flakes are opaque, painted on in colours that occur in the clip.
        pixel: Whether they are hard squares too.
    """

    rate: float
    sparks: float | None = None
    size: tuple[float, float] = EMBER_SIZE
    colours: Literal["embers", "own", "flat", "grey"] = "embers"
    hard: bool = False
    pixel: bool = False


DEFAULTS: dict[FireClass, FlakeDefaults] = {
    "none": FlakeDefaults(rate=0.0, sparks=0.0),
    "gas": FlakeDefaults(rate=0.0, sparks=0.0),
    "candle": FlakeDefaults(rate=0.12, sparks=0.0),
    "campfire": FlakeDefaults(rate=1.0),
    "torch": FlakeDefaults(rate=0.8),
    "wall": FlakeDefaults(rate=1.0),
    "explosion": FlakeDefaults(rate=1.0, sparks=0.6),
    "flat": FlakeDefaults(rate=0.15, size=(0.014, 0.03), sparks=0.0, colours="flat", hard=True),
    "pixel": FlakeDefaults(
        rate=0.12, size=(0.014, 0.03), sparks=0.0, colours="flat", hard=True, pixel=True
    ),
    "grey": FlakeDefaults(rate=0.5, colours="grey"),
    "art": FlakeDefaults(rate=0.6, colours="own"),
}
"""By class."""
