"""What is kept of a rendered frame: its bytes for the pages and beside them, and its light."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.layout import Sprite
from fire_atlas.atlas.trim import around
from fire_atlas.channels.flow import picture
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes, brightness
from fire_atlas.effect.composition.light import FrameLight
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.analyse import Analysis
from fire_atlas.pipeline.effect import Layers, flakes_alone, join
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Layer


@dataclass(frozen=True, slots=True)
class Finished:
    """A frame, trimmed and encoded.

    Attributes:
        sprites: For the pages of each scale. What counts as visible in the largest includes what
            is visible in the layers, so that one box cuts them all.
        layers: The same of each layer that is asked for.
        picture: The flame, small, where its motion is asked for.
        light: Sums of its light, where that is asked for.
        width, height: Of the whole frame, px.
    """

    sprites: tuple[Sprite, ...]
    layers: Mapping[Layer, tuple[Sprite, ...]]
    picture: Bytes | None
    light: FrameLight | None
    width: int
    height: int


def finish(
    parts: Layers, recipe: Recipe, analysis: Analysis | None, study: FlameStudy | None
) -> Finished:
    """Measure a frame's light before anything of it is clipped, look at its layers, join them."""
    maps, settings = recipe.maps, recipe.atlas
    light = _measured(parts, recipe, study) if "light" in recipe.tracks else None
    layers: dict[Layer, tuple[Sprite, ...]] = {}
    if maps.flame:
        layers["flame"] = encode_sprites(parts.flame, settings)
    if maps.flakes:
        layers["flakes"] = encode_sprites(flakes_alone(parts, recipe, analysis), settings)
    moves = maps.motion != "none"
    small = picture(as_light(parts.flame), settings.blend_space) if moves else None
    height, width = parts.flame.shape[:2]
    whole, *smaller = encode_sprites(join(parts, recipe, analysis), settings)
    lit = [each.lit for each in (whole, *(each[0] for each in layers.values())) if each.lit]
    whole = replace(whole, lit=around(lit) if lit else None)
    return Finished((whole, *smaller), layers, small, light, width, height)


def _measured(parts: Layers, recipe: Recipe, study: FlameStudy | None) -> FrameLight:
    """Measure the light of a frame: of an opaque scene, only what in it is flame."""
    flame = as_light(parts.flame)
    if study is not None and study.mask.scene is not None:
        shown = brightness(flame, recipe.atlas.blend_space)
        flame = flame * study.mask.scene.flame(shown, flame)[..., None]
    light = FrameLight.of(flame)
    return light if parts.flakes is None or not parts.bakes else light + FrameLight.of(parts.flakes)
