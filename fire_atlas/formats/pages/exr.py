"""Write pages of linear light as OpenEXR."""

import struct
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import OutputError
from fire_atlas.core.process import run_module

SIZE = struct.Struct("<II")
"""Height and width of a page, px, before its pixels."""


def write_exr(file: BinaryIO, image: NDArray[Any]) -> None:
    """Write an (H, W, 4) float16 page of premultiplied linear R, G, B, A.

    A separate process calls the library, which holds Python's interpreter lock.

    Raises:
        OutputError: The library failed.
    """
    pixels = np.ascontiguousarray(image, np.float16)
    data = SIZE.pack(*pixels.shape[:2]) + pixels.tobytes()
    done = run_module("fire_atlas.formats.pages.exr_process", data)
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise OutputError(f"OpenEXR failed ({reason}); leave out maps.emission")
    file.write(done.stdout)
