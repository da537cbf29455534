"""Frames remembered, as far as there is room: a clip is looked at more than once."""

from dataclasses import replace

from fire_atlas.sources.picture import Picture
from fire_atlas.sources.reel import Reel

ROOM = 96 * 1024 * 1024
"""Bytes of decoded frames kept. A constant: memory must not grow with the length of a clip."""


def remembering(reel: Reel) -> Reel:
    """Return ``reel`` with the frames that were read first kept, up to ``ROOM`` bytes."""
    kept: dict[int, Picture] = {}

    def read(i: int) -> Picture:
        picture = kept.get(i)
        if picture is None:
            picture = reel.read(i)
            picture.flags.writeable = False
            if len(kept) < ROOM // picture.nbytes:
                kept[i] = picture
        return picture

    return replace(reel, read=read)
