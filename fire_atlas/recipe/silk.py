"""Source ``silk``: sheets of flame moved by springs, wind and heat (Balci & Foroosh).

Lengths are heights (fractions of the frame's height). Places are [x, y, z]: x to the right, y away
from the front view, z up, from the middle of the fire on the ground.
"""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import (
    BLOCK,
    LIST,
    PAIR,
    Auto,
    Settings,
    either,
)

Coordinate = Annotated[float, Field(ge=-10, le=10)]
Place = Annotated[tuple[Coordinate, Coordinate, Coordinate], LIST]
"""[x, y, z], heights."""

Factor = Annotated[float, Field(gt=0, le=1000)]
"""A multiple of the fuel's own value."""

_MOST_SHEETS = 10_000


class Sheet(Settings):
    """One sheet of silk, pinned at its base."""

    at: Place = (0.0, 0.0, 0.0)
    """[x, y, z] of the middle of its base, heights."""
    width: float = Field(default=0.4, gt=0, le=10)
    """Heights."""
    height: float = Field(default=0.8, gt=0, le=10)
    """Heights."""
    angle: float = Field(default=0.0, ge=-360, le=360)
    """Direction of its width seen from above, degrees: 0 to the right, counter-clockwise."""


class Arrangement(Settings):
    """Several sheets, arranged by a rule."""

    arrangement: Literal["crossed", "ring", "line"] = "crossed"
    """``crossed``: all through the middle, turned evenly (torch, campfire). ``ring``: around the
    middle. ``line``: side by side from left to right (wall of flame)."""
    count: int = Field(default=4, ge=1, le=_MOST_SHEETS)
    """Number of sheets."""
    width: float = Field(default=0.4, gt=0, le=10)
    """Width of a sheet, heights."""
    height: float = Field(default=0.8, gt=0, le=10)
    """Height of a sheet, heights. The flame is about two thirds as high."""
    spread: float = Field(default=0.0, ge=0, le=10)
    """How far their bases lie apart, heights: up to this far from the middle (``crossed``), the
    radius (``ring``), or the length (``line``)."""
    at: Place = (0.0, 0.0, 0.0)
    """[x, y, z] of their middle on the ground, heights."""


class Moment(Settings):
    """Where an intruder is at one moment; between moments it moves smoothly."""

    t: float = Field(ge=0, le=3600)
    """Seconds from the first frame."""
    at: Place
    """[x, y, z], heights."""


class Intruder(Settings):
    """An object in the flame, as a field of force: the flame gives way and closes again."""

    shape: Literal["sphere", "log", "match"]
    """``sphere``; ``log`` (lies, ``length`` long); ``match`` (a stick whose head, at its place,
    catches fire in a flame and carries it on)."""
    at: Place | None = None
    """[x, y, z] of its middle (of a match: its head), heights, if it never moves."""
    keyframes: Annotated[tuple[Moment, ...], LIST] = ()
    """Where it is over time, if it moves."""
    radius: float = Field(default=0.04, gt=0, le=2)
    """Of the sphere, or half the thickness of log or match, heights."""
    length: float = Field(default=0.4, gt=0, le=5)
    """Of log or match, heights."""
    angle: float = Field(default=0.0, ge=-360, le=360)
    """Direction in which log or match stretch, seen from above, degrees: 0 to the right."""
    tilt: float = Field(default=0.0, ge=-90, le=90)
    """How far that end is raised, degrees."""
    strength: float = Field(default=1.0, ge=0, le=20)
    """How hard it pushes the flame aside; 1: about as hard as the flame rises."""
    draw: bool = True
    """Draw it, opaque and lit by the fire; ``false``: only the flame shows that it is there."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.at is None) == (not self.keyframes):
            raise ValueError("needs either `at` (it never moves) or `keyframes`")
        times = [moment.t for moment in self.keyframes]
        if any(later <= t for t, later in pairwise(times)):
            raise ValueError("keyframes must be in order of t, no two at the same")
        return self


class Texture(Settings):
    """Fire from a clip on the sheets."""

    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """A clip of fire: anything source ``frames`` reads. Relative to the recipe file."""
    synthesis: Literal["none", "motion"] = "none"
    """``none``: images of the clip itself. ``motion``: new ones without end, from the most probable
    motion between two ``seeds`` (Appendix B)."""
    images: int = Field(default=8, ge=4, le=96)
    """[N] Number of images in the loop that a sheet plays. Paper: 8."""
    seeds: Annotated[
        tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]] | None, LIST
    ] = None
    """Two frames of the clip to synthesise from. Default: two near its middle, one apart."""


SheetsOrArrangement = Annotated[
    Annotated[tuple[Sheet, ...], LIST, Field(min_length=1, max_length=_MOST_SHEETS), PAIR]
    | Annotated[Arrangement, BLOCK],
    either("an arrangement ({arrangement: crossed, count: 4}) or a list of sheets"),
]
AutoOrTexture = Annotated[Auto | Annotated[Texture, BLOCK], either("`auto` or {path: ...}")]


class SilkSource(Settings):
    """Fire without footage: simulated sheets of silk, seen from any side."""

    kind: Literal["silk"]
    """Fire simulated by springs."""
    width: int = Field(default=256, ge=16, le=4096)
    """Width of a frame, px."""
    height: int = Field(default=256, ge=16, le=4096)
    """Height of a frame, px."""
    foot: float = Field(default=0.06, ge=0, le=0.9)
    """How far above the frame's lower edge the ground is, heights."""
    fuel: Literal["wood", "candle", "gas"] = "wood"
    """The fuel: sets stiffness, lift, speed and colours."""
    pressure: float = Field(default=1.0, ge=0.2, le=5)
    """Pressure of the fuel: more gives a higher, stiffer flame. 1: the fuel's own."""
    oxygen: float = Field(default=1.0, ge=0.2, le=3)
    """More oxygen burns faster, hotter, whiter; below 1 slow and red. 1: the fuel's own."""
    sheets: SheetsOrArrangement = Arrangement()
    """The sheets: an arrangement, or a list of single ones."""
    rows: int = Field(default=24, ge=2, le=256)
    """Nodes from the base of a sheet to its top."""
    columns: int = Field(default=16, ge=2, le=256)
    """Nodes across a sheet."""
    mass: Factor = 1.0
    """Mass of the silk; 1: the fuel's own. Heavier sways more slowly."""
    stiffness: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """Stiffness of all springs; 1: the fuel's own. Stiffer costs more steps a frame."""
    damping: float = Field(default=1.0, ge=0, le=100)
    """Damping of the springs; 1: the fuel's own."""
    lift: float = Field(default=1.0, ge=0, le=100)
    """How hard heat lifts the flame; 1: the fuel's own. Less bends more in the wind."""
    gravity: float = Field(default=1.0, ge=-20, le=20)
    """Weight of the silk; 1: the fuel's own."""
    turbulence: float = Field(default=1.0, ge=0, le=20)
    """Flutter of the sheets by turbulent air; 1: the fuel's own."""
    intruders: Annotated[tuple[Intruder, ...], LIST, Field(max_length=64)] = ()
    """Objects in the flame."""
    texture: AutoOrTexture = "auto"
    """The fire on the sheets: ``auto`` synthesises it, as many images as play once in a loop; or
    it comes from a clip."""
    grading: Literal["fuel", "blackbody"] = "fuel"
    """Colours: the fuel's own, or those of a black body as hot as the sheets are fast (eq. 16)."""
    intensity: float = Field(default=1.0, gt=0, le=100)
    """Light of the flame; more burns out to white."""
