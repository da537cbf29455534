"""Recipe blocks of the fire-flake effect: features, buoyancy, flakes, motion_blur, composite.

Symbols in brackets are those of Kim & Lee 2019, "Fire Sprite Animation Using Fire-Flake Texture
and Artificial Motion Blur". Lengths "in heights" are fractions of the frame's height, so that a
recipe works at any resolution.
"""

import re
from pathlib import PurePath
from typing import Annotated, Any, Literal, Self, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    field_validator,
    model_validator,
)

from fire_atlas.recipe.base import (
    BLOCK,
    COLOURS,
    LIST,
    NONE,
    NUMBER,
    OFF,
    PAIR,
    UNDECIDED,
    WORD,
    Auto,
    Color,
    Direction,
    Off,
    Settings,
    either,
    ordered,
)
from fire_atlas.recipe.problem import ContradictionError, Problem
from fire_atlas.recipe.source import Grid
from fire_atlas.recipe.tree import NAME_PATTERN

AutoOrNumber = Annotated[
    Auto | Annotated[float, Field(ge=0, le=10000), NUMBER], either("`auto` or a number")
]
Lift = Annotated[
    Auto | Annotated[float, Field(ge=-100, le=100), NUMBER] | Annotated[Direction, PAIR],
    either("`auto`, a number, or two: [x, y]"),
]

FireClass = Literal["none", "gas", "candle", "campfire", "torch", "wall", "explosion"]
"""What burns."""

WITHOUT_FLAKES: frozenset[FireClass] = frozenset({"none", "gas"})
"""Classes of fire that shed no flakes."""

FlakeStyle = Literal["film", "anime", "cartoon", "pixel", "grey"]
"""How flakes look."""

_STYLES_ONCE_CLASSES = {"flat": "cartoon", "pixel": "pixel", "art": "anime", "grey": "grey"}


def _what_burns(given: Any) -> Any:
    """Refuse a class that says how fire looks."""
    if isinstance(given, str) and given in _STYLES_ONCE_CLASSES:
        raise ValueError(
            f"says what burns, and {given} how it looks: write `style: "
            f"{_STYLES_ONCE_CLASSES[given]}`, and leave class out"
        )
    return given


"""Kinds of fire, which decide the defaults of flakes."""

PAPER_ALPHA = 0.03
"""The paper's threshold of candidates [α], section III-B."""

PAPER: dict[str, dict[str, Any]] = {
    "features": {"kernel": "printed", "epsilon": 40.0, "n": 5.0, "kappa_over": "image"},
    "buoyancy": {"motion": "features", "lift": 0.0, "drag": 0.0, "turbulence": 0.0},
    "flakes": {
        "alpha": PAPER_ALPHA,
        "bursts": 0.0,
        "stretch": 1.0,
        "scatter": 0.98,
        "lag": 0.0,
        "own_motion": 0.0,
        "colors": ("#b80c00", "#ff2c00", "#ff5808", "#ff7a24", "#ff9c58"),
        "edge": "crop",
    },
    "motion_blur": {"flame": True, "shutter": 1.0, "exaggeration": 1.0},
}
"""What ``features.preset: paper`` sets, block by block, unless the recipe states it: the constants
of the paper (section III), and none of what is added to it here. Three values are ours, because it
has no numbers of them: how far flakes are stretched along their velocity and what colours they have
by it (Figure 9), and k of their jitter (eq. 13)."""

MAX_VARIANTS = 16
"""Largest number of fires of one recipe, and of sets of flakes over one flame."""

MAX_ROUNDS = 64
"""Maximum number of rounds of a loop after which its flakes repeat."""


