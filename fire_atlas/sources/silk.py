"""Source ``silk``: fire made from springs becomes a clip for each side it is seen from."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.produce import Take, produce
from fire_atlas.generators.silk.render import SilkRendering, silk_camera
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
        texture: The clip that is on the sheets, if it is not painted; absolute.
        generation: What is asked of the fire.
        blend_space: ``srgb`` or ``linear``: where the client blends.
        most_pixels: Larger pictures of the clip are refused.

    Raises:
        SourceError: The texture's clip is missing, broken, or holds no fire.
        RecipeError: More is asked for than can be done.
    """
    footage = None
    if texture is not None:
        footage = open_frames(FramesSource(path=str(texture)), texture, "linear", most_pixels)
    film = produce(
        Take(
            source, generation.wind, generation.seed, generation.frames, generation.fps,
            generation.loop, footage,
        )
    )  # fmt: skip
    elevation = generation.views.elevation
    inputs = footage.inputs if footage else ()

    def luminance_matte(light: NDArray[np.float32]) -> Pixels:
        return matte.luminance_of_light(light, blend_space)

    cameras = [silk_camera(source, azimuth, elevation) for azimuth in generation.azimuths()]
    renderings = [SilkRendering(film, camera, luminance_matte) for camera in cameras]
    return [rendered_clip(each, generation, blend_space, inputs) for each in renderings]
