"""Recipe blocks of the fire-flake effect: features, buoyancy, flakes, motion_blur, composite.

Symbols in brackets are those of Kim & Lee 2019, "Fire Sprite Animation Using Fire-Flake Texture
and Artificial Motion Blur". Lengths "in heights" are fractions of the frame's height, so that a
recipe holds at any resolution.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from fire_atlas.recipe.base import (
    BLOCK,
    LIST,
    NUMBER,
    OFF,
    PAIR,
    Auto,
    Color,
    Direction,
    Off,
    Settings,
    either,
    ordered,
)

AutoOrNumber = Annotated[
    Auto | Annotated[float, Field(ge=0, le=10000), NUMBER], either("`auto` or a number")
]
NumberOrDirection = Annotated[
    Annotated[float, Field(ge=-100, le=100), NUMBER] | Annotated[Direction, PAIR],
    either("a number, or two: [x, y]"),
]

PAPER_FEATURES: dict[str, Any] = {"epsilon": 40.0, "n": 5.0, "kappa_over": "image"}
"""The constants of the paper, section III-A, where they differ from the defaults."""

PAPER_ALPHA = 0.03
"""The paper's candidate threshold [α], section III-B."""


class Features(Settings):
    """Feature vectors: the edges of each frame, and where they lead (eq. 1-3)."""

    preset: Literal["auto", "paper"] = "auto"
    """``auto`` adapts to the clip once; ``paper`` is eq. 1-3 with the paper's own constants."""
    sigma: Annotated[
        tuple[Annotated[float, Field(ge=0.3, le=20)], Annotated[float, Field(ge=0.3, le=40)]],
        LIST,
        AfterValidator(ordered),
    ] = (1.0, 1.6)
    """[σ1, σ2] of the two Gaussians whose difference finds edges, px (eq. 1). Larger: thicker
    edges."""
    epsilon: AutoOrNumber = "auto"
    """[ε] Gradients below this are no features (eq. 2), on the 0..255 scale. ``auto``: measured
    once for the whole clip. Paper: 40."""
    n: float = Field(default=1.5, ge=0, le=20)
    """[n] Exponent of κ: how much more the top of the fire counts than its base (eq. 2).
    Paper: 5."""
    kappa_over: Literal["flame", "image"] = "flame"
    """What κ spans, 0 at the bottom to 1 at the top (or along a sideways lift): the flame's own
    box, or the image (paper)."""
    beta: float = Field(default=0.02, ge=0, le=10)
    """[β] How much of the buoyancy direction joins each feature vector (eq. 3)."""
    clamp: float = Field(default=0.0, ge=0, le=10000)
    """Feature vectors shorter than this become 0 (the paper's Figure 23 uses 2.0, to keep flakes
    off a still drum)."""

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("preset") == "paper":
            return {**PAPER_FEATURES, **given}
        return given


class Buoyancy(Settings):
    """The buoyancy field: the velocity field that flakes follow (eq. 12)."""

    motion: Literal["flow", "features"] = "flow"
    """What drives the field inside the flame: dense optical ``flow`` of the clip, or the
    ``features`` alone (paper)."""
    cell: int = Field(default=4, ge=1, le=64)
    """Side of a grid cell, px."""
    coupling: float = Field(default=250.0, ge=0, le=1000)
    """Rate at which the field takes on the flow inside the flame, 1/s."""
    feature_force: float = Field(default=0.1, ge=0, le=100)
    """Acceleration by a typical feature vector [Fv*], heights/s². Typical: the clip's mean
    ‖Fv*‖ over features."""
    lift: NumberOrDirection = 1.2
    """[F_buoyancy] Upward acceleration, heights/s²; or [x, y] (y up) for fire that does not
    rise."""
    gravity: float = Field(default=0.0, ge=-100, le=100)
    """[g] Downward acceleration of field and flakes, heights/s²."""
    drag: float = Field(default=2.0, ge=0, le=1000)
    """Rate at which motion outside the flame decays, 1/s. Speed of the plume: lift / drag."""
    viscosity: float = Field(default=0.0005, ge=0, le=10)
    """[μ] How fast motion spreads to its surroundings, heights²/s."""
    turbulence: float = Field(default=0.2, ge=0, le=100)
    """Speed (rms) of divergence-free turbulence (curl noise) above the flame, heights/s."""
    projection: bool = False
    """Make the field divergence-free in every step (the paper does without)."""


