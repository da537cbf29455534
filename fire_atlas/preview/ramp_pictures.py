"""Pictures of a finished fire in each of the ready ramps, to choose one by."""

import base64
import io
from typing import NamedTuple

import numpy as np
from PIL import Image

from fire_atlas.atlas.encode import as_straight
from fire_atlas.core.picture import to_light
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.heat.ramp_colours import HeatColours, Light, OwnColours, shown
from fire_atlas.heat.ready import ready_light
from fire_atlas.preview.cut_frames import cut_frames, shown_alpha
from fire_atlas.recipe.ramps import READY_RAMPS

_SIDE = 128
"""Longest side of a picture, px."""


class RampPicture(NamedTuple):
    """A picture of a fire in a ramp.

    Attributes:
        ramp: Name of the ramp.
        picture: The frame with straight alpha, as base64 of a PNG file.
    """

    ramp: str
    picture: str


def ramp_pictures(atlas: AtlasFile) -> list[RampPicture]:
    """Return the brightest frame of an atlas in each ready ramp; none of an opaque scene.

    What is no flame is told by its colour, which is all that finished pages say of it.
    """
    sheet = atlas.sheet
    frame = max(cut_frames(atlas), key=lambda frame: int(frame[..., :3].sum()))
    straight = as_straight(frame, shown_alpha(sheet), sheet.blend_space)
    if straight[..., 3].min() == 255:
        return []
    image = Image.fromarray(straight)
    image = image.crop(image.getchannel("A").getbbox())
    image.thumbnail((_SIDE, _SIDE))
    small = np.asarray(image)
    seen = shown(to_light(small).reshape(-1, 4), "srgb")
    share = OwnColours.of(seen, "srgb", is_matted=True).share(seen)[:, None]
    pictures = []
    for name in READY_RAMPS:
        coloured = HeatColours.of(ready_light(name), "srgb").of_flame(seen)
        mixed = seen + (coloured - seen) * share
        pictures.append(RampPicture(name, _png(mixed, small.shape)))
    return pictures


def _png(seen: Light, shape: tuple[int, ...]) -> str:
    straight = seen.copy()
    straight[:, :3] /= np.maximum(seen[:, 3:], 1e-6)
    image: Bytes = np.rint(np.clip(straight, 0, 1) * 255).astype(np.uint8).reshape(shape)
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()
