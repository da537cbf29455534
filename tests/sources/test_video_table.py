"""Videos of every container, codec and pixel format, against ffmpeg's own decoding of them.

``python -m tests.sources.test_video_table`` prints how far each is from it.
"""

import struct
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.reader import FrameReader, OpeningContext
from fire_atlas.sources.video import open_video
from tests.support import ffmpeg
from tests.support import synthetic_fire as fire
from tests.support.ffmpeg import Frames, run

SIZE = 96, 64
COUNT = 10
WORST_MEAN, WORST_P99 = 0.5, 2.0
"""Bounds on the difference from ffmpeg's decoding, of 255."""

WORST_LOSS = 6.0
"""Bound on the mean difference from what was encoded, of 255. The next frame, or the colours of
another matrix, are further off than what a palette or the oldest codecs lose."""


@lru_cache(maxsize=16)  # 0.5 MB each on average
def film(size: tuple[int, int] = SIZE, count: int = COUNT) -> Frames:
    """Return frames to encode, (N, H, W, 4) uint16: gradients that drift, and a disc with a sharp
    edge that crosses them. Alpha falls off from the middle, to 0 in the corners."""
    width, height = size
    t, y, x = np.meshgrid(np.arange(count), np.arange(height), np.arange(width), indexing="ij")
    u, v, turn = (x + 0.5) / width, (y + 0.5) / height, 2 * np.pi * t / count
    red = 0.5 + 0.45 * np.sin(2 * np.pi * u + turn)
    green = 0.1 + 0.8 * v
    blue = 0.5 + 0.45 * np.cos(2 * np.pi * (u - v) - turn)
    alpha = np.clip(1.4 - 2 * np.hypot(u - 0.5, v - 0.5) + 0.1 * np.sin(turn), 0, 1)
    frames = np.stack([red, green, blue, alpha], axis=-1)
    disc = np.hypot(x - (0.2 + 0.6 * t / count) * width, y - 0.45 * height) < 0.22 * height
    frames[disc, :3] = 1, 0.4, 0.05
    samples = np.rint(frames * 65535).astype(np.uint16)
    samples.flags.writeable = False
    return samples


def in_bytes(frames: Frames) -> Frames:
    return np.rint(frames / 257).astype(np.uint8)


@dataclass(frozen=True)
class Film:
    """A file, how ffmpeg makes it, and what it must be read as.

    Attributes:
        name: Its file name.
        options: What ffmpeg's encoder and muxer are told.
        layout: ffmpeg's name of the pixel format.
        size: Width and height of the stored frames, px.
        count: Number of frames that are encoded, at ``rate``.
        filters: What ffmpeg does to the converted frames before it encodes them.
        after: What is done to the file.
        matrix, range: Its colours, as ffmpeg names them.
        depth: Bits of a sample that is read.
        alpha: Whether it has alpha.
        exact: Whether what is read has the very bytes of what was encoded.
        decoder: What the reference must be told.
        fields: Whether its frames consist of two fields.
        square: Width at which its pixels are square, px.
        turn: What turns stored frames (N, H, W, C) upright.
        frames: Which of the frames that were encoded is shown at each tick; None: all, once.
        fps: Ticks per second.
        notes: A part of each note, in order.
    """

    name: str
    options: str
    layout: str = "yuv420p"
    size: tuple[int, int] = SIZE
    count: int = COUNT
    rate: str = "25"
    filters: str = ""
    after: Callable[[Path], None] = lambda _: None
    matrix: str = "bt601"
    range: str = "tv"
    depth: int = 8
    alpha: bool = False
    exact: bool = False
    decoder: str = ""
    fields: bool = False
    square: int | None = None
    turn: Callable[[Frames], Frames] = lambda frames: frames
    frames: tuple[int, ...] | None = None
    fps: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def encoded(self) -> Frames:
        """What is encoded, with alpha only if the file has any."""
        frames = film(self.size, self.count)[..., : 4 if self.alpha else 3]
        return frames if self.depth > 8 else in_bytes(frames)

    @property
    def shown(self) -> tuple[int, ...]:
        return tuple(range(self.count)) if self.frames is None else self.frames

    @property
    def drawings(self) -> list[int]:
        """For each tick, the number of the frame among those that the file holds."""
        held = sorted(set(self.shown))
        return [held.index(i) for i in self.shown]

    @property
    def siting(self) -> tuple[int, int]:
        """Where a sample of chroma lies, in 1/256 of the distance of luma's, right and down."""
        sited_left = any(codec in self.options for codec in SITED_LEFT)
        if "dvvideo" in self.options:
            return 0, 0
        if sited_left and "420" in self.layout:
            return 0, 128
        if sited_left and "422" in self.layout and "x265" not in self.options:
            return 0, -513
        return -513, -513

    @property
    def is_ycbcr(self) -> bool:
        return not any(name in self.layout for name in ("rgb", "bgr", "gbr", "pal", "gray"))

    def colours(self, side: str) -> str:
        """Return what ffmpeg's scaler is told of the colours, on the file's side: in or out."""
        options = f"{ffmpeg.SCALING}:{side}_range={self.range}"
        if self.is_ycbcr:
            right, down = self.siting
            options += f":{side}_color_matrix={self.matrix}"
            options += f":{side}_h_chr_pos={right}:{side}_v_chr_pos={down}"
        return options

    def make(self, folder: Path) -> Path:
        """Return the file in ``folder``, made if it is not there."""
        path = folder / self.name
        if not path.exists():
            # Without a scaler that is told to be accurate, ffmpeg moves planes as they are.
            filters = "" if self.exact else f"scale={self.colours('out')},"
            filters += f"format={self.layout}"
            filters += f",{self.filters}" if self.filters else ""
            ffmpeg.encode(path, self.encoded, self.rate, filters, *self.options.split())
            self.after(path)
        return path

    def reference(self, path: Path) -> Frames:
        """Return what ffmpeg makes of the file at each tick, turned by numpy."""
        size = self.square or self.size[0], self.size[1]
        filters = "bwdif=mode=send_frame:deint=interlaced," if self.fields else ""
        filters += f"scale={size[0]}:{size[1]}:{self.colours('in')}"
        depth = np.uint16 if self.depth > 8 else np.uint8
        channels = 4 if self.alpha else 3
        held = ffmpeg.decode(path, filters, size, channels, depth, *self.decoder.split())
        return self.turn(held[self.drawings])

    def original(self) -> Frames:
        """Return what was encoded, at each tick."""
        frames = self.encoded[list(self.shown)]
        if "gray" in self.layout:
            grey = np.rint(frames[..., :3] @ (0.299, 0.587, 0.114)).astype(frames.dtype)
            frames = np.repeat(grey[..., np.newaxis], 3, axis=-1)
        if self.square:
            size = self.square, self.size[1]
            frames = np.stack([cv2.resize(each, size) for each in frames])
        return self.turn(frames)


