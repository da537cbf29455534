"""Frames of a GIF, APNG or WebP as they are encoded: patches for a canvas, not decoded yet."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction


class Disposal(Enum):
    """What the rectangle of a patch becomes after its time: left, cleared, or as it was before."""

    KEEP = "keep"
    CLEAR = "clear"
    RESTORE = "restore"


@dataclass(frozen=True, slots=True)
class Patch:
    """One drawing step of an animation.

    Attributes:
        x, y: Where its top-left corner goes on the canvas, px.
        width, height: px.
        delay: How long it is shown, s; 0 if the file states none.
        disposal: What happens to its rectangle afterwards.
        blend: True if it is laid over the canvas, False if it replaces it.
        start, stop: Where its data lie in the file, bytes.
        extra: Of a GIF, what its graphic control says beside the delay and the disposal.
    """

    x: int
    y: int
    width: int
    height: int
    delay: Fraction
    disposal: Disposal
    blend: bool
    start: int
    stop: int
    extra: bytes = b""


@dataclass(frozen=True, slots=True)
class EncodedAnimation:
    """A file's patches in order, and how to make a still image file of each.

    Attributes:
        format: ``gif``, ``png`` or ``webp``.
        width, height: Canvas, px.
        patches: At least one.
        wrap: Gives the bytes of a still image from a patch and its bytes in the file.
    """

    format: str
    width: int
    height: int
    patches: list[Patch]
    wrap: Callable[[Patch, bytes], bytes]