class Features(Settings):
    """Feature vectors: strength and direction of the edges of the flame (eq. 1-3).

    They decide where flakes are born and, with ``buoyancy.motion: features``, how they fly.
    """

    preset: Literal["auto", "paper"] = "auto"
    """``auto``: adapted to the clip. ``paper``: the whole effect as the paper has it, with its
    constants and without what is added to it here; what the recipe states wins. It sets keys of
    ``features``, ``buoyancy``, ``flakes`` and ``motion_blur``. Besides, flakes differ in neither
    brightness nor focus, edges shed them in the whole image, not in the flame alone, several fires
    are one, and there are no classes of fire."""
    kernel: Literal["unit", "printed"] = "unit"
    """Gaussians of eq. 1. ``unit``: with a sum of 1, their difference finds edges alone, thin, with
    vectors on both sides of them. ``printed``: as the paper prints them, with sums in proportion to
    their σ; nearly all vectors point out of the flame. Set by ``preset: paper``."""
    sigma: Annotated[
        tuple[Annotated[float, Field(ge=0.3, le=20)], Annotated[float, Field(ge=0.3, le=40)]],
        LIST,
        AfterValidator(ordered),
    ] = (1.0, 1.6)
    """[σ1, σ2] of the two Gaussians whose difference finds edges, px (eq. 1). Larger values give
    thicker edges."""
    epsilon: AutoOrNumber = "auto"
    """[ε] Gradients below this, on a scale of 0..255, are ignored (eq. 2). ``auto``: measured once
    for the whole clip. Paper: 40."""
    n: float = Field(default=1.5, ge=0, le=20)
    """[n] Exponent of the height weight κ: larger values favour the top of the fire over its base
    (eq. 2). Paper: 5."""
    kappa_over: Literal["flame", "image"] = "flame"
    """κ rises from 0 at the bottom to 1 at the top (or in the direction of ``lift``) of
    the flame's bounding box, of each fire's own if there are several, or of the whole image
    (paper)."""
    beta: float = Field(default=0.02, ge=0, le=10)
    """[β] Weight of the buoyancy direction that is added to each feature vector (eq. 3). 0.02
    (paper) turns the mean vector by a degree; 2 turns them nearly upright."""
    clamp: float = Field(default=0.0, ge=0, le=10000)
    """Edges weaker than this (their feature vectors are shorter) are ignored, so that still objects
    in the picture give off no sparks: in the paper's Figure 23 a drum, with 2.0."""


class Buoyancy(Settings):
    """The buoyancy field: the velocity field that flakes follow (eq. 12)."""

    motion: Literal["flow", "features"] = "flow"
    """Source of the motion inside the flame: the dense optical ``flow`` of the clip, or only its
    ``features`` (paper)."""
    cell: int = Field(default=4, ge=1, le=64)
    """Side of a grid cell, px."""
    coupling: float = Field(default=250.0, ge=0, le=1000)
    """Rate at which the field adopts the flow inside the flame, 1/s."""
    feature_force: AutoOrNumber = "auto"
    """[U_buoyancy] Push by flame edges with ``motion: features``, heights/s²: the acceleration at
    an edge of average strength where κ is 1; stronger edges push more, those lower in the fire
    less. ``auto``: 64."""
    lift: Lift = "auto"
    """[F_buoyancy] Upward acceleration, heights/s²; or [x, y] (y up) for fire that does not rise.
    ``auto``: 1.2, up, or in the direction in which the flame of the clip moves: a comet's flies
    sideways."""
    gravity: float = Field(default=0.0, ge=-100, le=100)
    """[g] Downward acceleration of field and flakes, heights/s²."""
    drag: float = Field(default=2.0, ge=0, le=1000)
    """Rate at which motion outside the flame decays, 1/s. The plume rises at lift / drag."""
    viscosity: float = Field(default=0.0005, ge=0, le=10)
    """[μ] How fast motion spreads to its surroundings, heights²/s."""
    turbulence: float = Field(default=0.2, ge=0, le=100)
    """Speed (rms) of the turbulence (curl noise) above the flame, heights/s."""
    projection: bool = False
    """Make the field divergence-free in every step. The paper does not."""


MAX_TEXTURE_CELLS = 64
"""Maximum number of cells of a texture of flakes: players keep all of them in their shaders."""


