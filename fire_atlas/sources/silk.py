"""Source ``silk``: fire made from springs becomes a clip for each side it is seen from."""

from pathlib import Path

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.silk.camera import Camera
from fire_atlas.generators.silk.produce import Take, produce
from fire_atlas.generators.silk.render import Film
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frames import DEFAULT_FPS, open_frames

FRAMES = 48
"""Frames of a fire whose recipe does not say how many: two seconds."""


def open_silk(settings: SilkSource, recipe: Recipe, texture: Path | None) -> dict[str, Clip]:
    """Simulate the fire once, and return a clip of it from each of the recipe's ``views``.

    Args:
        settings: The recipe's ``source``.
        recipe: The rest of it: seed, wind, views, timeline.
        texture: The clip that is on the sheets, if it is not painted; absolute.

    Raises:
        SourceError: The texture's clip is missing, broken, or holds no fire.
        RecipeError: More is asked for than can be done.
    """
    timeline, count = recipe.timeline, recipe.views.count
    footage = None
    if texture is not None:
        footage = open_frames(FramesSource(path=str(texture)), texture, "linear")
    take = Take(
        settings, recipe.wind, recipe.seed, timeline.frames or FRAMES, timeline.fps or DEFAULT_FPS,
        timeline.loop == "auto", footage,
    )  # fmt: skip
    film = produce(take)
    clips = {}
    for k in range(count):
        azimuth = 360 * k / count
        camera = Camera(
            azimuth, recipe.views.elevation, settings.width, settings.height, settings.foot
        )
        name = recipe.name if count == 1 else f"view_{k}"
        clips[name] = _clip(film, camera, recipe, footage.inputs if footage else ())
    return clips


def _clip(film: Film, camera: Camera, recipe: Recipe, inputs: tuple[Path, ...]) -> Clip:
    space = recipe.atlas.blend_space

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
