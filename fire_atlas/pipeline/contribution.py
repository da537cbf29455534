"""Finished animations, and what a recipe contributes to the pages: all of its animations.

A build has one contribution, or one from each member if recipes share pages (``atlas.members``).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from fire_atlas.atlas.sheet import AnimationFrames, StateGraph
from fire_atlas.core.camera import Camera
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.pipeline.render import RenderedFrame

if TYPE_CHECKING:
    from fire_atlas.channels.haze import Haze
    from fire_atlas.channels.motion import Motion
    from fire_atlas.pipeline.flake_texture import PreparedTexture

TEXTURE = "flake"
"""Name of a texture among the animations of its recipe: its cells are ``fire/flake/0000`` ..."""


@dataclass(frozen=True, slots=True)
class FinishedAnimation:
    """An animation with rendered frames, ready for packing.

    Attributes:
        frames: In playing order.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        foot: (x, y) of the base of the fire, px, y down; None: the middle of the bottom edge.
        motion: Motion of the flame, if the recipe has motion vectors.
        haze: Refraction of its hot air, if the recipe has haze.
        tracks: Flakes, if there are any.
        bakes_flakes: Whether flakes are drawn into the frames.
        pixel_art: Whether it is pixel art, whose pixels stay sharp when they are shown larger.
        camera: The camera that sees the fire, if it has depth.
        together: Number of consecutive frames whose sprites are the same, with the heat of each in
            a channel of its own.
        statistics: Figures about the clip and its flakes, for the manifest.
    """

    frames: Sequence[RenderedFrame]
    fps: float
    loop: bool
    foot: tuple[float, float] | None = None
    motion: "Motion | None" = None
    haze: "Haze | None" = None
    tracks: Tracks | None = None
    bakes_flakes: bool = False
    pixel_art: bool = False
    camera: Camera | None = None
    together: int = 1
    statistics: Mapping[str, Any] = field(default_factory=dict)

    def frames_for_pages(self, name: str) -> AnimationFrames:
        """Return the frames in the largest scale for packing, as the animation ``name``."""
        sprites = tuple(frame.sprites[0] for frame in self.frames)
        return AnimationFrames(name, sprites, 1000 / self.fps, self.loop, self.foot, self.together)

    def all_statistics(self) -> dict[str, Any]:
        """Return the statistics with those of motion vectors, as the manifest states them."""
        motion = {} if self.motion is None else self.motion.statistics()
        return {**self.statistics, **motion}

    @property
    def light(self) -> ClipLight | None:
        """The light that the animation gives; None if it was not measured."""
        lights = tuple(frame.light for frame in self.frames if frame.light is not None)
        width = max(frame.width for frame in self.frames)
        height = max(frame.height for frame in self.frames)
        return ClipLight(self.fps, width, height, self.loop, lights) if lights else None


@dataclass(frozen=True, slots=True)
class Contribution:
    """The animations of one recipe.

    Attributes:
        name: Name of the recipe.
        animations: By name.
        statistics: Figures about the animations, for the manifest.
        states: In which order they may follow one another; None if each is played alone.
        texture: The texture of the flakes; None without one.
    """

    name: str
    animations: Mapping[str, FinishedAnimation]
    statistics: dict[str, Any]
    states: StateGraph | None = None
    texture: "PreparedTexture | None" = None


def animations_by_name(contributions: Sequence[Contribution]) -> dict[str, FinishedAnimation]:
    """Return all animations by their names on the pages.

    If several recipes share pages, the name of an animation begins with that of its recipe.
    """
    return {
        animation_title(name, each.name, each.animations, len(contributions)): animation
        for each in contributions
        for name, animation in each.animations.items()
    }


def textures_by_name(contributions: Sequence[Contribution]) -> "dict[str, PreparedTexture]":
    """Return the textures of flakes by their names on the pages."""
    return {
        texture_title(each.name, len(contributions)): each.texture
        for each in contributions
        if each.texture is not None
    }


def texture_title(recipe: str, recipes: int) -> str:
    """Return the name on the pages of the texture of a recipe's flakes, if pages are those of
    ``recipes``."""
    return TEXTURE if recipes == 1 else f"{recipe}/{TEXTURE}"


def with_cell_names(name: str, contributions: Sequence[Contribution]) -> list[Contribution]:
    """Return the contributions, in whose tracks the cells of textures have their names in the atlas
    ``name``."""
    return [
        _with_cell_names(each, f"{name}/{texture_title(each.name, len(contributions))}")
        for each in contributions
    ]


def _with_cell_names(contribution: Contribution, prefix: str) -> Contribution:
    if contribution.texture is None:
        return contribution
    names = tuple(f"{prefix}/{i:04}" for i in range(len(contribution.texture.sprites)))
    return replace(
        contribution,
        animations={
            title: replace(each, tracks=each.tracks and each.tracks.with_cell_names(names))
            for title, each in contribution.animations.items()
        },
    )


def animation_title(name: str, recipe: str, animations: Collection[str], recipes: int) -> str:
    """Return the name on the pages of an animation.

    Args:
        name: Of the animation within its recipe.
        recipe: Name of the recipe.
        animations: Names of all animations of the recipe.
        recipes: Number of recipes that share the pages.
    """
    is_only = recipes == 1 or list(animations) == [recipe]
    return name if is_only else f"{recipe}/{name}"