class FlakeTexture(Settings):
    """A picture of a flake, or a sheet of several."""

    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """An image, painted as a flake that flies to the right. Without transparency its black is
    empty. Relative to the recipe file."""
    grid: Grid | None = None
    """Cut ``path`` into cells, left to right, top to bottom, at most 64."""
    play: Literal["cell", "life"] = "cell"
    """Each flake shows one ``cell``, drawn by lot, or all cells one after the other, spread over
    its ``life``."""

    @field_validator("grid")
    @classmethod
    def _few_cells(cls, grid: Grid | None) -> Grid | None:
        cells = grid.columns * grid.rows if grid and grid.columns and grid.rows else 0
        if cells > MAX_TEXTURE_CELLS:
            raise ValueError(
                f"has {cells} cells, but a texture of flakes may have {MAX_TEXTURE_CELLS}; use "
                f"fewer columns or rows"
            )
        return grid


class Flakes(Settings):
    """Fire-flakes (sparks): they spawn at flame edges and follow the field (section III-C)."""

    fire_class: Annotated[Literal["auto", FireClass], OFF, BeforeValidator(_what_burns)] = Field(
        default="auto", alias="class"
    )
    """What burns, which decides ``rate`` and ``sparks`` wherever these are ``auto``. ``none`` and
    ``gas`` shed no flakes, a ``candle`` next to none; ``campfire``, ``torch``, ``wall`` and
    ``explosion`` shed embers. ``auto``: by the clip's colours, shape and motion; the build says
    which, and why."""
    style: Literal["auto", FlakeStyle] = "auto"
    """How flakes look, which decides ``size``, ``colors``, ``sprite`` and ``composite.palette``
    wherever these are ``auto``, and how many suit it. ``film``: soft embers that glow as real ones
    do. ``anime``: soft ones in the flame's own colours. ``cartoon``: a few large dots with smooth
    edges, in the flat colours of the clip. ``pixel``: a few hard squares in these colours.
    ``grey``: soft greys that are meant to be tinted. ``auto``: by the colours and the edges of the
    clip; the build says which, and why."""
    bake: bool = True
    """Draw the flakes into the frames. ``false``: write only their tracks."""
    alpha: AutoOrNumber = "auto"
    """[α] Flakes start only at flame edges stronger than this (with longer feature vectors), and
    anywhere on them alike. Lower values give more flakes. ``auto``: measured once for the whole
    clip, and the stronger the edge, the more start there. Paper: 0.03."""
    rate: Annotated[
        Auto | Annotated[float, Field(ge=0, le=100000), NUMBER], either("`auto` or a number")
    ] = "auto"
    """Spawn rate, flakes per second, the sparks of ``bursts`` included. Several fires in a frame
    share it by their areas. If you set ``alpha``, it is scaled by the area of the edges above it,
    relative to the automatic α (with ``features.preset: paper`` to 0.03): half the area, half the
    flakes. ``auto``: by ``class``, ``style`` and the area in which the fire moves, about 1 for a
    candle, 30 for a campfire and 90 for a wall of fire; fewer if the frame is too small to show
    flakes of ``size``."""
    bursts: Annotated[
        Auto | Annotated[float, Field(ge=0, le=100), NUMBER], either("`auto` or a number")
    ] = "auto"
    """Bursts per second, each of a few to dozens of small sparks (16 on average, unless ``sparks``
    is given) thrown from one point. Their sparks are part of ``rate``, in place of embers, and
    never more than it allows. ``auto``: 1/60 of the spawn rate, so that a quarter of all flakes are
    sparks; fewer below 40 flakes per second and none below 20, as of a candle. If ``sparks`` is
    given, as many as they need."""
    sparks: Annotated[
        Auto | Annotated[float, Field(ge=0, le=1), NUMBER], either("`auto` or a number")
    ] = "auto"
    """Share of the flakes that are sparks: thrown by ``bursts``, they fly on their own, slowed by
    the air and pulled down by gravity, and burn out in half the time. All others are embers, which
    the hot gas carries. ``auto``: what the bursts throw."""
    life: Annotated[
        tuple[Annotated[float, Field(gt=0, le=60)], Annotated[float, Field(gt=0, le=60)]],
        LIST,
        AfterValidator(ordered),
    ] = (0.8, 2.6)
    """[min, max] lifetime of a flake, s, after which it has cooled. Shorter near the end of a
    one-shot fire, so that no flake is left when it ends."""
    size: Annotated[
        Auto
        | Annotated[
            tuple[Annotated[float, Field(gt=0, le=1)], Annotated[float, Field(gt=0, le=1)]],
            LIST,
            AfterValidator(ordered),
            PAIR,
        ],
        either("`auto` or two numbers: [min, max]"),
    ] = "auto"
    """[min, max] width of a flake, heights; sizes between them are log-normal. A soft flake thinner
    than a pixel is dimmer, not wider. ``auto``: [0.0026, 0.017], and large dots for flat art and
    pixel art (``style``); with a ``texture`` [0.02, 0.08], which shows what is painted."""
    rounds: Annotated[
        Auto | Annotated[int, Field(ge=1, le=MAX_ROUNDS), NUMBER],
        either("`auto` or a number of rounds"),
    ] = "auto"
    """Rounds of a loop after which the flakes repeat: the tracks are this many times as long as the
    animation, so that flakes which outlive a short loop are no conveyor belt. ``auto``: as many as
    the longest ``life`` needs; 1 where pages show flakes (``bake``, ``maps.flakes``), which have
    one round."""
    stretch: float = Field(default=0.0, ge=0, le=10)
    """Lengthens each flake along its motion by the distance it travels in this many frames, in
    addition to motion blur."""
    scatter: float = Field(default=0.9998, ge=-1, le=1)
    """[k] Scattering coefficient (eq. 13): 1 no scattering, near 0 erratic, negative backwards."""
    own_motion: float = Field(default=1.0, ge=0, le=10)
    """How far each ember moves in its own way beside the field: its fall, its drift that is faster
    or slower than the gas, its own turbulence, and its ``lag``, all times this. 0: a flake has the
    field's velocity and the jitter of ``scatter``, no more (paper)."""
    lag: float = Field(default=0.006, ge=0, le=10)
    """Inertia: time, s, in which a flake of medium size adopts the field's velocity. Larger flakes
    lag more. 0: no inertia."""
    colors: Annotated[
        Auto | Annotated[tuple[Color, ...], LIST, PAIR, Field(min_length=1, max_length=16)],
        either("`auto` or a list of colours"),
    ] = "auto"
    """``auto``: the one colour of glowing embers, which film shows as dark red where they are dim,
    and as orange, yellow and nearly white the brighter they are; by ``style`` also the flame's own
    colours, or greys. Or colours from slow to fast flakes, sRGB hex (Figure 9); that is the default
    of ``features.preset: paper``. Pixel sparks go through several as they die, from the last to the
    first."""
    intensity: float = Field(default=1.0, ge=0, le=1000)
    """Multiplier of the flakes' light, linear. At 1, a medium one gives 0.75 at its brightest;
    others are many times as bright or as dim. Film shows x as x / (1 + x)."""
    edge: Literal["fade", "crop"] = "fade"
    """Flakes that leave the frame ``fade`` out near its border, or are cut off by it (``crop``)."""
    glow: float = Field(default=0.0, ge=0, le=10)
    """Light of a wide, soft glow around each soft flake, relative to the flake's, in addition to
    the faint halo of a lens. Not in the tracks."""
    sprite: Literal["auto", "soft", "pixel"] = "auto"
    """``soft``: round sprites. ``pixel``: hard squares of whole pixels, for pixel art; if that is
    enlarged by a whole number, of whole pixels of the art. ``auto``: by ``style``."""
    texture: Annotated[
        Off
        | Annotated[str, Field(min_length=1, pattern=r"^[^\x00]+$"), WORD]
        | Annotated[FlakeTexture, BLOCK],
        either("`none`, the path of an image, or a block with `path`"),
        OFF,
    ] = "none"
    """A picture of your own instead of the soft streak: its path, or a sheet of several
    (``{path: embers.png, grid: {columns: 4, rows: 1}, play: life}``). It is turned so that its
    right side leads; ``size`` is its height, across the motion. Its length keeps the picture's
    proportions, and streaks lengthen it. It is packed beside the frames, no larger than the largest
    flake, and named in the tracks."""
    tint: Annotated[Literal["heat", "none"], OFF] = "heat"
    """Colour of a ``texture``. ``heat``: the picture is a mask, by its brightest channel, of the
    light and colour that the flake would have without it. ``none``: as painted, and fading as the
    flake cools; ``intensity`` multiplies it."""
    max: int = Field(default=20000, ge=0, le=60000)
    """Maximum number of flakes alive at once."""
    variants: int = Field(default=1, ge=1, le=MAX_VARIANTS)
    """Number of sets of flakes over the same flame, each in tracks of its own:
    ``name.flakes.json``, ``name.v1.flakes.json``, ... The flame is on the pages once, and fires
    that stand side by side throw other sparks. They need ``bake: false``; what Godot and Unity play
    shows another set on each fire."""

    @property
    def why_none(self) -> str | None:
        """Why there are none, as far as the recipe says; None if there may be some."""
        if self.rate == 0:
            return "flakes.rate is 0"
        if self.rate == "auto" and self.fire_class in WITHOUT_FLAKES:
            return f"flakes.class is {self.fire_class}, which sheds none"
        return "flakes.max is 0" if self.max == 0 else None

    @property
    def own_texture(self) -> FlakeTexture | None:
        """The texture as a block, if there is one."""
        if isinstance(self.texture, FlakeTexture):
            return self.texture
        return None if self.texture == "none" else FlakeTexture(path=self.texture)

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if self.own_texture is None and self.tint != "heat":
            raise ContradictionError(
                Problem(("tint",), "is the colour of flakes.texture; name one, or use colors")
            )
        if self.own_texture is not None and self.sprite == "pixel":
            raise ContradictionError(
                Problem(("sprite",), "pixel draws squares, but texture names a picture; remove one")
            )
        return self


