"""Read videos, with PyAV or OpenCV.

WebM, Matroska and QuickTime can have alpha, which OpenCV drops. So PyAV (an optional extra) decodes
them, VP8 and VP9 with libvpx, the only decoder that returns their alpha. OpenCV, which is always
installed, decodes MP4 and all other formats.
"""

import os
import struct
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, BinaryIO

import cv2
import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import open_file
from fire_atlas.core.picture import Picture
from fire_atlas.sources.images import check_size, from_opencv, read_bytes
from fire_atlas.sources.listing import MAX_FRAMES, MAX_PIXELS
from fire_atlas.sources.reader import FrameReader, resample, sequential_reader

# Silences OpenCV's FFmpeg, whose messages only repeat our errors; read at the first video.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

_CONTAINERS = "matroska,mov,avi,mpeg,mpegts,mpegvideo,m4v,ogg,asf,flv"
"""FFmpeg's names of the allowed file formats. By default it also plays playlists, whatever their
file name, and would open any file or URL in them."""

os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"format_whitelist;{_CONTAINERS}"

_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}


@dataclass(frozen=True, slots=True)
class VideoScan:
    """Size, rate and times of all frames, found by decoding the video once.

    Attributes:
        width, height: Size, px.
        fps: Frames per second that the file states; None if it states none.
        stamps: Time at which each frame is shown, s, as the file states it.
    """

    width: int
    height: int
    fps: float | None
    stamps: list[Fraction]


def open_video(path: Path, fps: float | None, max_pixels: int = MAX_PIXELS) -> FrameReader:
    """Open the frames of a video at a constant rate.

    The video is decoded once to count its frames, since the number in the file is often wrong.

    Raises:
        SourceError: The file is cut short, cannot be decoded, is too large, or needs PyAV.
    """
    head = read_bytes(path, 16)
    _check_whole(path, head)
    with_pyav = head[:4] == b"\x1aE\xdf\xa3" or head[4:12] == b"ftypqt  "
    scan = (_scan_pyav if with_pyav else _scan_opencv)(path, max_pixels)
    play = _play_pyav if with_pyav else _play_opencv
    delays = _delays(scan)
    stated = scan.fps if scan.fps and abs(sum(delays) * scan.fps - len(delays)) < 0.5 else None
    rate, shown = resample(delays, fps or stated, path)
    size = scan.width, scan.height
    return sequential_reader(path, size, partial(play, path, len(scan.stamps)), rate, shown)


