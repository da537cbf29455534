"""Finished animations, and what a recipe contributes to the pages: all of its animations.

A build has one contribution, or one from each member if recipes share pages (``atlas.members``).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from fire_atlas.atlas.sheet import AnimationFrames, Rect, StateGraph
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.core.camera import Camera
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.named_sprite import NamedSprite
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.maps.kinds import KIND, kinds_in
from fire_atlas.maps.maker import AnimationParts, maker_of
from fire_atlas.pipeline.animation.render import RenderedFrame
from fire_atlas.recipe.models import Recipe

if TYPE_CHECKING:
    from fire_atlas.pipeline.animation.flake_texture import PreparedTexture

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
        maps: What was found of it for each map, by kind; None for those of single frames.
        tracks: Flakes, each set that the recipe asks for; empty if there are none.
        bakes_flakes: Whether flakes are drawn into the frames.
        pixel_art: Whether it is pixel art, whose pixels stay sharp when they are shown larger.
        has_hard_edges: Whether it may end abruptly, as drawings and icons do.
        camera: The camera that sees the fire, if it has depth.
        frames_per_place: Number of consecutive frames whose sprites are the same, with the heat of
            each in a channel of its own.
        named: Of sprites, what each frame has of its own; empty for the frames of a clip.
        holds: For how many frames' time each frame is shown; empty: for one.
        statistics: Figures about the clip and its flakes, for the manifest.
        variant: Number of the variant of its fire that it is of; None if that has one only.
    """

    frames: Sequence[RenderedFrame]
    fps: float
    loop: bool
    foot: tuple[float, float] | None = None
    maps: Mapping[str, Any] = field(default_factory=dict)
    tracks: tuple[Tracks, ...] = ()
    bakes_flakes: bool = False
    pixel_art: bool = False
    has_hard_edges: bool = False
    camera: Camera | None = None
    frames_per_place: int = 1
    named: tuple[NamedSprite, ...] = ()
    holds: tuple[int, ...] = ()
    statistics: Mapping[str, Any] = field(default_factory=dict)
    variant: int | None = None

    def frames_for_pages(self, name: str, margin: int) -> AnimationFrames:
        """Return the frames in the largest scale for packing, as the animation ``name``, with so
        many empty px around them."""
        sprites = tuple(frame.sprites[0] for frame in self.frames)
        return AnimationFrames(
            name, sprites, 1000 / self.fps, self.loop, self.foot, self.frames_per_place, self.named,
            margin, self.holds, self.variant,
        )  # fmt: skip

    def all_statistics(self) -> dict[str, Any]:
        """Return the statistics with those of maps, as the manifest states them."""
        of_maps = dict[str, Any]()
        for kind, found in self.maps.items():
            if found is not None:
                of_maps |= maker_of(KIND[kind]).statistics(found)
        return {**self.statistics, **of_maps}

    @property
    def light(self) -> ClipLight | None:
        """The light that the animation gives; None if it was not measured."""
        lights = tuple(frame.light for frame in self.frames if frame.light is not None)
        width = max(frame.width for frame in self.frames)
        height = max(frame.height for frame in self.frames)
        return ClipLight(self.fps, width, height, self.loop, lights) if lights else None


@dataclass(frozen=True, slots=True)
class FinishedSprite:
    """A sprite, ready for packing: its picture, and what it has of its own."""

    frame: RenderedFrame
    named: NamedSprite

    def for_pages(self, margin: int) -> AnimationFrames:
        """Return it in the largest scale for packing, with so many empty px around it: a frame that
        no animation plays."""
        name, sprites = self.named.name, self.frame.sprites[:1]
        return AnimationFrames(name, sprites, 0.0, False, None, named=(self.named,), margin=margin)


def maps_of(
    frames: Sequence[RenderedFrame], parts: AnimationParts, recipe: Recipe, context: BuildContext
) -> dict[str, Any]:
    """Return what is found of an animation for each map that its recipe asks for, by kind."""
    found = {}
    for kind in kinds_in(recipe.maps):
        kept = [frame.maps[kind.name] for frame in frames]
        found[kind.name] = maker_of(kind).of_animation(replace(parts, frames=kept), recipe, context)
    return found