def remuxed(*options: str | Path, first: tuple[str | Path, ...] = ()) -> Callable[[Path], None]:
    """Return what copies the streams of a file into another of its kind, with these options."""

    def remux(path: Path) -> None:
        whole = path.with_name(f"whole_{path.name}")
        path.rename(whole)
        run(*first, "-i", whole, *options, path)
        whole.unlink()

    return remux


def with_matrix(a: int, b: int, c: int, d: int) -> Callable[[Path], None]:
    """Return what states a display matrix in an MP4: (x, y) is shown at (ax + cy, bx + dy)."""

    def patch(path: Path) -> None:
        data = bytearray(path.read_bytes())
        one = 1 << 16
        matrix = (a * one, b * one, 0, c * one, d * one, 0, 0, 0, 1 << 30)
        struct.pack_into(">9i", data, data.index(b"tkhd") + 44, *matrix)
        path.write_bytes(data)

    return patch


def with_cover(path: Path) -> None:
    """Add a picture of the film to it, as shops and cameras do."""
    cover = path.with_suffix(".cover.png")
    ffmpeg.encode(cover, in_bytes(film((32, 32), 1)), "25", "null", "-c:v", "png")
    if path.suffix == ".mkv":
        remuxed("-map", "0", "-c", "copy", "-attach", cover, "-metadata:s:t", "mimetype=image/png")(
            path
        )
    else:
        remuxed(
            *("-i", cover, "-map", "1", "-map", "0", "-c", "copy"),
            *("-disposition:v:0", "attached_pic", "-disposition:v:1", "default"),
        )(path)


def with_another(path: Path) -> None:
    """Add a second, larger video stream."""
    other = path.with_name(f"other_{path.name}")
    ffmpeg.encode(other, in_bytes(film((128, 96), 8)), "25", "null", "-c:v", "mpeg4", "-q:v", "2")
    remuxed(
        *("-i", other, "-map", "0", "-map", "1", "-c", "copy"),
        *("-disposition:v:0", "default", "-disposition:v:1", "0"),
    )(path)


with_sound = remuxed(
    *("-f", "lavfi", "-i", "sine=d=0.4", "-map", "1", "-map", "0", "-c:v", "copy", "-c:a", "aac"),
)

SITED_LEFT = "libx264 ", "libx265", "mpeg2video", " mpeg4", "libxvid"
"""Encoders of files in which chroma lies on the left one of two samples of luma."""

