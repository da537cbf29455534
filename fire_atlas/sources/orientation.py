"""Turn pictures upright, as the tag Orientation of EXIF and TIFF says."""

import struct

import numpy as np

from fire_atlas.core.picture import Picture

UPRIGHT = 1
TAG = 0x0112

IN_WORDS = {
    2: "mirrored",
    3: "turned by 180°",
    4: "mirrored and turned by 180°",
    5: "mirrored and turned by 90° to the left",
    6: "turned by 90° to the right",
    7: "mirrored and turned by 90° to the right",
    8: "turned by 90° to the left",
}
"""What is done to a picture of each orientation but the upright one."""

_SHORT, _LONG = 3, 4


def turned(picture: Picture, orientation: int) -> Picture:
    """Return a picture as stored, (H, W, C), as it is to be seen."""
    if orientation >= 5:
        picture = picture.transpose(1, 0, 2)
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    return np.ascontiguousarray(picture)


def turned_size(width: int, height: int, orientation: int) -> tuple[int, int]:
    """Return the size of a picture, stored as ``width`` x ``height``, as it is to be seen."""
    return (height, width) if orientation >= 5 else (width, height)


def orientation_of(exif: bytes) -> int:
    """Return the orientation 1..8 in EXIF data, or in a TIFF; 1 if they state none.

    Data that are damaged state none: they hold nothing else that is read here.
    """
    exif = exif.removeprefix(b"Exif\0\0")  # as in JPEG; some programs write it elsewhere too
    at = _place(exif)
    return UPRIGHT if at is None else valid(*struct.unpack_from(f"{_order(exif)}H", exif, at))


def marked_upright(tiff: bytes) -> bytes:
    """Return a TIFF whose tag says that it is upright, so that decoders do not turn it."""
    at = _place(tiff)
    if at is None:
        return tiff
    return tiff[:at] + struct.pack(f"{_order(tiff)}H", UPRIGHT) + tiff[at + 2 :]


def valid(orientation: int) -> int:
    """Return an orientation that a file states; the upright one if there is none such."""
    return orientation if 1 <= orientation <= 8 else UPRIGHT


def _order(tiff: bytes) -> str:
    return "<" if tiff[:2] == b"II" else ">"


def _place(tiff: bytes) -> int | None:
    """Return the offset of the orientation in a TIFF's first directory; None if it has none."""
    if tiff[:4] not in (b"II*\0", b"MM\0*"):
        return None
    order = _order(tiff)
    try:
        (at,) = struct.unpack_from(f"{order}I", tiff, 4)
        (count,) = struct.unpack_from(f"{order}H", tiff, at)
        for entry in range(at + 2, at + 2 + 12 * count, 12):
            tag, kind, _, _ = struct.unpack_from(f"{order}HHII", tiff, entry)
            if tag == TAG and kind in (_SHORT, _LONG):
                return entry + (10 if kind == _LONG and order == ">" else 8)
    except struct.error:
        return None
    return None
