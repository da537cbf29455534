"""Render frames: compose their layers, encode them, and keep what later steps need."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar, cast

from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, as_light
from fire_atlas.core.pixels import brightness
from fire_atlas.effect.composition.composite import clip_palette, exposed_together
from fire_atlas.effect.composition.light import FrameLight
from fire_atlas.effect.flame.segmentation import Background
from fire_atlas.maps.kinds import KIND, kinds_in
from fire_atlas.maps.maker import FrameData, FrameParts, maker_of
from fire_atlas.pipeline.animation.layers import (
    Layers,
    Palette,
    SimulatedClip,
    compose_layers,
    emission_of,
    flakes_alone,
    flame_of,
    layers_of,
)
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.silk import SilkSource

_Rendered = TypeVar("_Rendered")


@dataclass(frozen=True, slots=True)
class RenderedFrame:
    """A frame, trimmed and encoded.

    Attributes:
        sprites: One per page scale, largest first. The first one's visible box (``visible``) is
            enlarged to cover every layer, so that all maps get the same trim.
        maps: What is kept of it for each map, by kind.
        light: The sums of its light, if light is measured.
        width, height: Size of the whole frame, px.
    """

    sprites: tuple[Sprite, ...]
    maps: Mapping[str, FrameData]
    light: FrameLight | None
    width: int
    height: int

    def under(self) -> list[Sprite]:
        """Return what is drawn under it, at full size, of the maps that have it."""
        return [cast("Sprite", kept[0]) for name, kept in self.maps.items() if KIND[name].is_under]

    def layers(self) -> list[Sequence[Sprite]]:
        """Return the sprites of each map that is drawn like the page, the largest first."""
        return [
            cast("Sequence[Sprite]", kept)
            for name, kept in self.maps.items()
            if KIND[name].holds == "colours"
        ]


def render(simulated: SimulatedClip, recipe: Recipe, context: BuildContext) -> list[RenderedFrame]:
    """Render every frame of a clip with its flakes."""
    clip, palette = simulated.clip, None
    if recipe.maps.smoke and clip.smoke is None:
        refuse_without_alpha(clip.matte)
    background = simulated.study.segmentation.background
    if recipe.composite.palette == "clip" and simulated.tracks:
        palette = clip_palette(clip, context.workers)
        if simulated.recolouring is not None:
            palette = simulated.recolouring.palette(palette)
    frames = render_each(
        lambda i: render_frame(layers_of(i, simulated, recipe), recipe, palette, background),
        range(clip.count),
        context,
    )
    if recipe.maps.smoke and not any(_is_seen(frame.maps["smoke"]) for frame in frames):
        context.progress.note("maps.smoke: no smoke was found, so the map is empty; leave it out")
    elif recipe.maps.smoke and isinstance(recipe.source, SilkSource):
        context.progress.note(
            "maps.smoke: of silk it is the soot in the flame, which is black and stays there; "
            "smoke that rises is made by source.kind: fluid"
        )
    return frames


def refuse_without_alpha(matte: str) -> None:
    """Refuse to part smoke from pictures whose coverage is not their own."""
    if matte != "alpha":
        made = "is their brightness" if matte == "luminance" else "hides what is behind them"
        raise SourceError(
            f"these frames have no alpha of their own (matte: {matte}), and what {made} says "
            f"nothing of smoke; use a clip with alpha, or leave it out",
            key=("maps", "smoke"),
        )


def render_each(
    frame: Callable[[int], _Rendered], numbers: Sequence[int], context: BuildContext
) -> list[_Rendered]:
    """Return ``frame(i)`` for each of ``numbers``, rendered by all workers."""
    context.progress.stage("render", len(numbers))
    frames = []
    for rendered in context.workers.map(frame, numbers):
        frames.append(rendered)
        context.progress.advance()
    return frames


def render_frame(
    layers: Layers,
    recipe: Recipe,
    palette: Palette | None = None,
    background: Background | None = None,
) -> RenderedFrame:
    """Render a frame: measure its light as shown, compose and encode its layers.

    Args:
        layers: The layers of the frame.
        recipe: What is drawn, and how it is encoded.
        palette: Colours that flakes may have.
        background: The static background, if the clip is an opaque scene.
    """
    light = _light_of(layers, recipe, background) if "light" in recipe.tracks else None
    parts = FrameParts(
        flame=layers.flame,
        moving=layers.flame if layers.picture is None else layers.picture,
        flakes=lambda: flakes_alone(layers, recipe, palette),
        light=lambda: emission_of(layers, recipe),
        smoke=layers.smoke,
        form=layers.form,
        cover=lambda picture: layers.cover(picture, recipe.atlas.blend_space),
    )
    kinds = kinds_in(recipe.maps)
    maps = {
        kind.name: maker_of(kind).of_frame(kind, parts, recipe) for kind in kinds if not kind.is_cut
    }
    height, width = layers.flame.shape[:2]
    composed = compose_layers(layers, recipe, palette)
    whole, *smaller = encode_sprites(
        composed, recipe.atlas, layers.cover(composed, recipe.atlas.blend_space)
    )
    frame = RenderedFrame((whole, *smaller), maps, light, width, height)
    drawn = whole, *(layer[0] for layer in frame.layers())
    boxes = [sprite.visible for sprite in drawn if sprite.visible]
    visible = bounding_rect(boxes) if boxes else None
    parts = replace(parts, visible=visible)
    cut = {kind.name: maker_of(kind).of_frame(kind, parts, recipe) for kind in kinds if kind.is_cut}
    sprites = replace(whole, visible=visible), *smaller
    return replace(frame, sprites=sprites, maps={**maps, **cut})


def _is_seen(kept: FrameData) -> bool:
    """Return whether anything of a layer is visible."""
    return cast("Sequence[Sprite]", kept)[0].visible is not None


def _light_of(layers: Layers, recipe: Recipe, background: Background | None) -> FrameLight:
    """Return the light of a frame as shown; in an opaque scene, only that of flame and flakes."""
    flame = as_light(layers.flame)
    if background is not None:
        # In its own colours: a flame in those of a ramp may be of no fire's.
        own = flame if layers.picture is None else as_light(layers.picture)
        bright = brightness(own, recipe.atlas.blend_space)
        flame = flame * background.foreground(bright, own)[..., None]
    if layers.flakes is not None and layers.bakes:
        flame = exposed_together(flame[..., :3], layers.flakes.rgb())
    return FrameLight.of(flame)


def skipped_flames(
    simulated: SimulatedClip, recipe: Recipe
) -> dict[int, tuple[float, Callable[[], Picture]]]:
    """Return the source frames that a clip skips, by the index of the frame before each: its time,
    as a fraction of the step to the next frame, and what gives its flame."""
    skipped = simulated.clip.skipped
    return {
        i: (between.time, partial(_flame_between, i, between.read, simulated, recipe))
        for i, between in skipped.items()
    }


def _flame_between(
    i: int, read: Callable[[], Picture], simulated: SimulatedClip, recipe: Recipe
) -> Picture:
    return flame_of(i, read(), simulated, recipe)
