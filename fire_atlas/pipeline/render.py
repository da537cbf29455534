"""Render frames: compose their layers, encode them, and keep what later steps need."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.encode import encode_sprites, light_images
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.channels.flow import displayed_thumbnail
from fire_atlas.channels.form import form_sprites
from fire_atlas.channels.held_out import choose_held_out
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes, brightness
from fire_atlas.effect.composition.composite import clip_palette, exposed_together
from fire_atlas.effect.composition.light import FrameLight
from fire_atlas.effect.flame.segmentation import Background
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.layers import (
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
from fire_atlas.recipe.output import Layer


@dataclass(frozen=True, slots=True)
class RenderedFrame:
    """A frame, trimmed and encoded.

    Attributes:
        sprites: One per page scale, largest first. The first one's visible box (``lit``) is
            enlarged to cover every layer, so that all maps get the same trim.
        layers: Sprites of each layer that the recipe writes as a map.
        emission: Its light before exposure, one per page scale; empty if that is not written.
        form: Its form, one per page scale; see ``channels.form``. Empty if that is not written.
        thumbnail: The flame, small, (h, w, 4) uint8 premultiplied, if motion vectors are made.
        light: The sums of its light, if light is measured.
        width, height: Size of the whole frame, px.
    """

    sprites: tuple[Sprite, ...]
    layers: Mapping[Layer, tuple[Sprite, ...]]
    emission: tuple[CompressedImage, ...]
    form: tuple[CompressedImage, ...]
    thumbnail: Bytes | None
    light: FrameLight | None
    width: int
    height: int


def render(simulated: SimulatedClip, recipe: Recipe, context: BuildContext) -> list[RenderedFrame]:
    """Render every frame of a clip with its flakes."""
    clip, palette = simulated.clip, None
    if recipe.maps.smoke and clip.smoke is None:
        refuse_without_alpha(clip.matte)
    background = simulated.study.segmentation.background
    if recipe.composite.palette == "clip" and simulated.tracks is not None:
        palette = clip_palette(clip, context.workers)
    frames = render_each(
        lambda i: render_frame(layers_of(i, simulated, recipe), recipe, palette, background),
        range(clip.count),
        context,
    )
    if recipe.maps.smoke and not any(frame.layers["smoke"][0].lit for frame in frames):
        context.progress.note("maps.smoke: no smoke was found, so the map is empty; leave it out")
    return frames


def refuse_without_alpha(matte: str) -> None:
    """Refuse to part smoke from pictures whose coverage is not their own."""
    if matte != "alpha":
        made = "is their brightness" if matte == "luminance" else "hides what is behind them"
        raise SourceError(
            f"maps.smoke: these frames have no alpha of their own (matte: {matte}), and what "
            f"{made} says nothing of smoke; use a clip with alpha, or leave maps.smoke out"
        )


def render_each(
    frame: Callable[[int], RenderedFrame], numbers: Sequence[int], context: BuildContext
) -> list[RenderedFrame]:
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
    maps, atlas = recipe.maps, recipe.atlas
    light = _light_of(layers, recipe, background) if "light" in recipe.tracks else None
    encoded: dict[Layer, tuple[Sprite, ...]] = {}
    if maps.flame:
        encoded["flame"] = encode_sprites(layers.flame, atlas)
    if maps.flakes:
        encoded["flakes"] = encode_sprites(flakes_alone(layers, recipe, palette), atlas)
    if layers.smoke is not None:
        # Smoke hides what is behind it, also where clients add the fire.
        alpha = "straight" if atlas.alpha == "straight" else "premultiplied"
        under = atlas.model_copy(update={"alpha": alpha})
        encoded["smoke"] = encode_sprites(layers.smoke.pixels(atlas.blend_space), under)
    moves = maps.motion != "none"
    moving = layers.flame if layers.picture is None else layers.picture
    thumbnail = displayed_thumbnail(as_light(moving), atlas.blend_space) if moves else None
    emission: tuple[CompressedImage, ...] = ()
    if maps.emission == "exr":
        emission = light_images(emission_of(layers, recipe), atlas.scales)
    height, width = layers.flame.shape[:2]
    whole, *smaller = encode_sprites(compose_layers(layers, recipe, palette), atlas)
    lit = [each.lit for each in (whole, *(each[0] for each in encoded.values())) if each.lit]
    whole = replace(whole, lit=bounding_rect(lit) if lit else None)
    sprites = (whole, *smaller)
    form = () if layers.form is None else form_sprites(layers.form, whole.lit, atlas.scales)
    return RenderedFrame(sprites, encoded, emission, form, thumbnail, light, width, height)


def _light_of(layers: Layers, recipe: Recipe, background: Background | None) -> FrameLight:
    """Return the light of a frame as shown; in an opaque scene, only that of flame and flakes."""
    flame = as_light(layers.flame)
    if background is not None:
        bright = brightness(flame, recipe.atlas.blend_space)
        flame = flame * background.foreground(bright, flame)[..., None]
    if layers.flakes is not None and layers.bakes:
        flame = exposed_together(flame[..., :3], layers.flakes.rgb())
    return FrameLight.of(flame)


def thumbnails_of_skipped_frames(
    simulated: SimulatedClip, recipe: Recipe, context: BuildContext
) -> dict[int, tuple[float, Bytes]]:
    """Return thumbnails of source frames that the clip skips, on which motion vectors are tested.

    The key is the index of the frame before it; the value has its time, as a fraction of the step
    to the next frame, and the thumbnail of its flame. Empty without motion vectors, or if the clip
    has all frames of its source.
    """
    if recipe.maps.motion == "none":
        return {}
    skipped = simulated.clip.skipped

    def thumbnail(i: int) -> tuple[float, Bytes]:
        pixels = flame_of(i, skipped[i].read(), simulated, recipe)
        return skipped[i].time, displayed_thumbnail(as_light(pixels), recipe.atlas.blend_space)

    chosen = choose_held_out(sorted(skipped))
    return dict(zip(chosen, context.workers.map(thumbnail, chosen), strict=True))