class MotionBlur(Settings):
    """Blur along the buoyancy field (eq. 14-17)."""

    shutter: float = Field(default=0.7, ge=0, le=4)
    """Time for which the shutter is open, frames."""
    samples: int = Field(default=9, ge=1, le=65)
    """Minimum number of samples along the path of a flame pixel; a path that is longer than as many
    px has one for every px. Flakes are drawn as exact streaks."""
    flame: bool = False
    """Blur the flame layer too, each pixel along the field, the more the higher it is in the
    flame."""
    exaggeration: float = Field(default=8.0, ge=0, le=64)
    """Length of the flame's blur at its top, in distances that the gas moves while the shutter is
    open. κ takes most of it lower down, so that 1 (eq. 17) can hardly be seen in most fires."""


class RampHue(Settings):
    """A ramp of one hue: from nothing through its deep and its pale tints to nearly white."""

    hue: float = Field(ge=0, le=360)
    """Hue, degrees: 0 red, 60 yellow, 120 green, 240 blue."""


def _no_lone_colour(name: str) -> str:
    """Return the name of a ramp; refuse a colour, which is no ramp yet."""
    if name.startswith("#"):
        raise ValueError(
            f'a colour stands in a list of colours from cold to hot: ["{name}", "#ffffff"]'
        )
    return name