def with_room_for(maps: Mapping[str, Any], frames: Sequence[RenderedFrame]) -> list[RenderedFrame]:
    """Return the frames, whose visible boxes also hold what is seen of their maps alone."""
    return [_enlarged(frame, maps, i) for i, frame in enumerate(frames)]


def _enlarged(frame: RenderedFrame, maps: Mapping[str, Any], i: int) -> RenderedFrame:
    whole, *smaller = frame.sprites
    boxes = [] if whole.visible is None else [whole.visible]
    for kind, found in maps.items():
        seen = None if found is None else maker_of(KIND[kind]).seen(found, i)
        if seen is not None:
            right, bottom = seen.x + seen.width, seen.y + seen.height
            right, bottom = min(right, frame.width), min(bottom, frame.height)
            boxes.append(Rect(seen.x, seen.y, right - seen.x, bottom - seen.y))
    visible = bounding_rect(boxes) if boxes else None
    return replace(frame, sprites=(replace(whole, visible=visible), *smaller))


@dataclass(frozen=True, slots=True)
class Contribution:
    """The animations of one recipe.

    Attributes:
        name: Name of the recipe.
        decided: The recipe, with everything filled in that the class of its fire decides.
        animations: By name.
        statistics: Figures about the animations, for the manifest.
        states: In which order they may follow one another; None if each is played alone.
        texture: The texture of the flakes; None without one.
        single: Sprites that no animation plays.
    """

    name: str
    decided: Recipe
    animations: Mapping[str, FinishedAnimation]
    statistics: dict[str, Any]
    states: StateGraph | None = None
    texture: "PreparedTexture | None" = None
    single: tuple[FinishedSprite, ...] = ()


def animations_by_name(contributions: Sequence[Contribution]) -> dict[str, FinishedAnimation]:
    """Return all animations by their names on the pages.

    If several recipes share pages, the name of an animation begins with that of its recipe; but
    sprites keep the names that the user gave them.

    Raises:
        RecipeError: Two have one name.
    """
    found = dict[str, FinishedAnimation]()
    for recipe in contributions:
        for name, animation in recipe.animations.items():
            title = animation_title(name, recipe.name, recipe.animations, len(contributions))
            title = name if animation.named else title
            if title in found:
                raise RecipeError(
                    f"{recipe.name}: its animation {title} has the name of another one on these "
                    f"pages; rename the files of one, or a recipe"
                )
            found[title] = animation
    return found


def textures_by_name(contributions: Sequence[Contribution]) -> "dict[str, PreparedTexture]":
    """Return the textures of flakes by their names on the pages."""
    return {
        texture_title(contribution.name, len(contributions)): contribution.texture
        for contribution in contributions
        if contribution.texture is not None
    }


def texture_title(recipe: str, recipes: int) -> str:
    """Return the name on the pages of the texture of a recipe's flakes, if pages are those of
    ``recipes``."""
    return TEXTURE if recipes == 1 else f"{recipe}/{TEXTURE}"


def with_cell_names(name: str, contributions: Sequence[Contribution]) -> list[Contribution]:
    """Return the contributions, in whose tracks the cells of textures have their names in the atlas
    ``name``."""
    return [
        _with_cell_names(
            contribution, f"{name}/{texture_title(contribution.name, len(contributions))}"
        )
        for contribution in contributions
    ]


def _with_cell_names(contribution: Contribution, prefix: str) -> Contribution:
    if contribution.texture is None:
        return contribution
    names = tuple(f"{prefix}/{i:04}" for i in range(len(contribution.texture.sprites)))
    return replace(
        contribution,
        animations={
            title: replace(
                animation, tracks=tuple(each.with_cell_names(names) for each in animation.tracks)
            )
            for title, animation in contribution.animations.items()
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
