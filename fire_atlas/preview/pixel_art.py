"""Tell pixel art from other pictures."""

import numpy as np

from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.preview.cut_frames import cut_frames

_MOST_COLOURS = 256


def is_pixel_art(atlas: AtlasFile) -> bool:
    """Return whether all pixels are opaque or transparent, and have few colours.

    Raises:
        SourceError: A page file is missing, or is not as the atlas states.
    """
    colours = np.empty(0, np.uint32)
    for frame in cut_frames(atlas):
        alpha = frame[..., 3]
        if not ((alpha == 0) | (alpha == 255)).all():
            return False
        colours = np.union1d(colours, frame[alpha == 255].view(np.uint32))
        if len(colours) > _MOST_COLOURS:
            return False
    return True
