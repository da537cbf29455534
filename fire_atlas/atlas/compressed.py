"""Frames in more than 8 bits a channel, kept compressed until their page is drawn."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import DTypeLike, NDArray
from zlib_ng import zlib_ng


@dataclass(frozen=True, slots=True)
class CompressedImage:
    """Pixels of a frame, without the empty space around them.

    Attributes:
        data: (4, h, w) of ``dtype``, compressed.
        dtype: uint16, encoded as the pages are; or float16, premultiplied linear light and
            coverage.
        x, y: Position of its top-left corner in the frame, px.
        width, height: Its size, px; may be 0.
    """

    data: bytes
    dtype: DTypeLike
    x: int
    y: int
    width: int
    height: int

    @classmethod
    def of(cls, image: NDArray[Any], x: int, y: int) -> Self:
        """Compress an image (h, w, 4) that lies at (x, y) of its frame."""
        planes = image.transpose(2, 0, 1).tobytes()
        return cls(zlib_ng.compress(planes, 1), image.dtype, x, y, image.shape[1], image.shape[0])

    @property
    def image(self) -> NDArray[Any]:
        """Its pixels, (h, w, 4)."""
        planes = np.frombuffer(zlib_ng.decompress(self.data), self.dtype)
        return planes.reshape(4, self.height, self.width).transpose(1, 2, 0)
