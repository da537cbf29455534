"""Render frames: draw their layers, join them, and keep what later steps need of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.channels.flow import displayed_thumbnail
from fire_atlas.channels.held_out import choose_held_out
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes, brightness
from fire_atlas.effect.composition.composite import clip_palette
from fire_atlas.effect.composition.light import FrameLight
from fire_atlas.effect.flame.segmentation import Background
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.layers import (
    Layers,
    Palette,
    RenderSettings,
    SimulatedClip,
    flakes_alone,
    flame_of,
    join,
    layers_of,
)
from fire_atlas.recipe.output import Layer


@dataclass(frozen=True, slots=True)
class RenderedFrame:
    """A frame, trimmed and encoded.

    Attributes:
        sprites: For the pages of each scale. What counts as visible in the largest includes what
            is visible in the layers, so that one box cuts them all.
        layers: The same of each layer that is asked for.
        thumbnail: The flame, small, (h, w, 4) uint8 premultiplied, where its motion is asked for.
        light: Sums of its light, where that is asked for.
        width, height: Of the whole frame, px.
    """

    sprites: tuple[Sprite, ...]
    layers: Mapping[Layer, tuple[Sprite, ...]]
    thumbnail: Bytes | None
    light: FrameLight | None
    width: int
    height: int


def render(
    simulated: SimulatedClip, settings: RenderSettings, context: BuildContext
) -> list[RenderedFrame]:
    """Render every frame of a clip with its flakes.

    Args:
        simulated: The clip and all that is known of it.
        settings: What the recipe says.
        context: The pool, and who hears of the progress.
    """
    clip, palette = simulated.clip, None
    background = simulated.study.segmentation.background
    if settings.composite.palette == "clip" and simulated.tracks is not None:
        palette = clip_palette(clip, context.workers)
    return render_each(
        lambda i: finish(layers_of(i, simulated, settings), settings, palette, background),
        range(clip.count),
        context,
    )


def render_each(
    frame: Callable[[int], RenderedFrame], numbers: Sequence[int], context: BuildContext
) -> list[RenderedFrame]:
    """Return ``frame(i)`` for each of ``numbers``, rendered in the pool."""
    context.progress.stage("render", len(numbers))
    frames = []
    for rendered in context.workers.map(frame, numbers):
        frames.append(rendered)
        context.progress.advance()
    return frames


def finish(
    layers: Layers,
    settings: RenderSettings,
    palette: Palette | None = None,
    background: Background | None = None,
) -> RenderedFrame:
    """Measure a frame's light before anything of it is clipped, encode its layers, join them.

    Args:
        layers: The frame.
        settings: What the recipe says.
        palette: Colours that flakes are limited to.
        background: What stands still behind the flame, where the clip is an opaque scene.
    """
    maps, atlas = settings.maps, settings.atlas
    light = _light_of(layers, settings, background) if settings.measures_light else None
    encoded: dict[Layer, tuple[Sprite, ...]] = {}
    if maps.flame:
        encoded["flame"] = encode_sprites(layers.flame, atlas)
    if maps.flakes:
        encoded["flakes"] = encode_sprites(flakes_alone(layers, settings, palette), atlas)
    moves = maps.motion != "none"
    thumbnail = displayed_thumbnail(as_light(layers.flame), atlas.blend_space) if moves else None
    height, width = layers.flame.shape[:2]
    whole, *smaller = encode_sprites(join(layers, settings, palette), atlas)
    lit = [each.lit for each in (whole, *(each[0] for each in encoded.values())) if each.lit]
    whole = replace(whole, lit=bounding_rect(lit) if lit else None)
    return RenderedFrame((whole, *smaller), encoded, thumbnail, light, width, height)


def _light_of(
    layers: Layers, settings: RenderSettings, background: Background | None
) -> FrameLight:
    """Measure the light of a frame: of an opaque scene, only what in it is flame."""
    flame = as_light(layers.flame)
    if background is not None:
        bright = brightness(flame, settings.atlas.blend_space)
        flame = flame * background.foreground(bright, flame)[..., None]
    light = FrameLight.of(flame)
    if layers.flakes is None or not layers.bakes:
        return light
    return light + FrameLight.of(layers.flakes)


def flames_between(
    simulated: SimulatedClip, settings: RenderSettings, context: BuildContext
) -> dict[int, tuple[float, Bytes]]:
    """Return the flame, small, as the source shows it between some of the clip's frames, and when.

    By frame; the time is a part of the step to the next one. Only where motion vectors are asked
    for, and only of a clip that has fewer frames than its source.
    """
    if settings.maps.motion == "none":
        return {}
    skipped = simulated.clip.skipped

    def flame(i: int) -> tuple[float, Bytes]:
        seen = flame_of(i, skipped[i].read(), simulated, settings)
        return skipped[i].part, displayed_thumbnail(as_light(seen), settings.atlas.blend_space)

    chosen = choose_held_out(sorted(skipped))
    return dict(zip(chosen, context.workers.map(flame, chosen), strict=True))
