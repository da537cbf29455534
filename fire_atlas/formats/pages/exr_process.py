"""Write the page on stdin, as ``exr.py`` sends it, to stdout as OpenEXR.

Run as ``python -m fire_atlas.formats.pages.exr_process``. The header says nothing of time or place,
so that the same page gives the same bytes.
"""

import io
import os
import sys

import numpy as np
import OpenEXR

from fire_atlas.formats.pages.exr import SIZE


def main() -> None:
    """Read, compress, write."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the library prints on stdout
    data = sys.stdin.buffer.read()
    height, width = SIZE.unpack_from(data)
    pixels = np.frombuffer(data, np.float16, offset=SIZE.size).reshape(height, width, 4)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    written = io.BytesIO()
    OpenEXR.File(header, {"RGBA": pixels}).write(written)
    output.write(written.getvalue())


if __name__ == "__main__":
    main()
