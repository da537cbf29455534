"""Source ``silk``: fire made from springs becomes a clip for each side it is seen from."""

from pathlib import Path

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.camera import Camera
from fire_atlas.generators.silk.produce import Take, produce
from fire_atlas.generators.silk.render import Film
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
    elevation, size = generation.views.elevation, (source.width, source.height)
    cameras = [Camera(turn, elevation, *size, source.foot) for turn in generation.azimuths()]
    inputs = footage.inputs if footage else ()
    return [_clip(film, camera, blend_space, inputs) for camera in cameras]


def _clip(film: Film, camera: Camera, space: str, inputs: tuple[Path, ...]) -> Clip:
    def picture(i: int) -> Pixels:
        frame = film.look(i, camera)
        pixels = matte.luminance_of_light(frame.light, space)
        if not frame.cover.any():
            return pixels
        # What is opaque covers fully; flames in front of it have added their light to it.
        cover = frame.cover[..., None]
        opaque = np.dstack([frame.light, np.ones_like(frame.cover)])
        return np.asarray(pixels + (opaque - pixels) * cover, np.float32)

    return Clip(
        width=camera.width,
        height=camera.height,
        fps=film.scene.fps,
        count=film.frames,
        picture=picture,
        inputs=inputs,
        blend_space=space,
        matte="luminance",
        matte_reason="flames cover as far as they shine",
        loop=film.loops,
        flow=lambda i: film.flow(i, camera),
    )