X264 = "-c:v libx264 -qp 6 -preset veryfast"
X265 = "-c:v libx265 -preset ultrafast -x265-params log-level=error:qp=6:pools=1:frame-threads=1"
VP9 = "-c:v libvpx-vp9 -crf 6 -b:v 0 -deadline realtime -cpu-used 8"
VP8 = "-c:v libvpx -crf 4 -b:v 4M -deadline realtime -cpu-used 8 -auto-alt-ref 0"
AV1 = "-c:v libaom-av1 -crf 6 -usage realtime -cpu-used 8"
FIELDS = "-flags +ildct+ilme"
TFF, BFF = "tinterlace=interleave_top,setfield=tff", "tinterlace=interleave_bottom,setfield=bff"
INTERLACED: dict[str, Any] = {
    "count": 20, "rate": "50", "frames": tuple(range(0, 20, 2)), "fps": 25, "fields": True,
    "notes": ("interlaced",),
}  # fmt: skip
PAUSED: dict[str, Any] = {"frames": (0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 9)}
PAUSE = "setpts='(N+3*gt(N,4))/25/TB'"
PALETTE = (
    "split[a][b];[a]palettegen=stats_mode=single:reserve_transparent=0[p];"
    "[b][p]paletteuse=new=1:dither=none"
)
NTSC: dict[str, Any] = {"rate": "30000/1001"}
WIDE: dict[str, Any] = {"square": 114, "notes": ("not square",)}  # 96 x 32/27
LARGE: dict[str, Any] = {"size": (128, 720), "count": 3}

