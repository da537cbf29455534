"""Frames with the same pixels need one place only."""

import hashlib
from collections import Counter
from collections.abc import Sequence
from typing import TypeAlias

from fire_atlas.atlas.sheet import Box, Sprite
from fire_atlas.atlas.trim import part, visible_box

_Look: TypeAlias = tuple[int, int, int, int, int, int, bytes]
"""Size of the cell; place and size of what is lit in it; a hash of that."""


def originals(sprites: Sequence[Sprite], parts: Sequence[Box]) -> list[int]:
    """Return for each sprite the first one whose part of its frame shows the same pixels."""
    sizes = Counter((box.width, box.height) for box in parts)
    first: dict[_Look, int] = {}
    return [
        # Most frames of a fire are of a size of their own: these need no closer look.
        first.setdefault(_look(sprite, box), i) if sizes[box.width, box.height] > 1 else i
        for i, (sprite, box) in enumerate(zip(sprites, parts, strict=True))
    ]


def _look(sprite: Sprite, box: Box) -> _Look:
    image, x, y = part(sprite, box)
    lit = visible_box(image, 0) if image.size else None
    if lit is None:
        return box.width, box.height, 0, 0, 0, 0, b""
    image = image[lit.y : lit.y + lit.height, lit.x : lit.x + lit.width]
    digest = hashlib.blake2b(image.tobytes(), digest_size=16).digest()
    return box.width, box.height, x + lit.x, y + lit.y, lit.width, lit.height, digest
