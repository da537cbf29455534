"""ICC profiles, written from what they say."""

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

D50 = (0.9642, 1.0, 0.8249)

P3 = ((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407))
"""X, Y, Z of red, green and blue of Display P3, adapted to D50."""

SRGB = ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410))
"""The same of sRGB."""


def fixed(*numbers: float) -> bytes:
    return struct.pack(f">{len(numbers)}i", *(round(number * 65536) for number in numbers))


def power(gamma: float) -> bytes:
    """A curve that is a power."""
    return b"curv" + struct.pack(">4xIH2x", 1, round(gamma * 256))


def sampled(heights: Sequence[float]) -> bytes:
    """A curve through evenly spaced heights, 0..1."""
    values = [round(height * 65535) for height in heights]
    body = struct.pack(f">4xI{len(values)}H", len(values), *values)
    return b"curv" + body + bytes(-len(body) % 4)


def parametric(kind: int, *numbers: float) -> bytes:
    return b"para" + struct.pack(">4xH2x", kind) + fixed(*numbers)


SRGB_CURVE = parametric(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def profile(space: str, tags: dict[str, bytes], *, pcs: str = "XYZ ", name: str = "test") -> bytes:
    """A profile of version 4; ``space``: ``RGB ``, ``GRAY`` or ``CMYK``."""
    text = name.encode("utf-16-be")
    described = b"mluc" + struct.pack(">4xII2s2sII", 1, 12, b"en", b"US", len(text), 28) + text
    white = b"XYZ " + bytes(4) + fixed(*D50)
    everything = {"desc": described, "wtpt": white, **tags}
    table, bodies, at = b"", b"", 132 + 12 * len(everything)
    for tag, body in everything.items():
        body += bytes(-len(body) % 4)
        table += struct.pack(">4sII", tag.encode(), at + len(bodies), len(body))
        bodies += body
    size = at + len(bodies)
    head = struct.pack(
        ">I4xI4s4s4s12x4s24xI12s48x", size, 0x04300000, b"prtr" if pcs == "Lab " else b"mntr",
        space.encode(), pcs.encode(), b"acsp", 0, fixed(*D50),
    )  # fmt: skip
    assert len(head) == 128
    return head + struct.pack(">I", len(everything)) + table + bodies


def matrix_profile(primaries: Sequence[Sequence[float]], curve: bytes, name: str = "test") -> bytes:
    """A profile of a display: three primaries, adapted to D50, and a curve."""
    tags = {
        f"{c}XYZ": b"XYZ " + bytes(4) + fixed(*p) for c, p in zip("rgb", primaries, strict=True)
    }
    return profile("RGB ", {**tags, **{f"{c}TRC": curve for c in "rgb"}}, name=name)


def grey_profile(curve: bytes, name: str = "test") -> bytes:
    return profile("GRAY", {"kTRC": curve}, name=name)


def table_profile(space: str, corners: Any, name: str = "test") -> bytes:
    """A profile with a table: Lab, 0..255 as stored, at the corners of the cube of the channels,
    (2, ..., 2, 3)."""
    channels = {"RGB ": 3, "CMYK": 4}[space]
    identity = bytes(range(256))
    lut = b"mft1" + bytes(4) + bytes([channels, 3, 2, 0]) + fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    lut += channels * identity + np.asarray(corners, np.uint8).tobytes() + 3 * identity
    return profile(space, {"A2B0": lut}, pcs="Lab ", name=name)
