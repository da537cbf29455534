"""Source ``silk``: simulated sheets of fire, as a clip for each side they are seen from."""

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
    most_pixels: int,
) -> list[Clip]:
    """Simulate the fire once, and return a clip of it from each view.

    Args:
        source: The recipe's section.
        texture: The clip of fire for the textures, if they are not procedural; absolute.
        generation: Seed, wind, timing and views.
        blend_space: ``srgb`` or ``linear``: where the client blends.
        most_pixels: Larger pictures of the clip are refused.

    Raises:
        SourceError: The texture's clip is missing, broken, or holds no fire.
        RecipeError: As of ``generate_silk``.
    """
    footage = None
    if texture is not None:
        footage = open_frames(FramesSource(path=str(texture)), texture, "linear", most_pixels)
    renderer = generate_silk(source, generation, footage)
    elevation = generation.views.elevation
    inputs = footage.inputs if footage else ()

    def luminance_matte(light: NDArray[np.float32]) -> Pixels:
        return matte.luminance_of_light(light, blend_space)

    cameras = [silk_camera(source, azimuth, elevation) for azimuth in generation.azimuths()]
    views = [SilkView(renderer, camera, luminance_matte) for camera in cameras]
    return [rendered_clip(view, generation, blend_space, inputs) for view in views]
