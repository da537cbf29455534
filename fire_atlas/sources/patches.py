"""Encoded frames of a GIF, APNG or WebP: patches, rectangles that are drawn on a canvas."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction


class Disposal(Enum):
    """Treatment of a patch after its time: keep it, clear it, or restore the canvas below it."""

    KEEP = "keep"
    CLEAR = "clear"
    RESTORE = "restore"


@dataclass(frozen=True, slots=True)
class Patch:
    """One drawing step of an animation.

    Attributes:
        x, y: Place of its top-left corner on the canvas, px.
        width, height: Size, px.
        delay: Time for which it is shown, s; 0 if the file states none.
        disposal: Treatment of its rectangle afterwards.
        blend: True if it is composited over the canvas, False if it replaces that part.
        start, stop: Range of its data in the file, bytes.
        extra: For a GIF, the graphic control block without delay and disposal.
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
    """The patches of a file in order, and a function that makes a still image of each.

    Attributes:
        format: ``gif``, ``png`` or ``webp``.
        width, height: Size of the canvas, px.
        patches: At least one.
        wrap: Returns a still image file, as bytes, from a patch and its bytes in the file.
        notes: What of the file breaks the rules of its format, for the user.
    """

    format: str
    width: int
    height: int
    patches: list[Patch]
    wrap: Callable[[Patch, bytes], bytes]
    notes: tuple[str, ...] = ()
