"""Source ``silk``: simulated cloths of fire, rendered as a clip for each view."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, cached
from fire_atlas.core.fire_in_wind import FireInWind, WindChange, change_shares
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.renderer import (
    SilkView,
    changing_silk,
    generate_silk,
    planned_scene,
    silk_camera,
)
from fire_atlas.generators.silk.sheet_textures import check_texture
from fire_atlas.recipe.silk import SilkSource, Texture
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frames import Footage, examine_frames, open_frames
from fire_atlas.sources.reader import OpeningContext


def open_silk(
    source: SilkSource,
    texture: Path | None,
    generation: GenerationSettings,
    context: OpeningContext,
) -> list[Clip]:
    """Simulate the fire once, and return a clip for each view.

    Args:
        source: The recipe's ``source``.
        texture: Absolute path of the clip for the textures; None if they are procedural.
        generation: Seed, wind, timing and views.
        context: Workers, limits, and the encoding in which the client blends.

    Raises:
        SourceError: The clip is missing, broken, or shows no fire.
        RecipeError: As in ``generate_silk``.
    """
    footage = None if texture is None else open_frames(*_footage(texture, context))
    renderer = generate_silk(source, generation, footage)
    views = generation.views
    cameras = [
        silk_camera(source, azimuth, views.elevation, views.distance)
        for azimuth in generation.azimuths()
    ]
    seen = [SilkView(renderer, camera, _luminance_matte(context)) for camera in cameras]
    inputs = footage.inputs if footage else ()
    return [_clip(view, generation, inputs, context) for view in seen]


def open_silk_in_wind(
    source: SilkSource,
    texture: Path | None,
    generation: GenerationSettings,
    context: OpeningContext,
) -> FireInWind:
    """Simulate the fire in each of the winds that it changes between; see ``open_silk``."""
    footage = None if texture is None else open_frames(*_footage(texture, context))
    inputs = footage.inputs if footage else ()
    camera = silk_camera(source, 0.0, generation.views.elevation, generation.views.distance)
    seen_as = _luminance_matte(context)
    winds = generation.in_each_wind()
    views = [
        SilkView(generate_silk(source, wind_settings, footage), camera, seen_as)
        for wind_settings in winds
    ]
    loops = tuple(
        _clip(view, wind_settings, inputs, context)
        for view, wind_settings in zip(views, winds, strict=True)
    )

    def change(before: int, after: int, start: int, progress: NDArray[np.float64]) -> WindChange:
        return _change(loops[before], views[before], views[after], start, change_shares(progress))

    return FireInWind(loops, change)


def _clip(
    view: SilkView,
    generation: GenerationSettings,
    inputs: tuple[Path, ...],
    context: OpeningContext,
) -> Clip:
    """Return the clip of a view, which knows what stands in its fire."""
    clip = rendered_clip(view, generation, context.blend_space, inputs)
    return replace(clip, solids=cached(view.solids, range(clip.count)))


def _change(
    loop: Clip, before: SilkView, after: SilkView, start: int, shares: NDArray[np.float64]
) -> WindChange:
    """Return the change from ``loop``, seen in ``before``, with the new wind's ``shares`` (count,).

    The nodes of the sheets go from one simulation to the other at the same moments of both.
    """
    frames, count = loop.count, len(shares)
    share = np.zeros(frames)
    share[(start + 1 + np.arange(count)) % frames] = shares

    @cache  # many changes are compared by their loops, and few are drawn
    def view() -> SilkView:
        return replace(before, renderer=changing_silk(before.renderer, after.renderer, share))

    clip = replace(
        loop,
        count=count,
        picture=lambda k: view().frame((start + 1 + k) % frames),
        solids=lambda k: view().solids((start + 1 + k) % frames),
        loop=False,
        flow=None,
    )
    return WindChange(clip, shares, (start + 1 + count) % frames)


def examine_silk(
    source: SilkSource,
    texture: Path | None,
    generation: GenerationSettings,
    context: OpeningContext,
) -> Footage:
    """Return what is known of the fire before it is simulated; see ``open_silk``.

    Raises:
        SourceError: The clip is missing, broken or too short.
        RecipeError: As in ``generate_silk``.
    """
    footage = None if texture is None else examine_frames(*_footage(texture, context))
    for settings in generation.in_each_wind():
        planned_scene(source, settings)
    if footage is not None and footage.exact and isinstance(source.texture, Texture):
        check_texture(source.texture, footage.count)
    return Footage(
        generation.frames,
        (source.width, source.height),
        generation.fps,
        True,
        footage.notes if footage else (),
    )


def _footage(texture: Path, context: OpeningContext) -> tuple[FramesSource, Path, OpeningContext]:
    """Return how the clip for the textures is opened."""
    return FramesSource(path=str(texture)), texture, replace(context, blend_space="linear")


def _luminance_matte(context: OpeningContext) -> Callable[[NDArray[np.float32]], Pixels]:
    return lambda light: matte.luminance_of_light(light, context.blend_space)