FILMS = [
    # Containers and codecs
    Film("h264.mp4", X264),
    Film("h264_high_frame_rate.mp4", X264, rate="120"),
    Film("h264_24.mov", X264, rate="24"),
    Film("h264_ntsc.mkv", X264, **NTSC),
    Film("h264_ntsc.ts", X264, **NTSC),
    Film("h264_ntsc.flv", X264, **NTSC),
    Film("h264_film.mp4", X264, rate="24000/1001"),
    Film("h264_all_intra.avi", X264 + " -g 1"),
    Film("h264_b_frames.avi", X264 + " -bf 2"),
    Film("h264_b_frames.mp4", X264 + " -bf 3 -g 6"),
    Film("h264_b_frames.mkv", X264 + " -bf 3 -g 6"),
    Film("h264_b_frames.ts", X264 + " -bf 3 -g 6"),
    Film("h264_open_gop.m2ts", X264 + " -bf 3 -g 4 -x264opts open-gop=1"),
    Film("h264.mts", X264),
    Film("h264_fragmented.mp4", X264 + " -g 4 -movflags frag_keyframe+empty_moov"),
    Film("h264_sound.mp4", X264, after=with_sound),
    Film("h264_sound.ts", X264, after=with_sound),
    Film("hevc.mp4", X265),
    Film("hevc.mkv", X265),
    Film("hevc.ts", X265),
    Film("av1.mp4", AV1),
    Film("av1.mkv", AV1),
    Film("av1.webm", AV1),
    Film("vp8.webm", VP8),
    Film("vp9.webm", VP9),
    Film("vp9.mp4", VP9),
    Film("vp9_hidden_frames.mkv", "-c:v libvpx-vp9 -crf 6 -b:v 0 -auto-alt-ref 1 -lag-in-frames 8"),
    Film("theora.ogv", "-c:v libtheora -q:v 10"),
    Film("mpeg4.avi", "-c:v mpeg4 -q:v 2"),
    Film("mpeg4_b_frames.avi", "-c:v mpeg4 -q:v 2 -bf 2"),
    Film("mpeg4_packed.avi", "-c:v libxvid -q:v 2 -bf 2", frames=tuple(range(9))),
    Film("mpeg4.mp4", "-c:v mpeg4 -q:v 2 -bf 2"),
    Film("mpeg1.mpg", "-c:v mpeg1video -q:v 2 -bf 2"),
    Film("mpeg2.mpg", "-c:v mpeg2video -q:v 2 -bf 2", **NTSC),
    Film("mpeg2.ts", "-c:v mpeg2video -q:v 2 -bf 2"),
    Film("mpeg2.vob", "-c:v mpeg2video -q:v 2 -bf 2 -f vob"),
    Film("mjpeg.avi", "-c:v mjpeg -q:v 2", "yuvj420p", range="pc"),
    Film("mjpeg_422.mov", "-c:v mjpeg -q:v 2", "yuvj422p", range="pc"),
    Film("flv1.flv", "-c:v flv -q:v 2"),
    Film("h263.3gp", "-c:v h263 -q:v 2", size=(176, 144), rate="30000/1001",
         square=192, notes=("not square",)),
    Film("wmv2.wmv", "-c:v wmv2 -q:v 2"),
    Film("wmv1.asf", "-c:v wmv1 -q:v 2"),
    Film("msmpeg4.avi", "-c:v msmpeg4 -q:v 2"),
    Film("svq1.mov", "-c:v svq1 -q:v 2", "yuv410p"),
    Film("frames.y4m", "-f yuv4mpegpipe"),
    Film("frames_444.y4m", "-f yuv4mpegpipe", "yuv444p", **NTSC),
    # Pixel formats
    Film("h264_422.mp4", X264, "yuv422p"),
    Film("h264_444.mp4", X264, "yuv444p"),
    Film("h264_10_bits.mp4", X264, "yuv420p10le", depth=10),
    Film("h264_422_10_bits.mov", X264, "yuv422p10le", depth=10),
    Film("h264_rgb.mp4", "-c:v libx264rgb -qp 0 -preset veryfast", "rgb24", exact=True),
    Film("hevc_10_bits.mp4", X265, "yuv420p10le", depth=10),
    Film("hevc_422_12_bits.mkv", X265, "yuv422p12le", depth=12),
    Film("hevc_rgb.mp4", X265 + ":lossless=1", "gbrp", exact=True),
    Film("vp9_10_bits.webm", VP9 + " -profile:v 2", "yuv420p10le", depth=10),
    Film("vp9_444_12_bits.webm", VP9 + " -profile:v 3", "yuv444p12le", depth=12),
    Film("av1_10_bits.mp4", AV1, "yuv420p10le", depth=10),
    Film("prores.mov", "-c:v prores_ks -profile:v hq -qscale:v 2", "yuv422p10le", depth=10),
    Film("dnxhr.mov", "-c:v dnxhd -profile:v dnxhr_hq", "yuv422p", matrix="bt709",
         size=(256, 128)),
    Film("cineform.mov", "-c:v cfhd -quality film3+", "yuv422p10le", depth=10),
    Film("jpeg2000.mov", "-c:v jpeg2000 -pred 1", "rgb24", exact=True),
    Film("huffyuv.avi", "-c:v huffyuv", "yuv422p"),
    Film("ffv1_410.mkv", "-c:v ffv1", "yuv410p"),
    Film("ffv1_16_bits.mkv", "-c:v ffv1 -level 3", "gbrp16le", depth=16, exact=True),
    Film("ffv1_grey.avi", "-c:v ffv1", "gray", range="pc"),
    Film("ffv1_grey_16_bits.mkv", "-c:v ffv1 -level 3", "gray16le", depth=16, range="pc"),
    Film("png.mov", "-c:v png", "rgb24", exact=True),
    Film("png_grey.mov", "-c:v png", "gray", range="pc"),
    Film("png_palette.mov", "-c:v png", "rgb24", filters=PALETTE, alpha=True),  # opaque
    Film("png_16_bits.mov", "-c:v png", "rgb48be", depth=16, exact=True),
    Film("raw.avi", "-c:v rawvideo"),
    Film("raw_uyvy.mov", "-c:v rawvideo", "uyvy422"),
    Film("v210.mov", "-c:v v210", "yuv422p10le", depth=10),
    Film("cinepak.avi", "-c:v cinepak -q:v 1", "rgb24"),
    # Alpha
    Film("utvideo_alpha.avi", "-c:v utvideo", "gbrap", alpha=True, exact=True),
    Film("ffv1_alpha.mkv", "-c:v ffv1", "bgra", alpha=True, exact=True),
    Film("ffv1_alpha.avi", "-c:v ffv1", "bgra", alpha=True, exact=True),
    Film("ffv1_yuva.mkv", "-c:v ffv1", "yuva420p", alpha=True),
    Film("ffv1_yuva_10_bits.mkv", "-c:v ffv1", "yuva444p10le", alpha=True, depth=10),
    Film("png_alpha.mov", "-c:v png", "rgba", alpha=True, exact=True),
    Film("png_alpha_16_bits.mov", "-c:v png", "rgba64be", depth=16, alpha=True, exact=True),
    Film("qtrle_alpha.mov", "-c:v qtrle", "argb", alpha=True, exact=True),
    Film("qtrle.mov", "-c:v qtrle", "rgb24", exact=True),
    Film(
        "prores_alpha.mov",
        "-c:v prores_ks -profile:v 4444 -alpha_bits 16 -qscale:v 2",
        "yuva444p10le",
        alpha=True,
        depth=12,
    ),
    Film("vp8_alpha.webm", VP8, "yuva420p", alpha=True, decoder="-c:v libvpx"),
    Film("vp9_alpha.webm", VP9, "yuva420p", alpha=True, decoder="-c:v libvpx-vp9"),
    # Colours
    Film("full_range.mp4", X264 + " -color_range pc", range="pc"),
    Film("full_range.mkv", X265 + ":range=full -color_range pc", range="pc"),
    Film("full_range.webm", VP9 + " -color_range pc", range="pc"),
    Film("limited_jpeg.mkv", "-c:v mjpeg -q:v 2 -color_range tv", range="tv"),
    Film("bt601.mp4", X264 + " -colorspace smpte170m"),
    Film("bt709.mp4", X264 + " -colorspace bt709", matrix="bt709"),
    Film("bt709.webm", VP9 + " -colorspace bt709", matrix="bt709"),
    Film("bt709.mov", "-c:v prores_ks -qscale:v 2", "yuv422p10le", matrix="bt709", depth=10,
         filters="setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709"),
    Film("bt709_mpeg2.ts", "-c:v mpeg2video -q:v 2 -colorspace bt709 -color_trc bt709"
         " -color_primaries bt709", matrix="bt709"),
    Film("bt2020_matrix.mkv", X265 + ":colormatrix=bt2020nc -colorspace bt2020nc", "yuv420p10le",
         matrix="bt2020", depth=10),
    Film("hd_untagged.mp4", X264, matrix="bt709", **LARGE),
    Film("hd_bt601.mp4", X264 + " -colorspace smpte170m", **LARGE),
    # Shape of pixels, fields, turns
    Film("wide.mp4", X264, filters="setsar=32/27", **WIDE),
    Film("wide.mkv", X264, filters="setsar=32/27", **WIDE),
    Film("wide.avi", "-c:v mpeg4 -q:v 2", filters="setsar=32/27", **WIDE),
    Film("wide.mpg", "-c:v mpeg2video -q:v 2", filters="setsar=32/27", **WIDE),
    Film("wide.y4m", "-f yuv4mpegpipe", filters="setsar=32/27", **WIDE),
    Film("narrow.mp4", X264, filters="setsar=8/9", square=85, notes=("not square",)),
    Film("wide_alpha.mov", "-c:v prores_ks -profile:v 4444 -qscale:v 2", "yuva444p10le",
         filters="setsar=32/27", alpha=True, depth=12, **WIDE),
    Film("fields_top.mpg", f"-c:v mpeg2video -q:v 2 {FIELDS} -top 1", filters=TFF, **INTERLACED),
    Film("fields_bottom.ts", f"-c:v mpeg2video -q:v 2 {FIELDS} -top 0", filters=BFF, **INTERLACED),
    Film("fields_top.mp4", f"{X264} {FIELDS} -x264opts tff=1", filters=TFF, **INTERLACED),
    Film("fields_bottom.mts", f"{X264} {FIELDS} -x264opts bff=1", filters=BFF, **INTERLACED),
    Film("fields_b_frames.mkv", f"{X264} {FIELDS} -bf 2 -x264opts tff=1", filters=TFF,
         **INTERLACED),
    Film("fields_prores.mov", f"-c:v prores_ks -qscale:v 2 {FIELDS}", "yuv422p10le", depth=10,
         filters=TFF, **INTERLACED),
    Film("dv.avi", f"-c:v dvvideo {FIELDS}", size=(720, 576), filters=BFF + ",setsar=16/15",
         square=768, **{**INTERLACED, "count": 6, "frames": (0, 2, 4),
                        "notes": ("interlaced", "not square")}),
    Film("turned_90.mp4", X264, after=with_matrix(0, 1, -1, 0), notes=("90° to the right",),
         turn=lambda frames: np.rot90(frames, -1, (1, 2))),
    Film("turned_270.mov", X264, after=with_matrix(0, -1, 1, 0), notes=("90° to the left",),
         turn=lambda frames: np.rot90(frames, 1, (1, 2))),
    Film("turned_180.mp4", X264, after=with_matrix(-1, 0, 0, -1), notes=("180°",),
         turn=lambda frames: frames[:, ::-1, ::-1]),
    Film("mirrored.mp4", X264, after=with_matrix(-1, 0, 0, 1), notes=("mirrored",),
         turn=lambda frames: frames[:, :, ::-1]),
    Film("upside_down.mov", X264, after=with_matrix(1, 0, 0, -1), notes=("mirrored",),
         turn=lambda frames: frames[:, ::-1]),
    Film("transposed.mp4", X264, after=with_matrix(0, 1, 1, 0), notes=("mirrored",),
         turn=lambda frames: frames.transpose(0, 2, 1, 3)),
    Film("transverse.mp4", X264, after=with_matrix(0, -1, -1, 0), notes=("mirrored",),
         turn=lambda frames: frames[:, ::-1, ::-1].transpose(0, 2, 1, 3)),
    Film("turned_wide.mp4", X264, filters="setsar=32/27", after=with_matrix(0, 1, -1, 0),
         square=114, notes=("not square", "90°"),
         turn=lambda frames: np.rot90(frames, -1, (1, 2))),
    # Times
    Film("paused.mp4", X264 + " -fps_mode vfr", filters=PAUSE, **PAUSED),
    Film("paused_b_frames.mp4", X264 + " -bf 2 -fps_mode vfr", filters=PAUSE, **PAUSED),
    Film("paused.mkv", X264 + " -fps_mode vfr", filters=PAUSE, **PAUSED),
    Film("paused.webm", VP9 + " -fps_mode vfr", filters=PAUSE, **PAUSED),
    Film("on_twos.mkv", X264 + " -fps_mode vfr", filters="setpts=2*N/24/TB", rate="24", fps=12),
    Film("jittered.mp4", X264 + " -fps_mode passthrough -enc_time_base -1",
         filters="settb=1/1000,setpts='40*N+5*mod(N,3)'"),
    Film("jittered.mkv", X264 + " -fps_mode passthrough -enc_time_base -1",
         filters="settb=1/1000,setpts='40*N+5*mod(N,3)'"),
    Film("early.mkv", X264 + " -avoid_negative_ts disabled -fps_mode passthrough",
         filters="setpts=PTS-0.2/TB"),
    Film("early.mp4", X264 + " -avoid_negative_ts disabled -fps_mode passthrough",
         filters="setpts=PTS-0.2/TB", frames=tuple(range(5, 10))),  # as its edit list says
    Film("late.mp4", X264, filters="setpts=PTS+5/TB"),
    Film("late.mkv", X264 + " -avoid_negative_ts disabled", filters="setpts=PTS+5/TB"),
    Film("cut.mp4", X264 + " -g 10", count=20, frames=tuple(range(5, 20)),
         after=remuxed("-c", "copy", first=("-ss", "0.2"))),
    Film("cut_b_frames.mov", X264 + " -g 10 -bf 2", count=20, frames=tuple(range(5, 20)),
         after=remuxed("-c", "copy", first=("-ss", "0.2"))),
    Film("cut_end.mp4", X264 + " -g 10 -bf 2", count=20, frames=(*range(13), 12, 14),
         after=remuxed("-c", "copy", "-t", "0.48")),
    Film("cut_hevc.mp4", X265 + ":keyint=10", count=20, frames=tuple(range(5, 20)),
         after=remuxed("-c", "copy", first=("-ss", "0.2"))),
    # Other streams
    Film("cover.mp4", X264, after=with_cover),
    Film("cover.mkv", X264, after=with_cover),
    Film("two_videos.mp4", X264, after=with_another, notes=("2 videos",)),
    Film("two_videos.mkv", X264, after=with_another, notes=("2 videos",)),
]  # fmt: skip


