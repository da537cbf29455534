"""Defaults of flakes for each class of fire: how many it sheds, and how they look."""

from dataclasses import dataclass
from typing import Literal

from fire_atlas.recipe.effect import FireClass

GREYS = ("#8c8c8c", "#c8c8c8", "#ffffff")
"""Colours of the embers of grey fire, from slow to fast: the same tint suits both."""


@dataclass(frozen=True, slots=True)
class FlakeDefaults:
    """What the class of a fire decides where the recipe states nothing.

    Attributes:
        rate: Factor of the automatic spawn rate; 0: no flakes.
        bursts: Whether it crackles; else it has no bursts.
        colours: Of its flakes: those of ``embers``, its ``own`` ramp, its own few ``flat`` colours,
            or ``grey``.
        hard: Whether flakes are opaque, painted on in colours that occur in the clip.
        pixel: Whether they are hard squares too.
    """

    rate: float
    bursts: bool = True
    colours: Literal["embers", "own", "flat", "grey"] = "embers"
    hard: bool = False
    pixel: bool = False


DEFAULTS: dict[FireClass, FlakeDefaults] = {
    "none": FlakeDefaults(rate=0.0, bursts=False),
    "gas": FlakeDefaults(rate=0.0, bursts=False),
    "candle": FlakeDefaults(rate=0.12, bursts=False),
    "campfire": FlakeDefaults(rate=1.0),
    "torch": FlakeDefaults(rate=0.8),
    "wall": FlakeDefaults(rate=1.0),
    "explosion": FlakeDefaults(rate=1.3),
    "flat": FlakeDefaults(rate=0.3, bursts=False, colours="flat", hard=True),
    "pixel": FlakeDefaults(rate=0.4, bursts=False, colours="flat", hard=True, pixel=True),
    "grey": FlakeDefaults(rate=0.7, colours="grey"),
    "art": FlakeDefaults(rate=0.7, colours="own"),
}
"""By class."""
