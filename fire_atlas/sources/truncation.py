"""Recognise truncated videos, which decoders play up to their end without an error."""

import struct
from pathlib import Path
from typing import BinaryIO

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import open_file

_UNKNOWN = -1

_OGG_PAGE = 27 + 255 + 255 * 255
"""Length of the longest page of an Ogg file, bytes."""

_SYNC_PACKETS = 3
"""Packets of a transport stream that tell it from other files."""


def check_whole(path: Path, head: bytes) -> None:
    """Refuse an MP4, QuickTime, WebM, Matroska or AVI file that is shorter than its headers state,
    and an Ogg or a transport stream (``.ts``, ``.m2ts``) that does not end with a whole packet.

    Raises:
        SourceError: The file is truncated; the message gives both lengths.
    """
    actual = path.stat().st_size
    with open_file(path) as file:
        if head[4:8] == b"ftyp":
            promised = _mp4_length(path, file, actual)
        elif head[:4] == b"\x1aE\xdf\xa3":
            promised = _matroska_length(file)
        elif head[:4] == b"RIFF":
            promised = 8 + struct.unpack_from("<I", head, 4)[0]
        elif head[:4] == b"OggS":
            promised = _ogg_length(file, actual)
        elif length := _packet_length(file):
            promised = -(-actual // length) * length
        else:
            promised = _UNKNOWN
    if promised > actual:
        raise SourceError(
            f"{path}: the video is truncated: it has {actual} of the {promised} bytes it "
            "promises; copy or export it again"
        )


def _packet_length(file: BinaryIO) -> int:
    """Return the length of the packets of a transport stream, bytes, each of which begins with a
    sync byte, on discs after a time stamp; 0 if it is none."""
    start = file.read(_SYNC_PACKETS * 192)
    for length, at in ((188, 0), (192, 4)):
        if start[at::length][:_SYNC_PACKETS] == b"G" * _SYNC_PACKETS:
            return length
    return 0


def _ogg_length(file: BinaryIO, actual: int) -> int:
    """Return the end of the last page, bytes; unknown if there is none near the end."""
    start = max(0, actual - _OGG_PAGE)
    file.seek(start)
    tail = file.read()
    at = tail.rfind(b"OggS")
    if at < 0:
        return _UNKNOWN
    page = tail[at:]
    if len(page) < 27 or len(page) < 27 + page[26]:  # it ends inside the page's header
        return actual + 1
    return start + at + 27 + page[26] + sum(page[27 : 27 + page[26]])


def _mp4_length(path: Path, file: BinaryIO, actual: int) -> int:
    """Return the end of the last box, bytes; refuse a file without a box for the frame index."""
    at, names = 0, set()
    while at + 8 <= actual:
        file.seek(at)
        length, name = struct.unpack(">I4s", file.read(8))
        names.add(name)
        if length == 1:
            large = file.read(8)
            length = struct.unpack(">Q", large)[0] if len(large) == 8 else 16
        elif length == 0:
            length = actual - at
        at += max(8, length)
    if at <= actual and b"moov" not in names:
        raise SourceError(
            f"{path}: the video is truncated: its index (moov) is missing; copy or export it again"
        )
    return at


def _matroska_length(file: BinaryIO) -> int:
    """Return the end of the segment, bytes; unknown for files written as a live stream."""
    file.seek(4)
    header = _variable_length(file)
    file.seek(header, 1)
    file.seek(4, 1)
    segment = _variable_length(file)
    return _UNKNOWN if segment == _UNKNOWN else file.tell() + segment


def _variable_length(file: BinaryIO) -> int:
    """Read one EBML length: the first byte's leading zeros are the number of bytes that follow."""
    first = file.read(1)
    if not first or not first[0]:
        return _UNKNOWN
    extra = 8 - first[0].bit_length()
    mask = (1 << 7 - extra) - 1
    value = int.from_bytes(bytes([first[0] & mask]) + file.read(extra), "big")
    return _UNKNOWN if value == (1 << 7 * (extra + 1)) - 1 else value