def _ramp_branch(value: Any) -> str | None:
    """Return the tag of a ramp's type, or that of several in a list."""
    match value:
        case "none":
            return NONE.tag
        case str():
            return WORD.tag
        case [*colours] if colours and all(isinstance(c, str) and c[:1] == "#" for c in colours):
            return COLOURS.tag
        case list() | tuple():
            return PAIR.tag
        case dict() | Settings():
            return BLOCK.tag
    return None


_RAMP = "the name of a ramp, the path of an image, a list of colours, {hue: degrees}"
_NamedRamp = Annotated[
    str, Field(min_length=1, pattern=r"^[^\x00]+$"), AfterValidator(_no_lone_colour), WORD
]
_RampColours = Annotated[tuple[Color, ...], LIST, Field(min_length=1, max_length=16), COLOURS]
_RampHue = Annotated[RampHue, BLOCK]

FlameRamp = Annotated[
    _NamedRamp | _RampColours | _RampHue,
    Discriminator(
        _ramp_branch, custom_error_type=UNDECIDED, custom_error_message=f"must be {_RAMP}"
    ),
]
"""The colours of a flame by its heat."""


def _ramp_name(ramp: FlameRamp, place: int) -> str:
    """Return the name of the animations in the ramp at a place of a list."""
    if isinstance(ramp, RampHue):
        return f"hue_{ramp.hue:g}"
    return PurePath(ramp).stem if isinstance(ramp, str) else f"ramp_{place}"


