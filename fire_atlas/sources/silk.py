"""Source ``silk``: simulated cloths of fire, rendered as a clip for each view."""

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


def open_silk(
    source: SilkSource,
    texture: Path | None,
    generation: GenerationSettings,
    blend_space: str,
    max_pixels: int,
) -> list[Clip]:
    """Simulate the fire once, and return a clip for each view.

    Args:
        source: The recipe's ``source``.
        texture: Absolute path of the clip for the textures; None if they are procedural.
        generation: Seed, wind, timing and views.
        blend_space: Encoding in which the client blends, ``srgb`` or ``linear``.
        max_pixels: Limit on the pixels of a picture of that clip.

    Raises:
        SourceError: The clip is missing, broken, or shows no fire.
        RecipeError: As in ``generate_silk``.
    """
    footage = None
    if texture is not None:
        footage = open_frames(FramesSource(path=str(texture)), texture, "linear", max_pixels)
    renderer = generate_silk(source, generation, footage)
    elevation = generation.views.elevation
    inputs = footage.inputs if footage else ()

    def luminance_matte(light: NDArray[np.float32]) -> Pixels:
        return matte.luminance_of_light(light, blend_space)

    cameras = [silk_camera(source, azimuth, elevation) for azimuth in generation.azimuths()]
    views = [SilkView(renderer, camera, luminance_matte) for camera in cameras]
    return [rendered_clip(view, generation, blend_space, inputs) for view in views]
