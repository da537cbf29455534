"""From a recipe's silk to a film that can be looked at."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.generators.silk.dress import dress, images_of_a_loop
from fire_atlas.generators.silk.footage import images_from_seeds, images_of
from fire_atlas.generators.silk.plume import burn
from fire_atlas.generators.silk.render import Film
from fire_atlas.generators.silk.scene import Scene, build_scene, refuse_jumps, refuse_length
from fire_atlas.generators.silk.simulation import Recording, simulate
from fire_atlas.generators.silk.texture import Sequence
from fire_atlas.generators.silk.tint import Tint
from fire_atlas.recipe.silk import SilkSource, Texture
from fire_atlas.recipe.wind import Wind

_PAINTED = 6
"""Most sequences painted; more sheets share them, each from another image on."""

_IMAGES = 8, 96
"""Fewest and most images of a painted sequence."""

_TEXTURE_SIDES = 48, 320
"""Least and greatest height of an image, px."""


@dataclass(frozen=True, slots=True)
class Take:
    """What is to be made of a recipe's silk.

    Attributes:
        source: The recipe's.
        wind: The recipe's.
        seed: Of the build.
        frames: How many.
        fps: Frames per second.
        loops: Whether the first follows the last.
        footage: The clip that is on the sheets, if they are not painted.
    """

    source: SilkSource
    wind: Wind
    seed: int
    frames: int
    fps: float
    loops: bool
    footage: Clip | None = None


def produce(take: Take) -> Film:
    """Simulate and dress the fire that a recipe describes.

    Raises:
        RecipeError: It asks for more than can be done.
        SourceError: The clip for the sheets holds no fire, or not enough.
    """
    source = take.source
    scene = build_scene(source, take.wind, take.seed, take.fps)
    refuse_length(scene, take.frames)
    if take.loops:
        refuse_jumps(scene, take.frames / take.fps)
    told = simulate(scene, take.frames, take.loops)
    texture = source.texture
    if isinstance(texture, Texture) and take.footage is not None:
        sequences = [_from_footage(take, texture, take.footage, scene, told)]
    else:
        sequences = _painted(take, scene, told)
    tint = Tint.of(scene.fuel, source.grading, source.intensity / _overlap(scene))
    worn = dress(sequences, told, tint, take.seed, take.fps, take.loops)
    return Film(scene, told, worn, take.frames, take.loops)


def _from_footage(
    take: Take, texture: Texture, clip: Clip, scene: Scene, told: Recording
) -> Sequence:
    shape, _ = texture_shape(take.source, scene)
    if texture.synthesis == "none":
        return images_of(clip, texture.images, shape, texture.path)
    middle = max(clip.count // 2 - 1, 0)
    seeds = texture.seeds or (middle, min(middle + 1, clip.count - 1))
    energy = float((told.v_rms**2).mean()) / scene.fuel.speed**2
    return images_from_seeds(
        clip, seeds, texture.images, shape, texture.path, take.seed, float(np.clip(energy, 0.25, 4))
    )


def texture_shape(source: SilkSource, scene: Scene) -> tuple[tuple[int, int], float]:
    """((height, width), aspect) of images as fine as the frame shows them."""
    high, wide = _sizes(scene)
    least, most = _TEXTURE_SIDES
    height = int(np.clip(round(0.8 * float(high.max()) * source.height), least, most))
    aspect = float((wide / high).mean())
    return (height, int(np.clip(round(height * aspect), least // 2, 2 * most))), aspect


def _painted(take: Take, scene: Scene, told: Recording) -> list[Sequence]:
    shape, aspect = texture_shape(take.source, scene)
    images = int(np.clip(round(images_of_a_loop(told, scene.fps, take.loops)), *_IMAGES))
    burner = replace(scene.fuel.burner, gas=scene.fuel.gas / scene.fuel.rate)
    count = min(scene.model.sheets, _PAINTED)
    return [burn(burner, images, shape, aspect, take.seed, n) for n in range(count)]


def _sizes(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heights and widths (sheets,) of all sheets at rest, heights."""
    rest = scene.model.rest
    up, across = rest[:, -1, 0] - rest[:, 0, 0], rest[:, 0, -1] - rest[:, 0, 0]
    return np.sqrt((up * up).sum(axis=-1)), np.sqrt((across * across).sum(axis=-1))


def _overlap(scene: Scene) -> float:
    """How many sheets lie behind each other, as an eye sees it on average, or less: light that
    adds up is shared out between them."""
    still = [sheet for sheet, body in enumerate(scene.rider) if body < 0]
    rest = scene.model.rest[still or slice(None)]
    _, wide = _sizes(scene)
    ground = rest[:, 0, :, :2].reshape(-1, 2)
    extent = float(np.ptp(ground, axis=0).max())
    behind = 0.64 * float(wide[still or slice(None)].sum()) / max(extent, 1e-6)
    return float(max(1.0, behind) ** 0.75)
