"""What a GIF, APNG or animated WebP holds: patches, drawn one after the other on a canvas."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction


class Disposal(Enum):
    """What happens to a patch's rectangle after its time."""

    KEEP = "keep"
    CLEAR = "clear"
    RESTORE = "restore"


@dataclass(frozen=True, slots=True)
class Patch:
    """One drawing step of an animation.

    Attributes:
        x, y: Where its top-left corner goes on the canvas, px.
        width, height: px.
        delay: How long it is shown, s; 0 if the file does not say.
        disposal: What happens to its rectangle afterwards.
        blend: True if it is laid over the canvas, False if it replaces it.
        start, stop: Where its data lie in the file, bytes.
        extra: What else is needed to wrap it as a still.
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
class Animation:
    """The patches of a file, and how to make a still image file of each.

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