class Composite(Settings):
    """Colours of the flame, and how the flake layer is composited onto it, in linear light."""

    ramp: Annotated[
        Off
        | _NamedRamp
        | _RampColours
        | _RampHue
        | Annotated[tuple[FlameRamp, ...], LIST, PAIR, Field(min_length=1, max_length=16)],
        Discriminator(
            _ramp_branch,
            custom_error_type=UNDECIDED,
            custom_error_message=f"must be none, {_RAMP}, or a list of these",
        ),
        OFF,
    ] = "none"
    """Colours of flame and flakes by their heat, in place of the fire's own: ``campfire``, ``gas``,
    ``copper``, ``poison``, ``soul``, ``frost``, ``blackbody``, the path of an image (as of
    ``atlas.ramp``), a list of colours from cold to hot, or ``{hue: 200}``. What is no flame keeps
    its colours. Several in a list are animations of their own, ``name/soul/0000``: images by their
    names, hues as ``hue_200``, colours as ``ramp_1`` by their place in the list."""

    blend: Literal["add", "screen", "over"] = "add"
    """``add`` the light, ``screen`` it (never above 1), or draw flakes ``over`` the flame."""
    intensity: float = Field(default=1.0, ge=0, le=100)
    """Multiplier of the flakes' light, in the pixels and in the tracks."""
    palette: Annotated[Literal["auto", "none", "clip"], OFF] = "auto"
    """``clip``: flakes are opaque, each in the nearest colour that occurs in the clip; soft ones
    are dots with smooth edges, hard ones whole pixels. ``auto``: so for flat art and pixel art
    (``flakes.style``), else ``none``."""

    @property
    def listed_ramps(self) -> tuple[FlameRamp, ...]:
        """The ramps that are in a list, so that animations have their names."""
        if _ramp_branch(self.ramp) != PAIR.tag:
            return ()
        return cast("tuple[FlameRamp, ...]", self.ramp)

    @property
    def ramps(self) -> dict[str, FlameRamp]:
        """The ramps by the names of their animations; one that is not in a list has no name."""
        if self.ramp == "none":
            return {}
        if not self.listed_ramps:
            return {"": cast("FlameRamp", self.ramp)}
        return {_ramp_name(ramp, place): ramp for place, ramp in enumerate(self.listed_ramps)}

    @model_validator(mode="after")
    def _name_each_ramp(self) -> Self:
        """Refuse a list of ramps whose animations cannot have their names."""
        taken = set[str]()
        for place, ramp in enumerate(self.listed_ramps):
            name = _ramp_name(ramp, place)
            if not re.fullmatch(NAME_PATTERN, name):
                problem = "its animations are called like the file; give it a plain name"
            elif name in taken:
                problem = f"another ramp of the list is called {name} too; rename it, or remove one"
            else:
                taken.add(name)
                continue
            raise ContradictionError(Problem(("ramp", place), problem))
        return self


_NONE_OR_BLOCK = either("`none` or a block of settings")

FlakesOrNone = Annotated[Off | Annotated[Flakes, BLOCK], _NONE_OR_BLOCK, OFF]
MotionBlurOrNone = Annotated[Off | Annotated[MotionBlur, BLOCK], _NONE_OR_BLOCK, OFF]
