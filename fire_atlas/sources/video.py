"""Read videos, with PyAV or OpenCV.

WebM, Matroska and QuickTime can have alpha, which OpenCV drops. So PyAV (an optional extra) decodes
them, VP8 and VP9 with libvpx, the only decoder that returns their alpha. OpenCV, which is always
installed, decodes MP4 and all other formats.
"""

import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import islice, pairwise
from math import isfinite
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from fire_atlas.core.clip import Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.frame_store import FrameStore
from fire_atlas.sources.framing import (
    FlameExtent,
    Framing,
    describe_crop,
    frame_video,
    small_copy,
    stated_box,
)
from fire_atlas.sources.images import check_size, from_opencv, read_bytes
from fire_atlas.sources.listing import MAX_FRAMES, frame_range, sample_numbers
from fire_atlas.sources.reader import FrameReader, OpeningContext, check_frame_size, resample
from fire_atlas.sources.truncation import check_whole

# Silences OpenCV's FFmpeg, whose messages only repeat our errors; read at the first video.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

_CONTAINERS = "matroska,mov,avi,mpeg,mpegts,mpegvideo,m4v,ogg,asf,flv"
"""FFmpeg's names of the allowed file formats. By default it also plays playlists, whatever their
file name, and would open any file or URL in them."""

os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"format_whitelist;{_CONTAINERS}"

_WAITING_BYTES = 48 << 20
"""Limit on the decoded frames that wait to be reduced, bytes."""

_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}


@dataclass(frozen=True, slots=True)
class VideoScan:
    """Size, rate and times of all frames of a video.

    Attributes:
        width, height: Size, px.
        fps: Frames per second that the file states; None if it states none.
        stamps: Time at which each frame is shown, s, as the file states it.
        promised: Number of frames that the file states; 0 if it states none.
    """

    width: int
    height: int
    fps: float | None
    stamps: tuple[Fraction, ...]
    promised: int = 0


@dataclass(frozen=True, slots=True)
class DecodedFrame:
    """A frame as a decoder returns it.

    Attributes:
        stamp: Time at which it is shown, s, as the file states it.
        picture: Converts it to a picture; only before the next frame is decoded.
    """

    stamp: Fraction
    picture: Callable[[], Picture]


@dataclass(frozen=True, slots=True)
class _Plan:
    """What is kept of a video.

    Attributes:
        rate: Frames per second.
        shown: For each frame at this rate, the number of the frame of the file that it shows.
        chosen: Numbers of those that the recipe uses.
        samples: Numbers of those by which the matte is chosen.
        framing: The part of each frame that is kept, and its size.
    """

    rate: float
    shown: tuple[int, ...]
    chosen: range
    samples: tuple[int, ...]
    framing: Framing

    @property
    def kept(self) -> frozenset[int]:
        """Numbers of the frames of the file that are kept."""
        return frozenset(self.shown[i] for i in (*self.chosen, *self.samples))


@dataclass(frozen=True, slots=True)
class _Video:
    """A video to open, and how it is used.

    Attributes:
        path: The file.
        settings: The recipe's ``source``.
        context: Workers, limits and the page.
        decode: Yields all frames of a file in the order in which they are shown, decoded by this
            number of threads.
    """

    path: Path
    settings: FramesSource
    context: OpeningContext
    decode: Callable[[Path, int], Generator[DecodedFrame]]


def open_video(path: Path, settings: FramesSource, context: OpeningContext) -> FrameReader:
    """Open the frames of a video at a constant rate, as ``source.crop`` and ``height`` say.

    Only those that the recipe uses are kept. The packets of the file tell which, without decoding.
    If the decoder contradicts them, for some files hide frames, the video is decoded once more.

    Raises:
        SourceError: The file is cut short, cannot be decoded, is too large, or needs PyAV; or the
            settings do not suit it.
    """
    head = read_bytes(path, 16)
    check_whole(path, head)
    with_pyav = head[:4] == b"\x1aE\xdf\xa3" or head[4:12] == b"ftypqt  "
    scan = (_scan_pyav if with_pyav else _scan_opencv)(path, context.max_pixels)
    video = _Video(path, settings, context, _decode_pyav if with_pyav else _decode_opencv)
    size = scan.width, scan.height
    box, notes, samples = stated_box(settings, size, path), list[str](), tuple[Picture, ...]()
    if settings.crop == "auto":
        scan, extent = _find_flame(video, scan)
        box, samples = extent.box(size), extent.samples()
        notes.append(describe_crop(box, size))
    plan = _plan(video, scan, box)
    frames, decoded = _keep(video, scan, plan)
    if (correct := _plan(video, decoded, box)) != plan:
        plan = correct
        frames, _ = _keep(video, decoded, plan)
    framing = plan.framing
    notes += [framing.reason] if framing.reason else []
    return FrameReader(
        width=framing.width,
        height=framing.height,
        fps=plan.rate,
        count=len(plan.shown),
        read=lambda i: frames.read(plan.shown[i]),
        inputs=(path,),
        notes=tuple(notes),
        samples=samples,
    )


