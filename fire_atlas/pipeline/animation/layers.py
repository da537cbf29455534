"""Draw and compose the layers of a frame: flame and flakes."""

from dataclasses import dataclass, replace
from functools import cache
from threading import Lock
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import BlendSpace, encode_frame, is_page_ready
from fire_atlas.core.clip import Clip, FrontSurface, depth_of
from fire_atlas.core.context import BuildContext
from fire_atlas.core.dither import dithered
from fire_atlas.core.picture import Picture, as_light
from fire_atlas.core.pixels import LIGHT_STEPS, Pixels, Plane, as_steps, expose
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.composition.composite import VISIBLE_LIGHT, compose, emitted
from fire_atlas.effect.composition.cover import FireOverSmoke, hidden_by_coverage, thin_cover
from fire_atlas.effect.composition.smoke import Cover, Smoke, hidden_by_smoke
from fire_atlas.effect.flakes.drawing import add_glow, draw_frame
from fire_atlas.effect.flakes.layer import FlakeLight
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.analyse import Analysis
from fire_atlas.pipeline.animation.recolour import Recolouring
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.models import Recipe

Palette = NDArray[np.float32]
"""(colours, 3) sRGB in 0..1: the only colours that flakes may have."""


@dataclass(frozen=True, slots=True)
class SimulatedClip:
    """A clip with the results of all steps before its frames are rendered.

    Attributes:
        clip: The clip as it is played.
        study: Constants of the whole clip.
        analysis: Spawns and field; None if the recipe has no effect.
        tracks: Flakes, each set that its recipe asks for; the first is drawn. Empty if there are
            none.
        texture: What flakes are drawn with; None for streaks and squares.
        recolouring: The colours that its flame gets; None for its own.
        is_drawn: Whether it is drawn in flat colours or up to an outline: it hides what is behind
            it as it was drawn to.
    """

    clip: Clip
    study: FlameStudy
    analysis: Analysis | None
    tracks: tuple[Tracks, ...]
    texture: TextureCells | None = None
    recolouring: Recolouring | None = None
    is_drawn: bool = False

    def in_ramp(self, ramp: RampLight, context: BuildContext) -> Self:
        """Return the clip with flame and flakes in the colours of a ramp."""
        colours = Recolouring.of(self.clip, self.study.segmentation, ramp, context)
        tracks = tuple(map(colours.tracks, self.tracks))
        return replace(self, tracks=tracks, recolouring=colours)


@dataclass(frozen=True, slots=True)
class Layers:
    """A frame before its layers are composed.

    Attributes:
        flame: (H, W, 4), as from ``Clip.picture``; blurred if the recipe has motion blur, in the
            colours of a ramp if it names one. Without the smoke, if that is a layer of its own.
        flakes: Their light on black, before it is exposed; None if not needed.
        bakes: Whether flakes are drawn into the page.
        picture: The flame with its smoke in its own colours, as it moves.
        smoke: The smoke under the flame; None if it is not apart.
        form: The form of the fire; None if it is not written.
        hidden: (H, W) 0..1, what smoke and things hide of what is behind the flame; None if pages
            hide as much as their coverage says.
        parted: What the flame was before its smoke was taken out of it; None if that was not.
    """

    flame: Picture
    flakes: FlakeLight | None = None
    bakes: bool = True
    picture: Picture | None = None
    smoke: Smoke | None = None
    form: FrontSurface | None = None
    hidden: Plane | None = None
    parted: FireOverSmoke | None = None

    def cover(self, picture: Picture, blend_space: str) -> Plane | None:
        """Return what pages hide behind a picture (H, W, 4) of these layers, as from
        ``thin_cover``; None: as much as its coverage says."""
        if self.hidden is None:
            return None
        # A fire whose smoke is apart hides as much as the fire with its smoke does.
        return thin_cover(picture, self.hidden, blend_space, self.parted)


