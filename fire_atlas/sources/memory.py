"""Frames remembered, as far as there is room: a clip is looked at more than once."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels

ROOM = 80 * 1024 * 1024
"""Bytes of decoded frames kept. A constant: memory must not grow with the length of a clip."""


def remembering(clip: Clip) -> Clip:
    """Return ``clip`` with the frames that were read first kept, up to ``ROOM`` bytes."""
    kept: dict[int, Pixels] = {}
    most = ROOM // (clip.width * clip.height * 16)

    def read(i: int) -> Pixels:
        pixels = kept.get(i)
        if pixels is None:
            pixels = clip.read(i)
            pixels.flags.writeable = False
            if len(kept) < most:
                kept[i] = pixels
        return pixels

    return replace(clip, read=read)