def opened(path: Path, jobs: int = 1) -> FrameReader:
    with Workers(jobs) as workers:
        settings = FramesSource(path=str(path), height="source", matte="none")
        return open_video(path, settings, OpeningContext("srgb", workers))


def pictures(reader: FrameReader) -> Frames:
    return np.stack([reader.read(i) for i in range(reader.count)])


@dataclass(frozen=True)
class Figures:
    """How far frames are from others, of 255.

    Attributes:
        mean, p99: Mean, and 99th percentile of all samples of colour.
        alpha: Largest difference of alpha.
    """

    mean: float
    p99: float
    alpha: float

    @classmethod
    def of(cls, found: Frames, expected: Frames) -> "Figures":
        scale = 255 / np.iinfo(expected.dtype).max
        apart = np.abs(found.astype(np.float64) - expected) * scale
        colours, alpha = apart[..., :3], apart[..., 3:]
        return cls(
            float(colours.mean()),
            float(np.percentile(colours, 99)),
            float(alpha.max()) if alpha.size else 0,
        )


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which tests make their films, each once."""
    return tmp_path_factory.mktemp("films")


every_film = pytest.mark.parametrize("case", FILMS, ids=lambda case: case.name)


@every_film
def test_a_video_is_read_as_ffmpeg_decodes_it(case: Film, folder: Path) -> None:
    path = case.make(folder)
    reader, expected = opened(path), case.reference(path)
    found = pictures(reader)
    assert (found.shape, found.dtype) == (expected.shape, expected.dtype)
    assert (reader.width, reader.height) == (found.shape[2], found.shape[1])
    assert reader.fps == pytest.approx(case.fps or float(Fraction(case.rate)), rel=1e-4)
    figures = Figures.of(found, expected)
    assert figures.mean <= WORST_MEAN and max(figures.p99, figures.alpha) <= WORST_P99
    assert Figures.of(found, case.original()).mean <= WORST_LOSS
    if case.exact:
        np.testing.assert_array_equal(found, case.original())
    assert len(reader.notes) == len(case.notes)
    for note, part in zip(reader.notes, case.notes, strict=True):
        assert part in note


def by_name(name: str) -> Film:
    return next(case for case in FILMS if case.name == name)


@pytest.mark.parametrize(
    "name",
    [
        "h264_b_frames.mp4", "h264_open_gop.m2ts", "hevc.mkv", "av1.mp4", "vp9.webm",
        "vp9_alpha.webm", "mpeg2.ts", "mpeg4_b_frames.avi", "theora.ogv", "ffv1_16_bits.mkv",
        "prores_alpha.mov", "png_alpha.mov", "utvideo_alpha.avi", "fields_b_frames.mkv",
        "cut_b_frames.mov", "paused_b_frames.mp4",
    ],
)  # fmt: skip
def test_a_video_is_the_same_whenever_and_by_however_many_threads_it_is_decoded(
    name: str, folder: Path
) -> None:
    path = by_name(name).make(folder)
    first = pictures(opened(path))
    for jobs in (1, 4, 4, 4):
        np.testing.assert_array_equal(pictures(opened(path, jobs)), first)


SAME_FRAMES = {
    "h264": ("mp4", "mov", "mkv", "avi"), "ffv1": ("mkv", "avi", "mov"),
    "png": ("mov", "mkv", "avi"),
}  # fmt: skip
"""Containers of each lossless codec."""
LOSSLESS = {"h264": "-c:v libx264rgb -qp 0", "ffv1": "-c:v ffv1", "png": "-c:v png"}
STORED = {"h264": "rgb24", "ffv1": "bgr0", "png": "rgb24"}


@pytest.mark.parametrize(
    ("codec", "kind"), [(codec, kind) for codec, kinds in SAME_FRAMES.items() for kind in kinds]
)
def test_a_lossless_video_has_the_frames_of_a_folder_of_images(
    codec: str, kind: str, tmp_path: Path
) -> None:
    case = Film(f"a.{kind}", LOSSLESS[codec], STORED[codec], exact=True)
    opaque = np.full((COUNT, *SIZE[::-1], 1), 255, np.uint8)
    images = fire.write_folder(tmp_path / "a", [*np.concatenate([case.encoded, opaque], axis=-1)])
    stills = fire.open_clip(images, matte="none", fps=25, height="source")
    video = fire.open_clip(case.make(tmp_path), matte="none", height="source")
    assert (video.count, video.fps) == (stills.count, stills.fps)
    for i in range(COUNT):
        np.testing.assert_array_equal(video.read(i), stills.read(i))


UNCHECKED = (
    "h264.mts", "h264_open_gop.m2ts", "h264_b_frames.ts", "hevc.ts", "mpeg2.ts", "mpeg2.mpg",
    "mpeg1.mpg", "mpeg2.vob", "theora.ogv", "frames.y4m", "flv1.flv", "h264_ntsc.flv", "wmv2.wmv",
)  # fmt: skip
"""Files whose beginning does not tell how long they are."""
CHECKED = (
    "h264_b_frames.mp4", "h264_fragmented.mp4", "prores.mov", "h264_b_frames.mkv", "vp9.webm",
    "mjpeg.avi",
)  # fmt: skip


def cut_off(path: Path, folder: Path) -> Iterator[Path]:
    """Yield copies of a file that break off sooner or later."""
    data = path.read_bytes()
    for share in np.linspace(0.02, 0.98, 13):
        cut = folder / f"cut_{share:.2f}{path.suffix}"
        cut.write_bytes(data[: int(len(data) * share) | 1])  # odd: never at the end of a packet
        yield cut


@pytest.mark.parametrize("name", CHECKED)
def test_a_video_that_is_shorter_than_it_states_is_refused(
    name: str, folder: Path, tmp_path: Path
) -> None:
    for cut in cut_off(by_name(name).make(folder), tmp_path):
        with pytest.raises(SourceError, match=rf"{cut.name}: the video is truncated"):
            opened(cut)


@pytest.mark.parametrize("name", UNCHECKED)
def test_a_video_that_breaks_off_is_refused_or_has_whole_frames(
    name: str, folder: Path, tmp_path: Path
) -> None:
    path = by_name(name).make(folder)
    whole = [frame.tobytes() for frame in pictures(opened(path))]
    for cut in cut_off(path, tmp_path):
        refusal = refused(cut)
        if refusal is not None:
            assert refusal.startswith(f"{cut}: ") and "export it again" in refusal
            continue
        for i, frame in enumerate(pictures(opened(cut))):
            assert frame.tobytes() in whole, f"{cut.name}: no frame of the film is frame {i}"


def refused(path: Path) -> str | None:
    """Return with which message a video is refused; None if it is not."""
    try:
        opened(path)
    except SourceError as error:
        return str(error)
    return None


RAMP = np.linspace(0, 1, 65)
"""Grey levels from black to white, of the signal."""


def ramp(path: Path, tags: str) -> None:
    """Write a lossless film of grey steps, of 4 px each, in 10 bits."""
    levels = np.rint(RAMP.repeat(4) * 65535).astype(np.uint16)
    frames = np.broadcast_to(levels[:, np.newaxis], (2, 16, levels.size, 3))
    stored = f"scale=out_color_matrix=bt2020:out_range=tv:{ffmpeg.SCALING},format=yuv444p10le"
    ffmpeg.encode(path, frames, "25", stored, "-c:v", "ffv1", *tags.split())


HDR = "-colorspace bt2020nc -color_primaries bt2020 -color_trc"


def test_hlg_is_shown_with_its_reference_white_below_white(tmp_path: Path) -> None:
    ramp(tmp_path / "a.mkv", f"{HDR} arib-std-b67")
    reader = opened(tmp_path / "a.mkv")
    shown = reader.read(0)[8, 2::4] / 65535  # the middle of each step
    assert "HLG" in reader.notes[0]
    np.testing.assert_allclose(shown.max(axis=1), shown.min(axis=1), atol=1e-3)
    grey = shown[:, 1]
    assert grey[0] == 0 and grey[-1] == pytest.approx(1, abs=2e-3)
    assert (np.diff(grey) > 0).all()
    assert 0.75 < grey[48] < 0.95  # the signal 0.75
    # BT.2100 shows half the signal at (1/12)^1.2 of the peak, and 0.75 at 0.203 of it (BT.2408).
    quarter = (1 / 12) ** 1.2 / 0.203
    assert grey[32] == pytest.approx(1.055 * quarter ** (1 / 2.4) - 0.055, abs=2e-3)


@pytest.mark.parametrize("kind", ["mkv", "mp4"])
def test_pq_is_refused_with_what_maps_it(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{kind}"
    if kind == "mkv":
        ramp(path, f"{HDR} smpte2084")
    else:
        tags = ":colorprim=bt2020:transfer=smpte2084:colormatrix=bt2020nc"
        Film(path.name, X265 + tags, "yuv420p10le", depth=10).make(tmp_path)
    with pytest.raises(SourceError, match=rf"{path.name}: .*PQ.*ffmpeg -i .*zscale"):
        opened(path)


BT709 = (0.64, 0.33), (0.30, 0.60), (0.15, 0.06)
WIDE_GAMUTS = {
    "bt2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)),
    "smpte432": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060)),  # Display P3
}
"""Chromaticities x, y of red, green and blue, by ffmpeg's names."""


