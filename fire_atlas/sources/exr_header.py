"""Read the header of an OpenEXR file: its parts, their channels and windows.

The parts are read here, not by the package ``OpenEXR``, so that limits are checked before it
decodes anything, and a header of any length is read without the pixels.
"""

import struct
from dataclasses import dataclass
from typing import BinaryIO

from fire_atlas.core.clip import Window
from fire_atlas.core.files import MIB
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.colours import Chromaticities

_DEEP, _SEVERAL_PARTS = 0x800, 0x1000
_MAX_NAME = 255
_MAX_PARTS, _MAX_ATTRIBUTES, _MAX_VALUE = 1024, 65536, MIB
_HALF = 1
_READ = (
    "channels", "chromaticities", "dataWindow", "displayWindow", "name", "type", "view"
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel of a part.

    Attributes:
        name: As in the file, such as ``ViewLayer.Combined.R``.
        sample_bytes: Bytes of a sample, 2 or 4.
        step_x, step_y: Distance of its samples, px; more than 1 in colours of reduced size.
    """

    name: str
    sample_bytes: int
    step_x: int
    step_y: int


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a file.

    Attributes:
        name, view: What it is called, and the camera of several that it shows; "" if not stated.
        is_deep: Whether a pixel has any number of samples, at different depths.
        channels: In the order of the file.
        data: The pixels that are stored. They may lie partly, or all, outside of the picture.
        display: The picture.
        chromaticities: Of its primaries and white; None if it states none, as Rec. 709 may.
    """

    name: str
    view: str
    is_deep: bool
    channels: tuple[Channel, ...]
    data: Window
    display: Window
    chromaticities: Chromaticities | None


def read_parts(file: BinaryIO) -> list[Part]:
    """Read the parts of a file from its beginning.

    Raises:
        BrokenFileError: The header is cut short or damaged.
    """
    magic, version = struct.unpack("<II", _take(file, 8))
    if magic != 20000630 or version & 0xFF != 2:
        raise BrokenFileError("it does not begin as an EXR of version 2 does")
    parts = [_part(_attributes(file), version)]
    while version & _SEVERAL_PARTS and (attributes := _attributes(file)):
        parts.append(_part(attributes, version))
        if len(parts) > _MAX_PARTS:
            raise BrokenFileError(f"it has more than {_MAX_PARTS} parts")
    return parts


def _attributes(file: BinaryIO) -> dict[str, bytes]:
    """Read those attributes of a part that matter, by name; none at the end of all parts."""
    found: dict[str, bytes] = {}
    for _ in range(_MAX_ATTRIBUTES):
        name = _text(file)
        if not name:
            return found
        _text(file)
        (size,) = struct.unpack("<i", _take(file, 4))
        if size < 0:
            raise BrokenFileError(f"the size of its attribute {name!r} is negative")
        if name not in _READ:
            file.seek(size, 1)
        elif size > _MAX_VALUE:
            raise BrokenFileError(f"its attribute {name!r} has {size} bytes")
        else:
            found[name] = _take(file, size)
    raise BrokenFileError(f"it has more than {_MAX_ATTRIBUTES} attributes")


def _part(attributes: dict[str, bytes], version: int) -> Part:
    missing = {"channels", "dataWindow", "displayWindow"} - attributes.keys()
    if missing:
        raise BrokenFileError(f"its header lacks {', '.join(sorted(missing))}")
    chromaticities = attributes.get("chromaticities", b"")
    kind = attributes.get("type", b"").decode("latin-1")
    return Part(
        name=attributes.get("name", b"").decode("utf-8", "replace"),
        view=attributes.get("view", b"").decode("utf-8", "replace"),
        is_deep=kind.startswith("deep") or bool(version & _DEEP and not kind),
        channels=tuple(_channels(attributes["channels"])),
        data=_window(attributes, "dataWindow"),
        display=_window(attributes, "displayWindow"),
        chromaticities=struct.unpack("<8f", chromaticities) if len(chromaticities) == 32 else None,
    )


def _channels(stored: bytes) -> list[Channel]:
    channels, at = [], 0
    while stored[at : at + 1] not in (b"", b"\0"):
        end = stored.find(b"\0", at)
        if end < 0 or end + 17 > len(stored):
            raise BrokenFileError("its list of channels is cut short")
        kind, step_x, step_y = struct.unpack_from("<i4xii", stored, end + 1)
        if not (0 <= kind <= 2 and 1 <= step_x <= 1024 and 1 <= step_y <= 1024):
            raise BrokenFileError("its list of channels is damaged")
        name = stored[at:end].decode("utf-8", "replace")
        channels.append(Channel(name, 2 if kind == _HALF else 4, step_x, step_y))
        at = end + 17
    return channels


def _window(attributes: dict[str, bytes], name: str) -> Window:
    """Return a window; in files, the last column and row are inside."""
    if len(attributes[name]) != 16:
        raise BrokenFileError(f"its {name} is damaged")
    left, top, last_column, last_row = struct.unpack("<4i", attributes[name])
    if last_column < left or last_row < top:
        raise BrokenFileError(f"its {name} is empty")
    return Window(left, top, last_column + 1, last_row + 1)


def _text(file: BinaryIO) -> str:
    """Read a name, which ends with a zero byte."""
    name = bytearray()
    while (byte := _take(file, 1)) != b"\0":
        name += byte
        if len(name) > _MAX_NAME:
            raise BrokenFileError("a name in its header does not end")
    return name.decode("utf-8", "replace")


def _take(file: BinaryIO, count: int) -> bytes:
    data = file.read(count)
    if len(data) < count:
        raise BrokenFileError("the file is truncated: it ends inside its header")
    return data
