"""Names that Godot 4 gives to resources: 63 bits, in text of the letters a-y and the digits 0-8.

Scenes of a game refer to them, so they must never change: each is derived from a file's name, and
one that stands in a file already is kept.
"""

import hashlib
import re

from fire_atlas.formats.product import Product

_ALPHABET = "abcdefghijklmnopqrstuvwxy012345678"
_TOLD = re.compile(rb'^(?:\[gd_[^\]\n]* uid="|uid=")?(uid://[a-y0-8]{1,13})\b', re.MULTILINE)
"""Where a file says its own uid: in its first tag, its import settings, or nowhere else."""


def uid_of(product: Product, file: str, told_in: str | None = None) -> str:
    """Return the uid of an output.

    Args:
        product: What is exported.
        file: Name of the output.
        told_in: Name of the file that says the uid, where that is not the output itself.
    """
    told = _TOLD.search(product.existing(told_in or file) or b"")
    return told[1].decode() if told else derived_uid(product.name, file)


def derived_uid(name: str, file: str) -> str:
    """Return the uid of ``file`` among the outputs called ``name``, in whatever folder it lies."""
    digest = hashlib.sha256(f"fire-atlas {name}/{file}".encode()).digest()
    return f"uid://{_text(int.from_bytes(digest[:8], 'big') >> 1)}"


def _text(number: int) -> str:
    """Return a number in base 34, as the engine writes it."""
    digits = ""
    while number:
        number, digit = divmod(number, len(_ALPHABET))
        digits = _ALPHABET[digit] + digits
    return digits or _ALPHABET[0]
