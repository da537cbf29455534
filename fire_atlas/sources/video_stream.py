"""Decode the frames of a video with PyAV (FFmpeg), in the order in which they are shown."""

from collections import deque
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import Any

import av
import av.logging
from av.filter import Graph
from av.stream import Disposition

from fire_atlas.core.errors import SourceError
from fire_atlas.core.workload import MAX_FRAMES
from fire_atlas.sources.images import MAX_SIDE, check_size, read_bytes
from fire_atlas.sources.truncation import check_whole
from fire_atlas.sources.video_picture import VideoLook

av.logging.set_level(None)  # FFmpeg's log would only repeat our errors on stderr

_CONTAINERS = "matroska,mov,avi,mpeg,mpegts,mpegvideo,m4v,ogg,asf,flv,yuv4mpegpipe"
"""FFmpeg's names of the allowed file formats. By default it also plays playlists, whatever their
file name, and would open any file or URL in them."""

_WITH_LENGTHS = ("matroska", "mov", "avi")
"""FFmpeg's names of the formats whose files state their length, so that one cut off is known."""

_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}
"""What decodes these codecs where they have alpha, which FFmpeg's own decoders drop."""

_CODED_EXTRA = 2 * 64 * MAX_SIDE
"""What codecs add to a picture to fill whole blocks, px: at most 63 columns and 63 rows."""

_ROUNDED = Fraction(2, 1000)
"""Times of frames are rounded by less than this, s."""

_USUAL_RATE = 24
"""Frames per second of files that state neither a rate nor times."""