def _plan(video: _Video, scan: VideoScan, box: Window) -> _Plan:
    """Return what to keep of a video that has the frames of ``scan``."""
    settings, delays = video.settings, _delays(scan)
    stated = scan.fps if scan.fps and abs(sum(delays) * scan.fps - len(delays)) < 0.5 else None
    rate, shown = resample(delays, settings.fps or stated, video.path)
    chosen = frame_range(settings, len(shown), video.path)
    is_matte_stated = settings.matte == "none" or (
        settings.matte == "luminance" and settings.black != "auto"
    )
    return _Plan(
        rate,
        tuple(shown),
        chosen,
        () if is_matte_stated else tuple(sample_numbers(len(shown))),
        frame_video(settings, box, len(chosen), rate, video.context.page),
    )


def _keep(video: _Video, scan: VideoScan, plan: _Plan) -> tuple[FrameStore, VideoScan]:
    """Decode a video, and return what ``plan`` keeps of it, and ``scan`` as the decoder sees it."""
    frames, stamps = FrameStore(video.path), list[Fraction]()
    pictures = _pictures(video, scan, plan.kept, stamps)
    kept = video.context.workers.map(plan.framing.apply, pictures, _ahead(video, scan))
    # A decoder that contradicts the packets may have fewer frames than are to be kept.
    for picture, i in zip(kept, sorted(plan.kept), strict=False):
        frames.add(i, picture)
    return frames, replace(scan, stamps=tuple(stamps))


def _find_flame(video: _Video, scan: VideoScan) -> tuple[VideoScan, FlameExtent]:
    """Decode a video, and return ``scan`` as the decoder sees it, and where its flame is."""
    extent, stamps = FlameExtent(sample_numbers(len(scan.stamps))), list[Fraction]()
    pictures = _pictures(video, scan, None, stamps)
    copies = video.context.workers.map(small_copy, pictures, _ahead(video, scan))
    for i, small in enumerate(copies):
        extent.add(i, small)
    return replace(scan, stamps=tuple(stamps)), extent


