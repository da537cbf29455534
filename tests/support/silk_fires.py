"""Fires of silk for tests: images on sheets that were synthesised once are not synthesised again.

Whether the same images are synthesised again is for tests of builds to say.
"""

from functools import lru_cache
from unittest.mock import patch

from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk import sheet_textures
from fire_atlas.generators.silk.fuel import Burner
from fire_atlas.generators.silk.procedural_texture import synthesise_texture
from fire_atlas.generators.silk.renderer import SilkRenderer, generate_silk
from fire_atlas.generators.silk.texture_loop import TextureLoop
from fire_atlas.recipe.silk import SilkSource


@lru_cache(maxsize=64)  # half a MB each on average
def _texture(
    burner: Burner, images: int, shape: tuple[int, int], aspect: float, seed: int, index: int
) -> TextureLoop:
    made = synthesise_texture(burner, images, shape, aspect, seed, index)
    made.images.flags.writeable = made.motion.flags.writeable = False
    return made


def silk_fire(source: SilkSource, settings: GenerationSettings) -> SilkRenderer:
    """Return the fire that ``generate_silk`` makes of a recipe without a clip."""
    with patch.object(sheet_textures, "synthesise_texture", _texture):
        return generate_silk(source, settings)
