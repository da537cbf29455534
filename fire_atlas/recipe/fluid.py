"""Recipe block ``source`` of kind ``fluid``: gas that burns in a box of cubes.

Lengths are in heights (fractions of the frame's height). Points are [x, y, z]: x to the right, y
away from the front view, z up; the origin is the foot of the fire.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fire_atlas.recipe.base import (
    LIST,
    NUMBER,
    PAIR,
    WORD,
    Color,
    Settings,
    either,
    ordered,
)
from fire_atlas.recipe.frame_size import SizedFrame
from fire_atlas.recipe.silk import Place

FireName = Literal[
    "campfire", "torch", "flamethrower", "muzzle_flash", "explosion", "fireball", "smoke", "steam"
]

Detail = Literal["draft", "normal", "final"]

CELLS: dict[Detail, int] = {"draft": 32, "normal": 64, "final": 96}
"""Cubes along the side of a square of the frame's area, so that no shape takes longer."""

_WAYS = {"up": (0.0, 0.0, 1.0), "right": (1.0, 0.0, 0.0), "left": (-1.0, 0.0, 0.0)}


JetDirection = Annotated[
    Annotated[Literal["up", "right", "left"], WORD] | Annotated[Place, PAIR],
    either("up, right, left or three numbers: [x, y, z]"),
]


class GasBurner(Settings):
    """A place where fuel comes out."""

    at: Place = (0.0, 0.0, 0.0)
    """[x, y, z] of its middle, heights."""
    size: float = Field(default=0.1, gt=0, le=1)
    """Half its width, heights; it is 0.7 times as high."""
    strength: float = Field(default=1.0, gt=0, le=1)
    """How much fuel its middle has, of what a burner of the ready fire has."""


class FluidSource(SizedFrame):
    """Fire without a clip: gas that burns, rises and swirls, with smoke, seen from any side."""

    kind: Literal["fluid"] = "fluid"
    """Fire simulated as a fluid."""
    fire: FireName = "campfire"
    """The ready fire to start from; every other key changes it. It says too what class of fire its
    flakes are of."""
    resolution: Annotated[
        Annotated[Detail, WORD] | Annotated[int, Field(ge=16, le=160), NUMBER],
        either("draft, normal, final or a whole number of cubes"),
    ] = "normal"
    """Cubes across a square frame, as many as in others of its area: ``draft`` 32, to find the
    timing in seconds, ``normal`` 64, ``final`` 96, or a number. Twice as many take 16 times as
    long."""
    radius: float | None = Field(default=None, gt=0, le=1)
    """Radius of what burns, heights: how wide the fire is. Default: the ready fire's."""
    fuel_rate: float = Field(default=1.0, ge=0, le=3)
    """How much fuel there is, 1: the ready fire's. It burns that much longer, so the flame is
    higher. 0: nothing burns."""
    heat: float = Field(default=1.0, ge=0.3, le=2)
    """How hot the flame is, 1: the ready fire's: more is brighter and paler, less dim and red."""
    lift: float = Field(default=1.0, ge=0, le=4)
    """How fast hot gas rises, 1: the ready fire's."""
    turbulence: float = Field(default=1.0, ge=0, le=3)
    """How much hot gas is stirred and swirls, 1: the ready fire's."""
    detail: float = Field(default=0.0, ge=0, le=1)
    """How far noise displaces the gas when it is drawn: tongues finer than the cubes, of use below
    ``final``."""
    smoke: float | None = Field(default=None, ge=0, le=3)
    """How much smoke comes of the fuel; 1: that of an explosion. Default: the ready fire's."""
    smoke_colour: Color | None = None
    """Colour of the smoke in full light. Default: the ready fire's grey."""
    blast: float | None = Field(default=None, ge=0, le=3)
    """How far gas expands while it catches fire; 1: that of an explosion. Above 0 the fire plays
    once. Default: the ready fire's."""
    speed: float | None = Field(default=None, ge=0, le=15)
    """Speed of the gas that leaves a burner, heights per second. Default: the ready fire's."""
    direction: JetDirection | None = None
    """Where that gas goes: ``up``, ``right``, ``left`` or [x, y, z] of any length. Default: the
    ready fire's."""
    burning: Annotated[
        tuple[Annotated[float, Field(ge=0, le=600)], Annotated[float, Field(ge=0, le=600)]] | None,
        LIST,
        AfterValidator(lambda value: None if value is None else ordered(value)),
    ] = None
    """[from, to], s: when the burners are on. The fire catches, burns, goes out, and plays once.
    Default: always, but for what explodes."""
    burners: Annotated[tuple[GasBurner, ...], LIST, Field(max_length=64)] = ()
    """Burners in place of the ready fire's; ``radius`` is refused beside them."""

    @property
    def way(self) -> tuple[float, float, float]:
        """The direction of the gas, a unit vector; up by default."""
        x, y, z = (
            _WAYS[self.direction]
            if isinstance(self.direction, str)
            else (self.direction or _WAYS["up"])
        )
        length = math.sqrt(x * x + y * y + z * z)
        return (x / length, y / length, z / length)

    @model_validator(mode="after")
    def _directs_and_places_once(self) -> Self:
        if self.direction is not None and not any(self.direction):
            raise ValueError("direction: [0, 0, 0] is none; [0, 0, 1] is up")
        if self.burners and self.radius is not None:
            raise ValueError("burners state sizes of their own: remove radius, or burners")
        return self
