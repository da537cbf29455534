"""Recipe block ``source`` of kind ``silk``: simulated cloths of flame (Balci & Foroosh).

Lengths are in heights (fractions of the frame's height). Points are [x, y, z]: x to the right, y
away from the front view, z up; the origin is the middle of the fire on the ground.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fire_atlas.recipe.base import (
    ARRANGEMENT,
    BLOCK,
    BY_ARRANGEMENT,
    LIST,
    NUMBER,
    PAIR,
    SHEET,
    WORD,
    Auto,
    Off,
    Settings,
    either,
)
from fire_atlas.recipe.frame_size import SizedFrame
from fire_atlas.recipe.problem import ContradictionError, Problem

Coordinate = Annotated[float, Field(ge=-10, le=10)]
Place = Annotated[tuple[Coordinate, Coordinate, Coordinate], LIST]
"""[x, y, z], heights."""

Factor = Annotated[float, Field(gt=0, le=1000)]
"""A multiple of the fuel's default."""

FuelName = Literal["wood", "candle", "gas"]

Shape = Literal["sphere", "log", "match", "wax", "wick", "wrap"]

_MAX_SHEETS = 10_000


class Sheet(Settings):
    """One silk sheet (a simulated cloth), pinned at its base."""

    at: Place = (0.0, 0.0, 0.0)
    """[x, y, z] of the middle of its base, heights."""
    width: float = Field(default=0.4, gt=0, le=10)
    """Width, heights."""
    height: float = Field(default=0.8, gt=0, le=10)
    """Height, heights."""
    angle: float = Field(default=0.0, ge=-360, le=360)
    """Direction of its width seen from above, degrees: 0 to the right, counter-clockwise."""
    fuel: FuelName | None = None
    """What burns on it. Default: ``source.fuel``. Sheets of one fuel are one fire."""


class Arrangement(Settings):
    """Several sheets in a regular arrangement, or on what burns."""

    arrangement: Literal["crossed", "ring", "line", "jet"] = "crossed"
    """``crossed``: through the middle, at even angles (torch, campfire). ``ring``: around the
    middle. ``line``: side by side from left to right (wall of flame). ``jet``: crossed along
    ``direction``, as from a nozzle (flame thrower, burner)."""
    direction: Place | None = None
    """[x, y, z] in which a ``jet`` blows, of any length: [1, 0, 0] to the right. Where its gas is
    slow it bends upwards."""
    on: Annotated[
        Off
        | Annotated[int, Field(ge=0), NUMBER]
        | Annotated[str, Field(min_length=1, pattern=r"^[^\x00]+$"), WORD],
        either("none, the number of an intruder, or the path of a mask"),
    ] = "none"
    """What burns, in place of an ``arrangement`` on the ground: the number of one of
    ``intruders``, 0 for the first, all over which the sheets begin, and which carries them along;
    or the path of an image of the frame's proportions that is opaque where something of yours
    burns, as a crate. The fire is drawn over it: from the front it chars, glows in its gaps, is
    lit, and hides the flames behind it. An image without transparency is a mask: what is bright
    burns, and nothing else is known of it. Relative to the recipe file."""
    count: int = Field(default=4, ge=1, le=_MAX_SHEETS)
    """Number of sheets."""
    width: float = Field(default=0.4, gt=0, le=10)
    """Width of a sheet, heights."""
    height: float = Field(default=0.8, gt=0, le=10)
    """Height of a sheet, heights. The flame is about two thirds as high."""
    spread: float = Field(default=0.0, ge=0, le=10)
    """Spread of their bases, heights: the largest distance from the middle (``crossed``, ``jet``),
    the radius (``ring``), or the length (``line``)."""
    tile: bool = False
    """Make the frame a tile, to be laid side by side with itself without a seam. The line is as
    long as the frame is wide, and what leaves the frame at one side, flakes too, enters at the
    other. Only of a ``line``, instead of ``spread``."""
    at: Place = (0.0, 0.0, 0.0)
    """[x, y, z] of the middle of the arrangement on the ground, heights; of what burns, how far
    its flames are moved."""
    fuel: FuelName | None = None
    """What burns on them. Default: ``source.fuel``."""

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.on != "none" and (self.arrangement != "crossed" or self.spread):
            other = "spread" if self.spread else "arrangement"
            raise ValueError(f"`on` says where they begin: leave out `{other}`")
        if self.arrangement == "jet" and self.direction is None:
            raise ValueError("a jet needs a direction, as `direction: [1, 0, 0]` to the right")
        if self.arrangement != "jet" and self.direction is not None:
            raise ValueError("only a jet has a direction: `arrangement: jet`")
        if self.direction is not None and not any(self.direction):
            raise ValueError("direction: [0, 0, 0] is none; [0, 0, 1] is up")
        return self

    @model_validator(mode="after")
    def _only_lines_tile(self) -> Self:
        if self.tile and self.arrangement != "line":
            problem = f"goes on in the next frame, as {self.arrangement} cannot; use arrangement: "
            raise ContradictionError(Problem(("tile",), f"{problem}line, or remove it"))
        if self.tile and self.spread:
            problem = "with tile: true a line is as long as the frame is wide; remove it, and state"
            raise ContradictionError(Problem(("spread",), f"{problem} source.width"))
        return self