def _delays(scan: VideoScan) -> list[Fraction]:
    """Return the time for which each frame is shown, s; for the last one, the median."""
    gaps = [later - earlier for earlier, later in pairwise(scan.stamps)]
    usual = 1 / Fraction(scan.fps or 24).limit_denominator(1_000_000)
    if any(gap <= 0 for gap in gaps):
        return [usual] * len(scan.stamps)
    return [*gaps, sorted(gaps)[len(gaps) // 2] if gaps else usual]


def _checked(path: Path, scan: VideoScan) -> VideoScan:
    if not scan.stamps:
        raise SourceError(f"{path}: no frame of this video can be decoded; export it again")
    return scan


def _check_count(path: Path, count: int) -> None:
    if count > MAX_FRAMES:
        raise SourceError(f"{path}: more than {MAX_FRAMES} frames; cut the video first")


def _ended(path: Path, frame: int, count: int) -> SourceError:
    return SourceError(f"{path}: frame {frame} of {count} cannot be decoded; export it again")


def _capture(path: Path) -> cv2.VideoCapture:
    # Only this backend: others would take digits in the file name for a numbered sequence.
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise SourceError(
            f"{path}: is not a video that can be read, or it is truncated; "
            "export it again, as H.264 in MP4"
        )
    return capture


def _scan_opencv(path: Path, max_pixels: int) -> VideoScan:
    capture = _capture(path)
    try:
        width = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        height = int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        check_size(path, width, height, max_pixels)
        fps = capture.get(cv2.CAP_PROP_FPS)
        stamps: list[Fraction] = []
        while capture.grab():
            micros = round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1000)
            stamps.append(Fraction(micros, 1_000_000))
            _check_count(path, len(stamps))
        promised = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    finally:
        capture.release()
    # Edit lists may hide a frame or two at the ends. If more are missing, the file is damaged.
    if len(stamps) + 2 < promised <= MAX_FRAMES:
        raise _ended(path, len(stamps), promised)
    rate = fps if isfinite(fps) and fps > 0 else None
    return _checked(path, VideoScan(width, height, rate, stamps))


def _play_opencv(path: Path, count: int) -> Generator[Picture]:
    capture = _capture(path)
    try:
        for i in range(count):
            found, raw = capture.read()
            if not found:
                raise _ended(path, i, count)
            yield from_opencv(raw)
    finally:
        capture.release()


@contextmanager
def _open_stream(path: Path) -> Generator[tuple[Any, Any]]:
    """Open the file with PyAV and yield the container and its video stream."""
    av = _load_pyav(path)
    try:
        options = {"format_whitelist": _CONTAINERS}
        with av.open(str(path), options=options, metadata_errors="replace") as container:
            stream = next(iter(container.streams.video), None)
            if stream is None:
                raise SourceError(f"{path}: holds no pictures (no video stream)")
            if stream.codec_context is None:
                raise SourceError(f"{path}: its codec is not known; export it as VP9 or H.264")
            yield container, stream
    except (av.FFmpegError, ValueError, ArithmeticError) as error:
        raise SourceError(f"{path}: cannot be decoded ({error}); export it again") from error


def _decoded(container: Any, stream: Any) -> Generator[Any]:
    """Yield every frame, with its alpha if it has any."""
    context = stream.codec_context
    name = _ALPHA_DECODERS.get(context.codec.canonical_name)
    decoder = type(context).create(name, "r") if name else context
    for packet in container.demux(stream):
        if packet.size:
            yield from decoder.decode(packet)
    yield from decoder.decode(None)


def _scan_pyav(path: Path, max_pixels: int) -> VideoScan:
    stamps: list[Fraction] = []
    width = height = 0
    with _open_stream(path) as (container, stream):
        check_size(path, stream.codec_context.width, stream.codec_context.height, max_pixels)
        fps = float(stream.average_rate) if stream.average_rate else None
        for frame in _decoded(container, stream):
            width, height = frame.width, frame.height
            stamps.append((frame.pts or 0) * Fraction(stream.time_base))
            _check_count(path, len(stamps))
    return _checked(path, VideoScan(width, height, fps, stamps))


def _play_pyav(path: Path, count: int) -> Generator[Picture]:
    with _open_stream(path) as (container, stream):
        frames = _decoded(container, stream)
        for i in range(count):
            frame = next(frames, None)
            if frame is None:
                raise _ended(path, i, count)
            yield _picture(frame)


def _picture(frame: Any) -> Picture:
    """Return a decoded frame as R, G, B(, A), with 16 bits if it has more than 8."""
    parts = frame.format.components
    layout = "rgba" if any(part.is_alpha for part in parts) else "rgb24"
    if max(part.bits for part in parts) > 8:
        layout = {"rgba": "rgba64le", "rgb24": "rgb48le"}[layout]
    return np.ascontiguousarray(frame.to_ndarray(format=layout))


def _load_pyav(path: Path) -> Any:
    """Return the module ``av`` with FFmpeg's log switched off, as it raises exceptions too.

    Raises:
        SourceError: PyAV is not installed.
    """
    try:
        import av
        import av.logging
    except ImportError as error:
        raise SourceError(
            f"{path}: reading WebM, Matroska and QuickTime needs PyAV; install it with: "
            "pip install 'fire-atlas[video]'"
        ) from error
    av.logging.set_level(None)
    return av


_UNKNOWN = -1


def _check_whole(path: Path, head: bytes) -> None:
    """Refuse an MP4, QuickTime, WebM, Matroska or AVI file that is shorter than its headers state.

    Decoders play a truncated file up to its end without an error.

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
        else:
            promised = _UNKNOWN
    if promised > actual:
        raise SourceError(
            f"{path}: the video is truncated: it has {actual} of the {promised} bytes it "
            "promises; copy or export it again"
        )


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
