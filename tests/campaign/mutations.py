"""Ways to spoil a file: bytes of any format, values of JSON, chunks of PNG with sound checksums."""

import json
import re
import struct
import zlib
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np

Chance = np.random.Generator

ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 7, 65_537, 2**31, 2**63, 10**40, -(10**40), 0.5, -0.0, 1e-300,
    1e308, float("nan"), float("inf"), "", "a", "0", "../x", "/etc/passwd", "a\0b", "\ud800",
    "[red]x[/]", "{{ name }}", "\x1b[31m", "é" * 300, [], [[]], [0], [-1, 1e9], {}, {"a": 1},
)  # fmt: skip
"""Values that nobody expects."""


def _times(chance: Chance) -> int:
    """Return how often to spoil a file: mostly once, so that the rest is read as well."""
    return int(chance.choice([1, 1, 1, 2, 4]))


def spoilt_bytes(data: bytes, chance: Chance) -> bytes:
    """Return bytes some of which are overwritten, cut off, doubled or moved."""
    spoilt = bytearray(data)
    for _ in range(_times(chance)):
        size = len(spoilt)
        if not size:
            break
        # Every other time the header, where a wrong byte does most.
        at = int(chance.integers(0, size if chance.random() < 0.5 else min(size, 64)))
        length = int(chance.integers(1, 9))
        match int(chance.integers(0, 6)):
            case 0:
                spoilt[at : at + length] = chance.bytes(length)
            case 1:
                spoilt[at : at + length] = (
                    bytes([int(chance.choice([0, 1, 127, 128, 255]))]) * length
                )
            case 2:
                del spoilt[at : at + length]
            case 3:
                spoilt[at:at] = spoilt[at : at + 8 * length]
            case 4:
                spoilt[at] ^= 1 << int(chance.integers(0, 8))
            case 5:
                del spoilt[int(chance.integers(0, size)) :]
    return bytes(spoilt)


def spoilt_text(data: bytes, chance: Chance) -> bytes:
    """Return a text some of whose words are left out, doubled, exchanged or odd."""
    words = re.split(r"(\s+)", data.decode())
    for _ in range(_times(chance)):
        at, other = (int(i) for i in chance.integers(0, len(words), 2))
        odd = json.dumps(_odd(chance))
        words[at] = str(
            chance.choice(np.array(["", words[other], f"{words[at]} {words[at]}", odd]))
        )
    return "".join(words).encode(errors="surrogatepass")


def spoilt_json(data: bytes, chance: Chance) -> bytes:
    """Return a JSON document some of whose values are odd, gone, or exchanged."""
    document = json.loads(data)
    for _ in range(_times(chance)):
        document = _with_one_odd(document, chance)
    return json.dumps(document).encode()


def spoilt_png(data: bytes, chance: Chance) -> bytes:
    """Return a PNG whose chunks are spoilt, doubled, gone or moved, with sound checksums."""
    chunks, at = [], 8
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    for _ in range(_times(chance)):
        i, j = (int(n) for n in chance.integers(0, len(chunks), 2))
        name, body = chunks[i]
        match int(chance.integers(0, 5)):
            case 0:
                chunks.insert(j, chunks[i])
            case 1:
                chunks[i], chunks[j] = chunks[j], chunks[i]
            case 2 if len(chunks) > 1:
                del chunks[i]
            case _:
                chunks[i] = name, spoilt_bytes(body, chance)
    return data[:8] + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    )


def _odd(chance: Chance) -> Any:
    # A copy: what is put into a document may be spoilt there in its turn.
    return deepcopy(ODD[int(chance.integers(0, len(ODD)))])


def _with_one_odd(document: Any, chance: Chance) -> Any:
    """Return the document with one value, somewhere in it, replaced; all levels are as likely."""
    here: Any = document
    path: list[tuple[Any, Any]] = []
    while isinstance(here, dict | list) and here and (not path or chance.random() < 0.8):
        keys = list(here) if isinstance(here, dict) else range(len(here))
        key = keys[int(chance.integers(0, len(keys)))]
        path.append((here, key))
        here = here[key]
    if not path:
        return _odd(chance)
    block, key = path[-1]
    match int(chance.integers(0, 4)):
        case 0:
            del block[key]
        case 1 if isinstance(here, int | float) and not isinstance(here, bool):
            block[key] = here * float(chance.choice([-1, 0.001, 2, 1e6])) + int(chance.integers(3))
        case 2 if isinstance(block, dict):
            block[str(_odd(chance))] = here
        case _:
            block[key] = _odd(chance)
    return document


Spoil = Callable[[bytes, Chance], bytes]
"""Returns other bytes than it is given, by chance."""