def layers_of(i: int, simulated: SimulatedClip, recipe: Recipe) -> Layers:
    """Return the layers of frame ``i``."""
    clip, flakes = simulated.clip, recipe.flakes
    smoke = clip.smoke(i) if clip.smoke is not None and recipe.maps.smoke else None
    flame = flame_of(i, clip.picture(i), simulated, recipe)
    layers = replace(
        flame_layers(flame, recipe, smoke), hidden=_hidden(i, flame, simulated, recipe)
    )
    if simulated.recolouring is not None:
        coloured = simulated.recolouring.flame(i, layers.flame, recipe.atlas)
        layers = replace(layers, flame=coloured)
    if recipe.maps.normals or recipe.maps.depth:
        layers = replace(layers, form=depth_of(clip).front_surface(i))
    is_needed = recipe.bakes_flakes or recipe.maps.flakes
    if not simulated.tracks or flakes == "none" or not is_needed:
        return layers
    tracks, *_ = simulated.tracks
    cells = tracks.texture.cells[i] if tracks.texture is not None else None
    light = draw(
        flakes,
        tracks.frames[i],
        clip.height,
        clip.width,
        simulated.texture,
        cells,
        tiles=clip.tiles,
    )
    return replace(layers, flakes=light, bakes=recipe.bakes_flakes)


def flame_layers(picture: Picture, recipe: Recipe, smoke: Plane | None = None) -> Layers:
    """Return the layers of a flame without flakes.

    Args:
        picture: The flame, (H, W, 4).
        recipe: What is drawn.
        smoke: Share of light that black soot keeps back, as from ``Clip.smoke``; None if smoke is
            part of the picture.
    """
    if not recipe.maps.smoke:
        return Layers(picture, picture=picture)
    pixels, atlas = as_light(picture), recipe.atlas
    apart = Smoke.of(pixels, atlas.blend_space) if smoke is None else Smoke.black(smoke)
    cover: Cover = "none" if atlas.alpha == "additive" else "thin" if atlas.thins else "full"
    fire = apart.taken_from(pixels, cover, atlas.blend_space)
    parted = FireOverSmoke(pixels, apart.coverage) if smoke is None else None
    return Layers(fire, picture=picture, smoke=apart, parted=parted)


def _hidden(i: int, flame: Picture, simulated: SimulatedClip, recipe: Recipe) -> Plane | None:
    """Return ``Layers.hidden`` of the flame (H, W, 4) of frame ``i``."""
    clip, atlas = simulated.clip, recipe.atlas
    if not atlas.thins or simulated.is_drawn or clip.matte == "none":
        return None
    if clip.hidden is not None:
        return clip.hidden(i)
    if clip.matte == "alpha" and not recipe.maps.smoke:
        return hidden_by_smoke(flame, atlas.blend_space)
    if clip.matte == "luminance" and clip.flow is None:
        return hidden_by_coverage(flame)
    return np.zeros(flame.shape[:2], np.float32)


def flame_of(i: int, picture: Picture, simulated: SimulatedClip, recipe: Recipe) -> Picture:
    """Return ``picture``, blurred along the field of frame ``i`` if the recipe says so."""
    blur, analysis, clip = recipe.motion_blur, simulated.analysis, simulated.clip
    if analysis is None or not isinstance(blur, MotionBlur) or not blur.flame:
        return picture
    field = analysis.field
    return blur_along(
        as_light(picture), field.u[i], field.v[i], field.cell, simulated.study.kappa,
        blur.exaggeration * blur.shutter / clip.fps, blur.samples, tiles=field.tiles,
    )  # fmt: skip


def draw(
    flakes: Flakes,
    rows: NDArray[np.float64],
    height: int,
    width: int,
    texture: TextureCells | None = None,
    cells: NDArray[np.int64] | None = None,
    *,
    tiles: bool = False,
) -> FlakeLight:
    """Return the flake layer of one frame, drawn as the recipe states.

    Args:
        flakes: The recipe's section.
        rows: (flakes, columns) of the frame, as in ``Tracks.frames``.
        height, width: Size of the frame, px.
        texture: What flakes are drawn with; None for streaks and squares.
        cells: (flakes,), the cell of the texture that each shows.
        tiles: Whether what leaves the frame at one side enters at the other.
    """
    is_hard = flakes.sprite == "pixel"
    light = draw_frame(rows, height, width, is_hard, texture, cells, tiles=tiles)
    if is_hard or not flakes.glow:
        return light
    glowing = add_glow(light, flakes.glow, flakes.edge == "fade", tiles=tiles)
    return replace(glowing, planes=np.stack([_dithered(plane) for plane in glowing.planes]))


def _dithered(light: Plane) -> Plane:
    """Return light (H, W) before exposure of which the dim part is shown without rings."""
    shown = dithered(expose(light)[..., None])[..., 0]
    return np.where(light < 1, shown / (1 - np.minimum(shown, 0.9)), light)


