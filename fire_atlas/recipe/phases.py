"""Recipe block ``phases``: a fire that a game lights and puts out."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import BLOCK, NUMBER, OFF, Off, Settings, either

MAX_EXIT = 0.3
"""Longest time until a fire that is to go out leaves its loop, s."""

NEEDS_LOOP = (
    "are of a fire that loops, but this one plays once: it has a beginning and an end of its own; "
    "remove phases"
)
"""Error of phases of a fire that plays once."""

PhaseTime = Annotated[
    Off | Annotated[float, Field(ge=0.2, le=20), NUMBER],
    either("`none` or a number of seconds"),
    OFF,
]


class Phases(Settings):
    """How a fire that loops is lit and put out: animations of its own (``ignite``, ``burn``,
    ``extinguish``), and from which frame to which a game passes between them."""

    ignite: PhaseTime = 1.0
    """Time from the first flame to the whole fire, s; its last frame leads into the first one of
    ``burn``. A clip that shows its fire being lit keeps that. ``none``: it is lit at once."""
    extinguish: PhaseTime = 1.5
    """Time in which it burns down and goes out, s; from ``burn`` it is entered at several frames,
    at most 0.3 s apart (``extinguish``, ``extinguish_1``, ...). A clip that shows its fire going
    out keeps that. ``none``: it is put out at once."""

    @model_validator(mode="after")
    def _has_any(self) -> Self:
        if self.ignite == self.extinguish == "none":
            raise ValueError(
                "has neither ignite nor extinguish; give one of them seconds, or remove phases"
            )
        return self


PhasesOrNone = Annotated[
    Off | Annotated[Phases, BLOCK],
    either("`none` or a block of settings"),
    OFF,
]
