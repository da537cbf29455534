"""The program that decodes OpenEXR files for ``exr.py``, by requests on stdin and stdout.

A request is a line of JSON (``length``, ``parts``: how many the file has, ``part``: number of one,
``channels``: names of some of its channels) and the bytes of a file. A reply is a line of JSON
(``shapes`` of the channels' planes, or ``error``) and the planes: rows of float32. The program
imports no module of ours, so that it starts quickly.
"""

import io
import json
import os
import sys
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray


def main() -> None:
    """Answer requests until stdin ends."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the library prints on stdout
    while line := sys.stdin.buffer.readline():
        request = json.loads(line)
        data = sys.stdin.buffer.read(request["length"])
        reply: dict[str, Any]
        try:
            planes = _planes(data, request)
            reply = {"shapes": [plane.shape for plane in planes]}
        except Exception as error:
            reply, planes = {"error": f"{error}"}, []
        replies.write(json.dumps(reply).encode() + b"\n")
        replies.writelines(plane.tobytes() for plane in planes)
        replies.flush()


def _planes(data: bytes, request: dict[str, Any]) -> list[NDArray[np.float32]]:
    """Return the channels that are asked for, whatever their number type, as float32."""
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True, num_threads=0)
    if len(file.parts) != request["parts"]:
        raise ValueError("a part of it cannot be decoded")  # the library leaves it out
    channels = file.channels(request["part"])
    return [channels[name].pixels.astype(np.float32) for name in request["channels"]]


if __name__ == "__main__":
    main()