def compose_layers(layers: Layers, recipe: Recipe, palette: Palette | None) -> Picture:
    """Return a frame's layers composed, (H, W, 4). May overwrite a flame of float pixels."""
    if layers.flakes is None or not layers.bakes:
        return layers.flame
    return _with_flakes(layers.flame, layers.flakes, recipe, palette)


def flakes_alone(layers: Layers, recipe: Recipe, palette: Palette | None) -> Picture:
    """Return the flakes (H, W, 4) composed without a flame behind them."""
    empty = np.zeros(layers.flame.shape, np.float32)
    if layers.flakes is None:
        return empty
    return _with_flakes(empty, layers.flakes, recipe, palette)


def emission_of(layers: Layers, recipe: Recipe) -> Pixels:
    """Return the light of a frame's layers together before it is exposed, (H, W, 4).

    A palette does not limit it: what it holds is light, not what is shown of it.
    """
    flame = as_light(layers.flame)
    under = np.ascontiguousarray(flame.reshape(-1, 4).T)
    flakes = np.zeros_like(under[:3])
    if layers.flakes is not None and layers.bakes:
        flakes = layers.flakes.at(np.arange(under.shape[1]))
    light = emitted(under, flakes, recipe.composite.blend, recipe.atlas.blend_space)
    return np.ascontiguousarray(light.T).reshape(flame.shape)


def _with_flakes(
    flame: Picture, flakes: FlakeLight, recipe: Recipe, palette: Palette | None
) -> Picture:
    """Return the flame with flakes; only pixels that flakes touch are computed.

    All others are unchanged: they keep the exact bytes of the source if the page encodes alike.
    """
    touched = flakes.touched()
    if not touched.size:
        return flame
    is_ready = is_page_ready(flame, recipe.atlas)
    whole = flame.copy() if is_ready else np.ascontiguousarray(as_light(flame))
    # Four channels as one value, of 32 bits (uint8) or 128 (float32), are copied much faster.
    values = whole.view(np.uint32 if is_ready else np.complex128).reshape(-1)
    composite, space = recipe.composite, recipe.atlas.blend_space
    if len(flakes.colours) == 1 and palette is None:
        is_bare = whole[..., 3].reshape(-1).take(touched) == 0
        bare, touched = touched[is_bare], touched[~is_bare]
        shown = as_steps(expose(flakes.planes.reshape(-1).take(bare)))
        colour = tuple(flakes.colours[0].tolist())
        with _TABLE_LOCK:
            table = _alone(colour, composite.blend, space, is_ready)
        values[bare] = table.take(shown)
        if not touched.size:
            return whole
    behind = values.take(touched).view(whole.dtype).reshape(1, -1, 4)
    under = np.ascontiguousarray(as_light(behind)[0].T)
    dots = None
    if palette is not None and not recipe.is_pixel_art:
        dots = flakes.dots(VISIBLE_LIGHT).reshape(-1).take(touched)
    pixels = compose(under, flakes.at(touched), composite.blend, space, palette, dots)
    values[touched] = _as_values(pixels, space, is_ready)
    return whole


def _as_values(pixels: NDArray[np.float32], space: BlendSpace, is_ready: bool) -> Picture:
    """Return pixels (4, n) as one value each, (n,), encoded if the page ``is_ready``."""
    light = np.ascontiguousarray(pixels.T)
    if is_ready:
        return encode_frame(light[None], "straight", space).view(np.uint32).reshape(-1)
    return light.view(np.complex128).reshape(-1)


_TABLE_LOCK = Lock()
"""Held while a table is made: the other workers wait for it rather than make the same."""


@cache
def _alone(colour: tuple[float, ...], blend: str, space: BlendSpace, is_ready: bool) -> Picture:
    """Return the value of a pixel that flakes of one colour light and nothing is behind, for every
    step of their exposed light, (65536,)."""
    shown = np.minimum(np.arange(LIGHT_STEPS) / (LIGHT_STEPS - 1), 1 - 1e-7)
    light = np.multiply.outer(colour, shown / (1 - shown)).astype(np.float32)
    nothing = np.zeros((4, LIGHT_STEPS), np.float32)
    return _as_values(compose(nothing, light, blend, space), space, is_ready)
