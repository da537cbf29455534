"""Source ``silk``: simulated cloths of fire, rendered as a clip for each view."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.renderer import SilkView, generate_silk, silk_camera
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frames import open_frames
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
    footage = None
    if texture is not None:
        linear = replace(context, blend_space="linear")
        footage = open_frames(FramesSource(path=str(texture)), texture, linear)
    renderer = generate_silk(source, generation, footage)
    views = generation.views
    inputs = footage.inputs if footage else ()

    def luminance_matte(light: NDArray[np.float32]) -> Pixels:
        return matte.luminance_of_light(light, context.blend_space)

    cameras = [
        silk_camera(source, azimuth, views.elevation, views.distance)
        for azimuth in generation.azimuths()
    ]
    seen = [SilkView(renderer, camera, luminance_matte) for camera in cameras]
    return [rendered_clip(view, generation, context.blend_space, inputs) for view in seen]
