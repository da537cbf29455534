"""Frames remembered, as far as there is room: a clip is looked at more than once."""

from dataclasses import dataclass, replace

import numpy as np

from fire_atlas.core.picture import Picture, where_covered
from fire_atlas.sources.reel import Reel

ROOM = 64 * 1024 * 1024
"""Bytes of decoded frames kept. A constant: memory must not grow with the length of a clip."""


def remembering(reel: Reel) -> Reel:
    """Return ``reel`` with the frames that were read first kept, up to ``ROOM`` bytes."""
    kept: dict[int, _Kept] = {}
    room = [ROOM]

    def read(i: int) -> Picture:
        known = kept.get(i)
        if known is not None:
            return known.picture()
        picture = reel.read(i)
        found = _Kept.of(picture)
        if found.part.nbytes <= room[0]:
            room[0] -= found.part.nbytes
            kept[i] = found
        return picture

    return replace(reel, read=read)


@dataclass(frozen=True, slots=True)
class _Kept:
    """A picture; of straight colours, without the transparent border that most sprites have.

    Attributes:
        part: What is not border.
        top, left: Where it lies in the picture, px.
        shape: Of the picture.
    """

    part: Picture
    top: int
    left: int
    shape: tuple[int, ...]

    @classmethod
    def of(cls, picture: Picture) -> "_Kept":
        is_stored = picture.dtype.kind == "u"
        if picture.shape[2] < 4 or not is_stored:  # light may shine where nothing is covered
            return cls(picture, 0, 0, picture.shape)
        part = where_covered(picture)
        return cls(picture[part].copy(), part[0].start, part[1].start, picture.shape)

    def picture(self) -> Picture:
        """Return the whole picture; what is fully transparent has lost its colour."""
        if self.part.shape == self.shape:
            return self.part
        whole = np.zeros(self.shape, self.part.dtype)
        height, width = self.part.shape[:2]
        whole[self.top : self.top + height, self.left : self.left + width] = self.part
        return whole