def _ahead(video: _Video, scan: VideoScan) -> int:
    """Return how many frames may wait for a worker: few, if they are large."""
    return max(
        1, min(2 * video.context.workers.jobs, _WAITING_BYTES // (3 * scan.width * scan.height))
    )


def _pictures(
    video: _Video, scan: VideoScan, kept: frozenset[int] | None, stamps: list[Fraction]
) -> Generator[Picture]:
    """Yield the frames that are ``kept`` (None: all), and append the time of each to ``stamps``.

    After the last one that is kept, decoding stops if the file's packets were right so far.

    Raises:
        SourceError: The video ends early, or a frame has another size than the file states.
    """
    path = video.path
    last = len(scan.stamps) - 1 if kept is None else max(kept)
    for i, frame in enumerate(video.decode(path, video.context.workers.jobs)):
        stamps.append(frame.stamp)
        if kept is None or i in kept:
            picture = frame.picture()
            check_frame_size(path, i, picture, (scan.width, scan.height))
            yield picture
        if i == last and tuple(stamps) == scan.stamps[: i + 1]:
            stamps += scan.stamps[i + 1 :]
            return
    if not stamps:
        raise SourceError(f"{path}: no frame of this video can be decoded; export it again")
    # Edit lists may hide a frame or two at the ends. If more are missing, the file is damaged.
    if len(stamps) + 2 < scan.promised <= MAX_FRAMES:
        raise SourceError(
            f"{path}: frame {len(stamps)} of {scan.promised} cannot be decoded; export it again"
        )


def _delays(scan: VideoScan) -> list[Fraction]:
    """Return the time for which each frame is shown, s; for the last one, the median."""
    gaps = [later - earlier for earlier, later in pairwise(scan.stamps)]
    usual = 1 / Fraction(scan.fps or 24).limit_denominator(1_000_000)
    if any(gap <= 0 for gap in gaps):
        return [usual] * len(scan.stamps)
    return [*gaps, sorted(gaps)[len(gaps) // 2] if gaps else usual]


def _checked(path: Path, scan: VideoScan) -> VideoScan:
    """Return ``scan`` of a file's packets with its times in order, as frames are shown."""
    if not scan.stamps:
        raise SourceError(f"{path}: no frame of this video can be decoded; export it again")
    if len(scan.stamps) > MAX_FRAMES:
        raise SourceError(f"{path}: more than {MAX_FRAMES} frames; cut the video first")
    return replace(scan, stamps=tuple(sorted(scan.stamps)))


def _capture(path: Path, threads: int) -> cv2.VideoCapture:
    # Only this backend: others would take digits in the file name for a numbered sequence.
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, threads])
    if not capture.isOpened():
        raise SourceError(
            f"{path}: is not a video that can be read, or it is truncated; "
            "export it again, as H.264 in MP4"
        )
    return capture


def _scan_opencv(path: Path, max_pixels: int) -> VideoScan:
    capture = _capture(path, threads=1)
    try:
        width = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        height = int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        check_size(path, width, height, max_pixels)
        fps = capture.get(cv2.CAP_PROP_FPS)
        promised = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        capture.set(cv2.CAP_PROP_FORMAT, -1)  # from now on, grab() reads packets
        stamps = list[Fraction]()
        while capture.grab() and len(stamps) <= MAX_FRAMES:
            stamps.append(_stamp(capture))
    finally:
        capture.release()
    rate = fps if isfinite(fps) and fps > 0 else None
    return _checked(path, VideoScan(width, height, rate, tuple(stamps), promised))


def _decode_opencv(path: Path, threads: int) -> Generator[DecodedFrame]:
    capture = _capture(path, threads)
    try:
        while capture.grab():
            yield DecodedFrame(_stamp(capture), partial(_retrieved, path, capture))
    finally:
        capture.release()


def _retrieved(path: Path, capture: cv2.VideoCapture) -> Picture:
    """Return the frame that was decoded last."""
    found, raw = capture.retrieve()
    if not found:
        raise SourceError(f"{path}: a frame cannot be converted to pixels; export it again")
    return from_opencv(raw)


def _stamp(capture: cv2.VideoCapture) -> Fraction:
    return Fraction(round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1000), 1_000_000)


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


def _decoded(container: Any, stream: Any, threads: int) -> Generator[Any]:
    """Yield every frame, with its alpha if it has any."""
    context = stream.codec_context
    name = _ALPHA_DECODERS.get(context.codec.canonical_name)
    decoder = type(context).create(name, "r") if name else context
    decoder.thread_count, decoder.thread_type = threads, "AUTO"
    for packet in container.demux(stream):
        if packet.size:
            yield from decoder.decode(packet)
    yield from decoder.decode(None)


def _scan_pyav(path: Path, max_pixels: int) -> VideoScan:
    with _open_stream(path) as (container, stream):
        width, height = stream.codec_context.width, stream.codec_context.height
        check_size(path, width, height, max_pixels)
        fps = float(stream.average_rate) if stream.average_rate else None
        packets = (each for each in container.demux(stream) if each.size and not each.is_discard)
        stamps = tuple(_time(each, stream) for each in islice(packets, MAX_FRAMES + 1))
    return _checked(path, VideoScan(width, height, fps, stamps))


def _decode_pyav(path: Path, threads: int) -> Generator[DecodedFrame]:
    with _open_stream(path) as (container, stream):
        for frame in _decoded(container, stream, threads):
            yield DecodedFrame(_time(frame, stream), partial(_picture, frame))


def _time(timed: Any, stream: Any) -> Fraction:
    """Return the time of a packet or frame, s."""
    return (timed.pts or 0) * Fraction(stream.time_base)


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
