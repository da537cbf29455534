"""Write videos by PyAV: VP9 with alpha in WebM, and H.264 with alpha beside the colours in MP4."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import bleed_colour
from fire_atlas.atlas.trim import up_to
from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import REC709, Bytes
from fire_atlas.formats.movies.movie import Movie, schedule

_BLEED = 16
"""Distance, px, up to which transparent pixels get the colour of the flame, so that the encoder
mixes no black into its edge."""

_BT709, _LIMITED = 1, 1
"""FFmpeg's numbers of the standard BT.709, for primaries, curve and matrix, and of its range."""


def _yuv_matrix() -> NDArray[np.float32]:
    """Return the matrix (3, 3) from R, G, B in 0..255 to Y, Cb, Cr in BT.709's limited range."""
    luma = np.array(REC709, np.float64)
    blue = (np.array([0, 0, 1]) - luma) / (2 * (1 - luma[2]))
    red = (np.array([1, 0, 0]) - luma) / (2 * (1 - luma[0]))
    return np.stack([luma * 219, blue * 224, red * 224]).astype(np.float32) / np.float32(255)


_YUV = _yuv_matrix()
_YUV_OFFSET = np.array([16, 128, 128], np.float32)


@dataclass(frozen=True, slots=True)
class _Format:
    """How a kind of video is encoded.

    Attributes:
        container, codec, pixels: Names in FFmpeg.
        clock: Ticks of its time stamps per second.
        options: Options of the codec.
        flags: Options of the container.
        planes: Returns the planes Y, Cb, Cr and, if it has one, alpha, of a frame (H, W, 4).
    """

    container: str
    codec: str
    pixels: str
    clock: int
    options: Mapping[str, str]
    planes: Callable[[Bytes], list[Bytes]]
    flags: Mapping[str, str] = field(default_factory=dict)


def webm(movie: Movie) -> bytes:
    """Return a WebM of VP9 with alpha, which browsers play transparent.

    Raises:
        OutputError: The encoder is missing, or refuses the frames.
    """
    options = {"crf": "16", "b": "0", "deadline": "good", "cpu-used": "2", "row-mt": "0"}
    # FFmpeg cannot add alpha to frames that others refer to, but nobody sees.
    options["auto-alt-ref"] = "0"
    return _encoded(movie, _Format("webm", "libvpx-vp9", "yuva420p", 1000, options, _with_alpha))


def mp4(movie: Movie) -> bytes:
    """Return an MP4 of H.264, twice as wide as the frames: the picture over black on the left, its
    alpha in grey on the right.

    Raises:
        OutputError: The encoder is missing, or refuses the frames.
    """
    # By default x264 rounds as the CPU's instructions do, and now and then by addresses in memory.
    options = {"crf": "14", "preset": "slow", "x264-params": "cpu-independent=1"}
    # The index stands before the frames, so that a page plays them while they are loaded.
    first = {"movflags": "+faststart"}
    return _encoded(
        movie, _Format("mp4", "libx264", "yuv420p", 90000, options, _beside_alpha, first)
    )


def _with_alpha(frame: Bytes) -> list[Bytes]:
    coloured = bleed_colour(frame, _BLEED)
    return [*_as_yuv(coloured[..., :3]), frame[..., 3]]


def _beside_alpha(frame: Bytes) -> list[Bytes]:
    """Return the planes of a frame beside its alpha; each half has an even width and height."""
    height, width = up_to(2, frame.shape[0]), up_to(2, frame.shape[1])
    both = np.zeros((height, 2 * width, 3), np.uint8)
    alpha = frame[..., 3:]
    both[: frame.shape[0], : frame.shape[1]] = np.rint(frame[..., :3] * (alpha / np.float32(255)))
    both[: frame.shape[0], width : width + frame.shape[1]] = alpha
    return _as_yuv(both)


def _as_yuv(rgb: Bytes) -> list[Bytes]:
    """Return Y (H, W), and the means of Cb and Cr in blocks of 2 x 2 px, of sRGB (H, W, 3)."""
    yuv = rgb @ _YUV.T + _YUV_OFFSET
    height, width = rgb.shape[:2]
    chroma = np.pad(yuv[..., 1:], ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    blocks = chroma.reshape(chroma.shape[0] // 2, 2, chroma.shape[1] // 2, 2, 2).mean(axis=(1, 3))
    return [np.rint(plane).astype(np.uint8) for plane in (yuv[..., 0], *np.moveaxis(blocks, -1, 0))]


def _encoded(movie: Movie, encoding: _Format) -> bytes:
    import av
    import av.logging

    av.logging.set_level(None)
    file = io.BytesIO()
    try:
        container = av.open(
            file, "w", encoding.container,
            # Without this flag the container has a random number and the versions of libraries.
            options={"fflags": "+bitexact", **encoding.flags},
            # FFmpeg reads again what it has written where it moves an index.
            io_open=lambda *_: io.BytesIO(file.getvalue()),
        )  # fmt: skip
        with container:
            _write_frames(movie, encoding, container, av)
    except (av.FFmpegError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise OutputError(
            f"{encoding.container}: FFmpeg cannot encode {movie.width}x{movie.height} px "
            f"by {encoding.codec} ({reason}); use another format, or a smaller source.height",
            key=("movies",),
        ) from error
    return file.getvalue()


def _write_frames(movie: Movie, encoding: _Format, container: Any, av: Any) -> None:
    ticks = [duration * encoding.clock / 1000 for duration in movie.durations]
    stream, lengths, time = None, dict[int, int](), 0
    for i, length in schedule(ticks, 1, 1):
        planes = encoding.planes(movie.frame(i))
        stream = stream or _stream(movie, encoding, planes[0], container)
        picture = _picture(planes, encoding, av)
        picture.pts, picture.time_base = time, Fraction(1, encoding.clock)
        lengths[time] = length
        time += length
        _write(stream.encode(picture), lengths, container)
    assert stream is not None
    _write(stream.encode(None), lengths, container)


def _stream(movie: Movie, encoding: _Format, luma: Bytes, container: Any) -> Any:
    """Return a stream for pictures as large as ``luma``, encoded by one thread so that its bytes do
    not depend on the machine's number of cores."""
    rate = Fraction(1000 * len(movie.durations) / sum(movie.durations)).limit_denominator(1001)
    stream = container.add_stream(encoding.codec, rate=rate)
    stream.height, stream.width = luma.shape
    stream.pix_fmt = encoding.pixels
    codec = stream.codec_context
    codec.time_base = Fraction(1, encoding.clock)
    codec.thread_count = 1
    codec.color_primaries = codec.color_trc = codec.colorspace = _BT709
    codec.color_range = _LIMITED
    codec.options = dict(encoding.options)
    return stream


def _picture(planes: list[Bytes], encoding: _Format, av: Any) -> Any:
    height, width = planes[0].shape
    picture = av.VideoFrame(width, height, encoding.pixels)
    picture.colorspace, picture.color_range = _BT709, _LIMITED
    for target, plane in zip(picture.planes, planes, strict=True):
        rows = np.zeros((target.height, target.line_size), np.uint8)
        rows[:, : plane.shape[1]] = plane
        target.update(rows)
    return picture


def _write(packets: Any, lengths: Mapping[int, int], container: Any) -> None:
    """Write encoded frames, each with its duration by the time at which it is shown."""
    for packet in packets:
        packet.duration = lengths[packet.pts]
        container.mux(packet)
