"""The layers of a frame, flame and flakes, and how they are joined."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame, is_page_ready
from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import Picture, as_light, to_light
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.composition.composite import compose
from fire_atlas.effect.flakes.drawing import add_halo, draw_flakes, draw_pixels
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.analyse import Analysis
from fire_atlas.recipe.effect import Composite, Flakes, FlakesOrNone, MotionBlur, MotionBlurOrNone
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas, Maps

Palette = NDArray[np.float32]
"""(colours, 3) sRGB in 0..1 that flakes are limited to."""


@dataclass(frozen=True, slots=True)
class SimulatedClip:
    """A clip with all that is known of it before its frames are drawn.

    Attributes:
        clip: As it is played.
        study: What holds for the whole clip.
        analysis: Births and field; None where nothing is done to the flame.
        tracks: The flakes; None where there are none.
    """

    clip: Clip
    study: FlameStudy
    analysis: Analysis | None
    tracks: Tracks | None


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """The sections of a recipe that drawing a frame reads.

    Attributes:
        bakes_flakes: Whether flakes are drawn into the pixels of the pages.
        measures_light: Whether the light of each frame is measured.
    """

    motion_blur: MotionBlurOrNone
    flakes: FlakesOrNone
    composite: Composite
    atlas: Atlas
    maps: Maps
    bakes_flakes: bool
    measures_light: bool

    @classmethod
    def of(cls, recipe: Recipe) -> Self:
        """Take the sections from a recipe."""
        return cls(
            motion_blur=recipe.motion_blur,
            flakes=recipe.flakes,
            composite=recipe.composite,
            atlas=recipe.atlas,
            maps=recipe.maps,
            bakes_flakes=recipe.flakes != "none" and recipe.flakes.bake,
            measures_light="light" in recipe.tracks,
        )


@dataclass(frozen=True, slots=True)
class Layers:
    """A frame that is not joined yet.

    Attributes:
        flame: (H, W, 4), as of ``Clip.picture``; blurred if asked.
        flakes: (H, W, 3) their light on black, may exceed 1; None where nobody sees them.
        bakes: Whether they are joined with the flame.
    """

    flame: Picture
    flakes: NDArray[np.float32] | None = None
    bakes: bool = True


def layers_of(i: int, simulated: SimulatedClip, settings: RenderSettings) -> Layers:
    """Return frame ``i`` as flame and flakes."""
    clip, tracks, flakes = simulated.clip, simulated.tracks, settings.flakes
    flame = flame_of(i, clip.picture(i), simulated, settings)
    is_seen = settings.bakes_flakes or settings.maps.flakes
    if tracks is None or flakes == "none" or not is_seen:
        return Layers(flame)
    light = draw(flakes, tracks.frames[i], clip.height, clip.width)
    return Layers(flame, light, settings.bakes_flakes)


def flame_of(
    i: int, picture: Picture, simulated: SimulatedClip, settings: RenderSettings
) -> Picture:
    """Return the flame of a ``picture`` shown at frame ``i``, blurred along the field if asked."""
    blur, analysis, clip = settings.motion_blur, simulated.analysis, simulated.clip
    if analysis is None or not isinstance(blur, MotionBlur) or not blur.flame:
        return picture
    field = analysis.field
    return blur_along(
        as_light(picture), field.u[i], field.v[i], field.cell, simulated.study.kappa,
        blur.shutter / clip.fps, blur.samples,
    )  # fmt: skip


def draw(flakes: Flakes, rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Draw the flake layer (height, width, 3) of one frame as the recipe wants it.

    Args:
        flakes: The recipe's section.
        rows: (flakes, columns) of the frame, as in ``Tracks.frames``.
        height, width: Of the frame, px.
    """
    if flakes.sprite == "pixel":
        return draw_pixels(rows, height, width)
    light = draw_flakes(rows, height, width)
    return add_halo(light, flakes.glow, flakes.edge == "fade") if flakes.glow > 0 else light


def join(layers: Layers, settings: RenderSettings, palette: Palette | None) -> Picture:
    """Compose a frame's layers (H, W, 4) as the recipe wants it; light is changed in place."""
    if layers.flakes is None or not layers.bakes:
        return layers.flame
    return _with_flakes(layers.flame, layers.flakes, settings, palette)


def flakes_alone(layers: Layers, settings: RenderSettings, palette: Palette | None) -> Picture:
    """Return the flakes (H, W, 4) as they would be with no flame behind them."""
    empty = np.zeros(layers.flame.shape, np.float32)
    if layers.flakes is None:
        return empty
    return _with_flakes(empty, layers.flakes, settings, palette)


def _with_flakes(
    flame: Picture, flakes: NDArray[np.float32], settings: RenderSettings, palette: Palette | None
) -> Picture:
    """Return the flame with its flakes; only pixels that flakes touch are made anew.

    Where the page holds the flame as its file does, the others stay as they are stored.
    """
    lit = np.flatnonzero(cv2.transform(flakes, np.ones((1, 3), np.float32)) > 0)
    if not lit.size:
        return flame
    blend, space = settings.composite.blend, settings.atlas.blend_space
    is_ready = is_page_ready(flame, settings.atlas)
    whole = flame.copy() if is_ready else np.ascontiguousarray(as_light(flame))
    under = to_light(_taken(whole, lit)[None])[0] if is_ready else _taken(whole, lit)
    pixels = compose(under, _taken(flakes, lit), blend, space, palette)
    pixels = encode_frame(pixels[None], "straight", space)[0] if is_ready else pixels
    # A pixel at a time: as one number each they are put several times as fast.
    number = np.uint32 if is_ready else np.complex128
    whole.view(number).reshape(-1)[lit] = pixels.view(number).reshape(-1)
    return whole


def _taken(picture: Picture, places: NDArray[np.intp]) -> Picture:
    """Return the pixels (places, channels) of a picture at ``places``, counted row by row."""
    return np.take(picture.reshape(-1, picture.shape[2]), places, axis=0)