class Flakes(Settings):
    """The fire-flakes (sparks): spawned at candidates, they follow the field (section III-C)."""

    bake: bool = True
    """Draw the flakes into the frames. ``false``: tracks only."""
    alpha: AutoOrNumber = "auto"
    """[α] Feature vectors longer than this are candidates, where flakes spawn. Lower: more
    candidates and more flakes. ``auto``: measured once for the whole clip. Paper: 0.03."""
    rate: Annotated[
        Auto | Annotated[float, Field(ge=0, le=100000), NUMBER], either("`auto` or a number")
    ] = "auto"
    """Spawn rate: flakes per second at the automatic α. ``auto``: by the size of the fire, that is
    the area in which it moves: some 5 for a candle, 30 for a campfire, 90 for a wall of fire;
    fewer where the frame is too small to show flakes of ``size``."""
    bursts: Annotated[
        Auto | Annotated[float, Field(ge=0, le=100), NUMBER], either("`auto` or a number")
    ] = "auto"
    """Bursts per second, each of 3 to 14 small sparks from about one place. ``auto``: one for each
    40 flakes spawned beyond 20; a fire as calm as a candle has none."""
    life: Annotated[
        tuple[Annotated[float, Field(gt=0, le=60)], Annotated[float, Field(gt=0, le=60)]],
        LIST,
        AfterValidator(ordered),
    ] = (0.8, 2.6)
    """[min, max] lifetime of a flake, s: until it has cooled. Less where a one-shot fire burns out,
    so that none is left when it ends."""
    size: Annotated[
        tuple[Annotated[float, Field(gt=0, le=1)], Annotated[float, Field(gt=0, le=1)]],
        LIST,
        AfterValidator(ordered),
    ] = (0.004, 0.024)
    """[min, max] width of a flake's soft sprite, heights. Log-normal between them."""
    stretch: float = Field(default=0.0, ge=0, le=10)
    """Length added along the velocity, in frames of travel, on top of motion blur."""
    scatter: float = Field(default=0.998, ge=-1, le=1)
    """[k] Scattering coefficient (eq. 13): 1 none, towards 0 erratic, negative backward."""
    lag: float = Field(default=0.006, ge=0, le=10)
    """Inertia: seconds a flake of middle size takes to follow the field. Larger flakes lag
    more. 0: none."""
    colors: Annotated[tuple[Color, ...], LIST, Field(min_length=1, max_length=16)] = (
        "#ff3000",
        "#ff5800",
        "#ff7300",
    )
    """Colours by speed, slow to fast, as sRGB hex (Figure 9)."""
    intensity: float = Field(default=6.0, ge=0, le=1000)
    """Light of a fresh flake; above 1 is HDR."""
    edge: Literal["fade", "crop"] = "fade"
    """Flakes that leave the frame ``fade`` towards its border, or are cut (``crop``) by it."""
    glow: float = Field(default=0.0, ge=0, le=10)
    """Light of the soft halo around the flakes, against their own. Not part of the tracks."""
    sprite: Literal["soft", "pixel"] = "soft"
    """``soft`` round sprites, or hard squares of whole pixels (``pixel``), for pixel art."""
    max: int = Field(default=20000, ge=0, le=60000)
    """Most flakes alive at once."""


class MotionBlur(Settings):
    """Blur along the buoyancy field (eq. 14-17)."""

    shutter: float = Field(default=0.5, ge=0, le=4)
    """Part of a frame for which the shutter is open."""
    samples: int = Field(default=9, ge=1, le=65)
    """Samples along the path of a flame pixel. Flakes are drawn as exact streaks."""
    flame: bool = False
    """Blur the flame layer too, each pixel along the field."""


class Composite(Settings):
    """How the flake layer joins the flame layer, in linear light."""

    blend: Literal["add", "screen", "over"] = "add"
    """``add`` light, ``screen`` (never above 1), or lay flakes ``over`` the flame."""
    intensity: float = Field(default=1.0, ge=0, le=100)
    """Multiplies the light of the flakes, in the pixels and in the tracks."""
    palette: Literal["none", "clip"] = "none"
    """``clip``: flakes take the nearest colour that the clip itself has, and cover fully."""


_NONE_OR_BLOCK = either("`none` or a block of settings")

FlakesOrNone = Annotated[Off | Annotated[Flakes, BLOCK], _NONE_OR_BLOCK, OFF]
MotionBlurOrNone = Annotated[Off | Annotated[MotionBlur, BLOCK], _NONE_OR_BLOCK, OFF]