def _in_order(times: Sequence[float]) -> None:
    if any(later <= t for t, later in pairwise(times)):
        raise ValueError("keyframes must be in order of t, no two at the same t")


class ValueKeyframe(Settings):
    """A value at one time; between keyframes it is interpolated linearly."""

    t: float = Field(ge=0, le=3600)
    """Seconds from the first frame."""
    value: float
    """The value, in the range of the key."""


class Keyframes(Settings):
    """A number that changes while the fire burns. In a loop it must end as it begins."""

    keyframes: Annotated[tuple[ValueKeyframe, ...], LIST, Field(min_length=1)]
    """The values over time, in order of ``t``."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        _in_order([moment.t for moment in self.keyframes])
        return self


def _keyframes_within(least: float, most: float) -> AfterValidator:
    def check(changing: Keyframes) -> Keyframes:
        for moment in changing.keyframes:
            if not least <= moment.value <= most:
                raise ValueError(
                    f"keyframes: the value at {moment.t:g} s must be from {least:g} to {most:g}; "
                    f"got {moment.value:g}"
                )
        return changing

    return AfterValidator(check)


_CHANGING = either("a number or {keyframes: [{t: 0, value: 1}, ...]}")

Pressure = Annotated[
    Annotated[float, Field(ge=0.2, le=5), NUMBER]
    | Annotated[Keyframes, _keyframes_within(0.2, 5), BLOCK],
    _CHANGING,
]
Oxygen = Annotated[
    Annotated[float, Field(ge=0.2, le=3), NUMBER]
    | Annotated[Keyframes, _keyframes_within(0.2, 3), BLOCK],
    _CHANGING,
]
Lift = Annotated[
    Annotated[float, Field(ge=0, le=100), NUMBER]
    | Annotated[Keyframes, _keyframes_within(0, 100), BLOCK],
    _CHANGING,
]
Gravity = Annotated[
    Annotated[float, Field(ge=-20, le=20), NUMBER]
    | Annotated[Keyframes, _keyframes_within(-20, 20), BLOCK],
    _CHANGING,
]
Turbulence = Annotated[
    Annotated[float, Field(ge=0, le=20), NUMBER]
    | Annotated[Keyframes, _keyframes_within(0, 20), BLOCK],
    _CHANGING,
]


class Moment(Settings):
    """Place of an intruder at one time; between keyframes it moves smoothly."""

    t: float = Field(ge=0, le=3600)
    """Seconds from the first frame."""
    at: Place
    """[x, y, z], heights."""


class Intruder(Settings):
    """An object in the flame. It repels the flame, which closes again behind it."""

    shape: Shape
    """``sphere``, ``log`` (a lying cylinder), ``match`` (a stick whose head catches fire in a
    flame, chars and goes on burning), ``wax`` (a cylinder lit from within, as of a candle),
    ``wick`` (a charred thread whose end glows in a flame), or ``wrap`` (cloth wound around a stick,
    as a torch's head)."""
    at: Place | None = None
    """[x, y, z] of its middle (of a match: its head; of a wick: its foot), heights, if it does not
    move."""
    keyframes: Annotated[tuple[Moment, ...], LIST] = ()
    """Its place over time, if it moves."""
    radius: float = Field(default=0.04, gt=0, le=2)
    """Radius, heights; of a match: of its head, which is half as thick again as its stick."""
    length: float = Field(default=0.4, gt=0, le=5)
    """Length of what is not a sphere, heights."""
    angle: float = Field(default=0.0, ge=-360, le=360)
    """Direction in which it points, seen from above, degrees: 0 to the right."""
    tilt: float = Field(default=0.0, ge=-90, le=90)
    """Angle by which that end is raised, degrees."""
    strength: float = Field(default=1.0, ge=0, le=20)
    """Force with which it pushes the flame aside; 1: about the force by which the flame rises."""
    ignites: bool | None = None
    """Whether it catches fire in a flame, after a quarter of a second, and then burns on with a
    flame of its own, also where it is moved to. Default: only a ``match`` does."""
    draw: bool = True
    """Draw it, opaque and lit by the fire. ``false``: only its effect on the flame is seen."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.at is None) == (not self.keyframes):
            raise ValueError("needs either `at` (it never moves) or `keyframes`")
        _in_order([moment.t for moment in self.keyframes])
        if self.ignites and self.shape == "wax":
            raise ValueError("wax does not catch fire; its wick does: {shape: wick, ignites: true}")
        return self

    @property
    def catches_fire(self) -> bool:
        """Whether it burns once it has been in a flame."""
        return self.shape == "match" if self.ignites is None else self.ignites


class Texture(Settings):
    """A texture of the sheets that is made from a clip of fire."""

    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """A clip of fire in any form that source ``frames`` reads. Relative to the recipe file."""
    synthesis: Literal["none", "motion"] = "none"
    """``none``: images of the clip itself. ``motion``: new images, from the most probable motion
    between two ``seeds`` (Appendix B), smoothed and driven by eddies so that it goes on."""
    images: int | None = Field(default=None, ge=4, le=96)
    """[N] Number of images in the texture loop of a sheet. Default: 8, as in the paper; with
    ``synthesis: motion`` as many as a sheet shows in all frames."""
    seeds: Annotated[
        tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]] | None, LIST
    ] = None
    """Two frames of the clip to synthesise from. Default: two neighbours near its middle."""


SheetsOrArrangement = Annotated[
    Annotated[
        tuple[
            Annotated[
                Annotated[Arrangement, ARRANGEMENT] | Annotated[Sheet, SHEET], BY_ARRANGEMENT
            ],
            ...,
        ],
        LIST,
        Field(min_length=1, max_length=_MAX_SHEETS),
        PAIR,
    ]
    | Annotated[Arrangement, BLOCK],
    either("an arrangement ({arrangement: crossed, count: 4}) or a list of sheets"),
]
AutoOrTexture = Annotated[Auto | Annotated[Texture, BLOCK], either("`auto` or {path: ...}")]


class SilkSource(SizedFrame):
    """Fire without a clip: simulated sheets of silk, seen from any side."""

    kind: Literal["silk"] = "silk"
    """Fire simulated by sheets of springs."""
    foot: float = Field(default=0.06, ge=0, le=0.9)
    """Height of the ground above the lower edge of the frame, heights."""
    fuel: FuelName = "wood"
    """The fuel, which sets stiffness, lift, speed and colours."""
    pressure: Pressure = 1.0
    """Pressure of the fuel, 1: the fuel's default. More gives a higher, stiffer flame; from 1.6 on
    it is only stiffer and faster, as no flame is higher than its sheet."""
    oxygen: Oxygen = 1.0
    """Oxygen, 1: the fuel's default. More burns faster, brighter and whiter; less, slow and red."""
    sheets: SheetsOrArrangement = Arrangement()
    """The sheets: an arrangement, or a list of single ones and of arrangements, each of which may
    have a ``fuel`` of its own."""
    rows: int = Field(default=24, ge=4, le=256)
    """Nodes from the base of a sheet to its top: more show finer folds."""
    columns: int = Field(default=16, ge=4, le=256)
    """Nodes across a sheet."""
    mass: Factor = 1.0
    """Mass of the silk, 1: the fuel's default. Heavier silk sways more slowly, and the air and the
    heat move it less: from about 4 on its weight outweighs the lift, and it falls."""
    stiffness: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """Stiffness of all springs, 1: the fuel's default. Below 1, soft silk is drawn out by the lift,
    to a higher flame; higher values need more steps per frame."""
    damping: float = Field(default=1.0, ge=0, le=100)
    """Damping of the springs, 1: the fuel's default. The air damps much more."""
    lift: Lift = 1.0
    """Lift of the flame by heat, 1: the fuel's default. With less, the wind bends it more, and the
    flame is lower."""
    gravity: Gravity = 1.0
    """Weight of the silk, 1: the fuel's default; more draws the flame down."""
    turbulence: Turbulence = 1.0
    """Flutter of the sheets in turbulent air, 1: the fuel's default; more makes it wilder, and
    thinner where it is fast."""
    intruders: Annotated[tuple[Intruder, ...], LIST, Field(max_length=64)] = ()
    """Objects in the flame."""
    texture: AutoOrTexture = "auto"
    """The fire on the sheets: ``auto`` synthesises it, with as many images as a loop needs; a block
    makes it from a clip."""
    soot: float = Field(default=1.0, ge=0, le=20)
    """Soot in the flame, 1: the fuel's default. More hides more of what is behind it; with 0 the
    light of all sheets adds up, and opposite sides are mirror images."""
    grading: Literal["fuel", "blackbody"] = "fuel"
    """Colours of the ``fuel``, or of a ``blackbody``, hotter where sheets move faster (eq. 16)."""
    intensity: float = Field(default=1.0, gt=0, le=100)
    """Brightness of the flame. The densest fire of wood is pale yellow at 1, and burns out to white
    in its middle from about 2 on."""
    glow: float = Field(default=0.0, ge=0, le=1)
    """Part of the flame's light that air and lens scatter: a soft glow around it, also in front of
    objects, which fades towards the frame's edges."""

    @property
    def arrangements(self) -> "tuple[Sheet | Arrangement, ...]":
        """The entries of ``sheets``, one or several."""
        return (self.sheets,) if isinstance(self.sheets, Arrangement) else self.sheets

    @property
    def tile_width(self) -> float | None:
        """Width of a frame, heights, if it is a tile; else None."""
        tiles = any(isinstance(entry, Arrangement) and entry.tile for entry in self.arrangements)
        return self.width / self.height if tiles else None

    @model_validator(mode="after")
    def _something_to_burn(self) -> Self:
        for sheets in self.arrangements:
            on = sheets.on if isinstance(sheets, Arrangement) else "none"
            if isinstance(on, int) and on >= len(self.intruders):
                raise ValueError(
                    f"sheets: `on: {on}` names no intruder; of the {len(self.intruders)} in "
                    f"`intruders` the first is 0"
                )
        return self

    @model_validator(mode="after")
    def _colours_of_its_own(self) -> Self:
        if self.grading == "blackbody" and isinstance(self.texture, Texture):
            raise ValueError(
                "`grading: blackbody` colours painted fire; a clip on the sheets has colours of "
                "its own: leave out `grading`, or `texture`"
            )
        return self