@dataclass(frozen=True, slots=True)
class VideoScan:
    """What a video holds, as its packets or its decoder tell.

    Attributes:
        look: How its frames are stored.
        fps: Frames per second that the file states; None if it states none.
        count: Number of frames.
        stamps: Time at which each frame is shown, s; empty if the file does not tell.
        last: Time for which the last frame is shown, s; None if the file does not tell.
        begin: Number of packets before the first one that a decoder can begin with.
        notes: Which of its parts are not used, for the user.
    """

    look: VideoLook
    fps: float | None
    count: int
    stamps: tuple[Fraction, ...]
    last: Fraction | None
    begin: int
    notes: tuple[str, ...]

    @property
    def delays(self) -> list[Fraction]:
        """Time for which each frame is shown, s."""
        usual = 1 / Fraction(self.fps or _USUAL_RATE).limit_denominator(1_000_000)
        gaps = [later - earlier for earlier, later in pairwise(self.stamps)]
        if not self.stamps or any(gap <= 0 for gap in gaps):
            return [usual] * self.count
        return [*gaps, self.last or (sorted(gaps)[len(gaps) // 2] if gaps else usual)]


@dataclass(frozen=True, slots=True)
class DecodedFrame:
    """A frame as a decoder returns it.

    Attributes:
        stamp: Time at which it is shown, s, as the file states it; None if it does not.
        frame: The ``av.VideoFrame``.
        interlaced: Whether the file says that it consists of two fields.
    """

    stamp: Fraction | None
    frame: Any
    interlaced: bool


def scan_video(path: Path, max_pixels: int) -> VideoScan:
    """Return what the packets of a video tell, of which only the first frame is decoded.

    Raises:
        SourceError: It cannot be read, is too large, or sRGB has no one picture of its colours.
    """
    check_whole(path, read_bytes(path, 16))
    packets, look, end = list[Any](), None, 0
    with _open_stream(path, max_pixels) as (container, stream):
        if stream.codec_context.width:  # unknown until a frame is decoded, if the file breaks off
            check_size(path, stream.codec_context.width, stream.codec_context.height, max_pixels)
        decoder, unit = _decoder(stream, 1, max_pixels), Fraction(stream.time_base)
        for packet in container.demux(stream):
            if look is None:
                for frame in decoder.decode(packet if packet.size else None):
                    look = look or VideoLook.of(path, frame, stream.sample_aspect_ratio)
            if packet.size:
                time = packet.dts if packet.pts is None else packet.pts
                stamp = None if time is None else time * unit
                length = (packet.duration or 0) * unit
                packets.append((stamp, length, packet.is_keyframe, packet.is_discard))
            if len(packets) > MAX_FRAMES:
                raise SourceError(f"{path}: more than {MAX_FRAMES} frames; cut the video first")
            if packet.size and packet.pos is not None:
                end = packet.pos + packet.size
        if container.format.name == "yuv4mpegpipe" and end < path.stat().st_size:
            raise SourceError(f"{path}: breaks off inside frame {len(packets)}; export it again")
        fps = stream.guessed_rate or stream.average_rate
        notes = _other_streams(path, container, stream)
    begin = next((i for i, (*_, is_key, _) in enumerate(packets) if is_key), 0)
    shown = [packet for packet in packets[begin:] if not packet[3]]
    if look is None or not shown:
        raise SourceError(f"{path}: no frame of this video can be decoded; export it again")
    check_size(path, *look.size, max_pixels)
    if begin:
        notes.append(
            f"{path.name}: its first {begin} frames refer to some before its beginning, and are "
            f"left out"
        )
    stamps, last = tuple[Fraction, ...](), None
    if all(stamp is not None for stamp, *_ in shown):
        # Frames that refer to some before the first key frame cannot be decoded either.
        times = sorted((packet[0], packet[1]) for packet in shown if packet[0] >= packets[begin][0])
        stamps = tuple(stamp for stamp, _ in times)
        # Some files state one length for all frames, however long each is shown.
        lengths = zip(times, stamps[1:], strict=False)
        if all(abs(stamp + length - end) < _ROUNDED for (stamp, length), end in lengths):
            last = times[-1][1] or None
    return VideoScan(
        look=look,
        fps=float(fps) if fps else None,
        count=len(stamps) or len(shown),
        stamps=stamps,
        last=last,
        begin=begin,
        notes=tuple(notes),
    )


def decode_video(
    path: Path, scan: VideoScan, threads: int, max_pixels: int
) -> Generator[DecodedFrame]:
    """Yield the frames of a video; where ``scan.look`` says so, its two fields as one picture.

    Raises:
        SourceError: A frame is damaged, breaks off, or has another size than the first; the message
            has its number.
    """
    count = 0
    with _open_stream(path, max_pixels) as (_, stream):
        frames = _decoded(stream, _decoder(stream, threads, max_pixels), scan.begin)
        if scan.look.deinterlaced:
            frames = _deinterlaced(frames, stream)
        try:
            for decoded in frames:
                frame = decoded.frame
                if (frame.width, frame.height) != scan.look.stored:
                    raise SourceError(
                        f"{path}: frame {count} is {frame.width}x{frame.height}, but the others "
                        f"are {scan.look.stored[0]}x{scan.look.stored[1]}; all frames must have "
                        f"one size"
                    )
                yield decoded
                count += 1
        except (av.FFmpegError, _DamagedError) as error:
            raise SourceError(
                f"{path}: frame {count} is damaged, or the file breaks off there; export it again"
            ) from error


class _DamagedError(Exception):
    """A packet or a frame is marked as damaged."""


@contextmanager
def _open_stream(path: Path, max_pixels: int) -> Generator[tuple[Any, Any]]:
    """Open the file and yield the container and its video stream: not a cover picture.

    Opening decodes the first frames; none of more than about ``max_pixels``, for these may be
    larger than the header of the file says.
    """
    try:
        options = {"format_whitelist": _CONTAINERS, **_limited(max_pixels)}
        with av.open(str(path), options=options, metadata_errors="replace") as container:
            streams = _films(container)
            if not streams:
                raise SourceError(f"{path}: holds no film (no video stream)")
            stream = next((s for s in streams if s.disposition & Disposition.default), streams[0])
            if stream.codec_context is None:
                raise SourceError(f"{path}: its codec is not known; export it as VP9 or H.264")
            yield container, stream
    except (av.FFmpegError, ValueError, ArithmeticError) as error:
        raise SourceError(f"{path}: cannot be decoded ({error}); export it again") from error


def _films(container: Any) -> list[Any]:
    """Return the streams of a container that are videos, not pictures attached to it."""
    attached = Disposition.attached_pic | Disposition.still_image | Disposition.timed_thumbnails
    return [stream for stream in container.streams.video if not stream.disposition & attached]


def _other_streams(path: Path, container: Any, stream: Any) -> list[str]:
    films = _films(container)
    if len(films) == 1:
        return []
    which = 1 + films.index(stream)
    return [f"{path.name}: it holds {len(films)} videos, of which number {which} is used"]


def _limited(max_pixels: int) -> dict[str, str]:
    """Return FFmpeg's option that refuses larger frames before there is memory for them."""
    return {"max_pixels": str(max_pixels + _CODED_EXTRA)}


def _decoder(stream: Any, threads: int, max_pixels: int) -> Any:
    """Return the codec context that decodes a stream, with its alpha if it has any; no frame of
    more than about ``max_pixels``."""
    context = stream.codec_context
    has_alpha = stream.metadata.get("alpha_mode") == "1"
    name = _ALPHA_DECODERS.get(context.codec.canonical_name) if has_alpha else None
    decoder = type(context).create(name, "r") if name else context
    decoder.thread_count, decoder.thread_type = threads, "AUTO"
    options = _limited(max_pixels)
    if not any(name in stream.container.format.name for name in _WITH_LENGTHS):
        # Else the half of a frame with which a file breaks off is made up to a whole one.
        options["err_detect"] = "explode"
    decoder.options = options
    return decoder


def _decoded(stream: Any, decoder: Any, begin: int) -> Iterator[DecodedFrame]:
    """Yield every frame from packet ``begin`` on."""
    unit = Fraction(stream.time_base)
    packets = (packet for packet in stream.container.demux(stream) if packet.size)
    for packet in chain(islice(packets, begin, None), [None]):
        if packet is not None and packet.is_corrupt:
            raise _DamagedError
        for frame in decoder.decode(packet):
            if frame.is_corrupt:
                raise _DamagedError
            stamp = None if frame.pts is None else frame.pts * unit
            yield DecodedFrame(stamp, frame, frame.interlaced_frame)


def _deinterlaced(frames: Iterator[DecodedFrame], stream: Any) -> Iterator[DecodedFrame]:
    """Yield a picture for each frame; those that the file does not call interlaced pass."""
    graph, waiting = Graph(), deque[DecodedFrame]()
    graph.threads = 1

    def finished() -> Iterator[DecodedFrame]:
        with suppress(BlockingIOError, EOFError):  # it waits for more frames, or has no more
            while waiting:
                yield replace(waiting[0], frame=graph.vpull())
                waiting.popleft()

    for decoded in frames:
        if not graph.configured:
            source = graph.add_buffer(
                width=decoded.frame.width,
                height=decoded.frame.height,
                format=decoded.frame.format,
                time_base=Fraction(stream.time_base),
            )
            bwdif = graph.add("bwdif", "mode=send_frame:deint=interlaced")
            graph.link_nodes(source, bwdif, graph.add("buffersink")).configure()
        graph.vpush(decoded.frame)
        waiting.append(decoded)
        yield from finished()
    graph.vpush(None)
    yield from finished()