def to_xyz(primaries: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """Return the matrix from linear R, G, B, whose white is D65, to X, Y, Z (SMPTE RP 177)."""
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in primaries]).T
    white = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
    return columns * np.linalg.solve(columns, white)


@pytest.mark.parametrize("gamut", WIDE_GAMUTS)
@pytest.mark.parametrize(
    ("name", "layout"), [("a.mkv", "yuv444p10le"), ("a.mp4", "yuv420p"), ("rgb.mkv", "gbrp")]
)
def test_a_wide_gamut_is_brought_to_that_of_srgb(
    gamut: str, name: str, layout: str, tmp_path: Path
) -> None:
    encoder = X264 if name == "a.mp4" else "-c:v ffv1"
    tags = f" -color_primaries {gamut} -colorspace bt709"
    depth = 10 if "10" in layout else 8
    case = Film(name, encoder + (tags if "yuv" in layout else tags.split(" -colorspace")[0]),
                layout, matrix="bt709", depth=depth)  # fmt: skip
    path = case.make(tmp_path)
    stored = case.reference(path)
    top = np.iinfo(stored.dtype).max
    signal = stored / top
    light = np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
    matrix = np.linalg.solve(to_xyz(BT709), to_xyz(WIDE_GAMUTS[gamut]))
    light = np.clip(light @ matrix.T, 0, 1)
    signal = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    reader = opened(path)
    figures = Figures.of(pictures(reader), np.rint(signal * top).astype(stored.dtype))
    assert figures.mean <= WORST_MEAN and figures.p99 <= WORST_P99
    assert ["wide gamut" in note for note in reader.notes] == [True]


def report(names: list[str]) -> None:
    """Print how far each film is from ffmpeg's decoding, and from what was encoded, of 255."""
    print(f"{'':24}  frames  from ffmpeg: mean    p99  alpha  from what was encoded: mean  alpha")
    with tempfile.TemporaryDirectory() as folder:
        for case in FILMS:
            if names and case.name not in names:
                continue
            path = case.make(Path(folder))
            try:
                found = pictures(opened(path))
            except SourceError as error:
                print(error)
                continue
            expected = case.reference(path)
            if found.shape != expected.shape or found.dtype != expected.dtype:
                print(f"{case.name:24}  {found.shape} {found.dtype}, not {expected.shape}")
                continue
            figures, loss = Figures.of(found, expected), Figures.of(found, case.original())
            print(
                f"{case.name:24}  {len(found):6}  {figures.mean:17.3f}  {figures.p99:5.2f}  "
                f"{figures.alpha:5.2f}  {loss.mean:27.3f}  {loss.alpha:5.2f}"
            )


if __name__ == "__main__":
    report(sys.argv[1:])
