"""The program that decodes OpenEXR files for ``exr.py``, by requests on stdin and stdout.

A request is a line of JSON (``length``, ``header_only``) and the bytes of a file. A reply is a line
of JSON (``shape``, or ``error``) and, unless ``header_only``, the picture: rows of float32 R, G, B
and perhaps A. The program imports no module of ours, so that it starts quickly.
"""

import io
import json
import os
import sys
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

_LARGEST_OVERSCAN = 4
"""Limit on the pixels of the data window, relative to the display window; larger is damaged."""


def main() -> None:
    """Answer requests until stdin ends."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the library prints on stdout
    while line := sys.stdin.buffer.readline():
        request = json.loads(line)
        data = sys.stdin.buffer.read(request["length"])
        reply: dict[str, Any]
        try:
            shape, pixels = (_size if request["header_only"] else _decoded)(data)
            reply = {"shape": shape}
        except Exception as error:
            reply, pixels = {"error": f"{error}"}, b""
        replies.write(json.dumps(reply).encode() + b"\n" + pixels)
        replies.flush()


def _size(data: bytes) -> tuple[tuple[int, ...], bytes]:
    """Return the height and width of the display window, px, from the header."""
    _, header = _colour_part(data)
    return _window(header, "displayWindow")[2:], b""


def _decoded(data: bytes) -> tuple[tuple[int, ...], bytes]:
    """Return shape and bytes of the display window; 0 outside of the data window."""
    number, header = _colour_part(data)
    top, left, height, width = _window(header, "displayWindow")
    data_top, data_left, data_height, data_width = _window(header, "dataWindow")
    if data_height * data_width > _LARGEST_OVERSCAN * height * width:
        raise ValueError("its data window is far larger than its display window")
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True, num_threads=0)
    stored = _colours(file.channels(number))
    picture = np.zeros((height, width, stored.shape[2]), np.float32)
    down, right = data_top - top, data_left - left
    rows = slice(max(0, down), max(0, min(height, down + data_height)))
    columns = slice(max(0, right), max(0, min(width, right + data_width)))
    picture[rows, columns] = stored[
        rows.start - down : rows.stop - down, columns.start - right : columns.stop - right
    ]
    return picture.shape, picture.tobytes()


def _colour_part(data: bytes) -> tuple[int, dict[str, Any]]:
    """Return number and header of the first part with channels R, G and B, or Y (grey)."""
    file = OpenEXR.File(io.BytesIO(data), header_only=True, num_threads=0)
    headers = [part.header for part in file.parts]
    named = [{channel.name for channel in header["channels"]} for header in headers]
    for number, names in enumerate(named):
        if "Y" in names or names >= {"R", "G", "B"}:
            return number, headers[number]
    raise ValueError(f"it holds no channels R, G and B, nor Y, but {sorted(set().union(*named))}")


def _window(header: dict[str, Any], name: str) -> tuple[int, int, int, int]:
    """Return top, left, height and width of a window, px; in files, last row and column are in."""
    (left, top), (right, bottom) = ([int(place) for place in corner] for corner in header[name])
    return top, left, bottom - top + 1, right - left + 1


def _colours(channels: dict[str, Any]) -> NDArray[np.float32]:
    """Return the channels of a part, whatever their number type, as one float32 picture."""
    names = "RGB" if "R" in channels else "YYY"
    planes = [channels[name].pixels for name in (*names, *("A" if "A" in channels else ""))]
    if len({plane.shape for plane in planes}) > 1:
        raise ValueError("its channels differ in resolution")
    return np.stack(planes, axis=2, dtype=np.float32, casting="unsafe")


if __name__ == "__main__":
    main()
