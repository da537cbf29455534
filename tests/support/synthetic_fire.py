"""Synthetic fire for the source tests, and writers of it in every format."""

import struct
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, premultiply, srgb_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.frames import open_frames
from fire_atlas.sources.reader import OpeningContext

Rgba = NDArray[np.uint8]


def fires(count: int = 6, width: int = 48, height: int = 40, *, hard: bool = False) -> list[Rgba]:
    """Frames (H, W, 4) of a blob that moves right and changes colour; hard: alpha is 0 or 255."""
    y, x = np.mgrid[:height, :width]
    frames = []
    for i in range(count):
        far = np.hypot(x - (12 + 4 * i), y - 20) / 11
        frame = np.zeros((height, width, 4), np.uint8)
        frame[..., 0] = 255
        frame[..., 1] = 40 * i % 256
        frame[..., 2] = 8
        frame[..., 3] = np.where(far < 0.8, 255, 0) if hard else np.clip(255 * (1.5 - far), 0, 255)
        frame[frame[..., 3] == 0] = 0
        frames.append(frame)
    return frames


def light(frame: NDArray[Any]) -> Pixels:
    """The expected pixels of a straight sRGB frame, by the exact formula."""
    unit = frame / np.iinfo(frame.dtype).max
    return premultiply(srgb_to_linear(unit[..., :3]), unit[..., 3].astype(np.float32))


def open_clip(path: Path, blend_space: str = "srgb", **settings: Any) -> Clip:
    """Open ``path`` as a recipe with these settings would."""
    with Workers(1) as workers:
        context = OpeningContext(blend_space, workers)
        return open_frames(FramesSource(path=str(path), **settings), path, context)


def all_frames(clip: Clip) -> list[Pixels]:
    return [clip.read(i) for i in range(clip.count)]


def images(frames: Sequence[Rgba]) -> list[Image.Image]:
    return [Image.fromarray(frame) for frame in frames]


def write_folder(folder: Path, frames: Sequence[Rgba], ending: str = "png") -> Path:
    folder.mkdir()
    for i, image in enumerate(images(frames)):
        options: dict[str, Any] = {"lossless": True, "exact": True} if ending == "webp" else {}
        image.save(folder / f"fire{i}.{ending}", **options)
    return folder


def write_deep_folder(folder: Path, frames: Sequence[Rgba]) -> Path:
    folder.mkdir()
    for i, frame in enumerate(frames):
        deep = cv2.cvtColor(frame.astype(np.uint16) * 257, cv2.COLOR_RGBA2BGRA)
        assert cv2.imwrite(str(folder / f"fire{i}.png"), deep)
    return folder


def write_sheet(path: Path, frames: Sequence[Rgba], columns: int) -> Path:
    rows = [np.hstack(frames[i : i + columns]) for i in range(0, len(frames), columns)]
    Image.fromarray(np.vstack(rows)).save(path)
    return path


def write_animation(path: Path, frames: Sequence[Rgba], **options: Any) -> Path:
    first, *others = images(frames)
    first.save(path, save_all=True, append_images=others, **options)
    return path


def write_exr_folder(folder: Path, frames: Sequence[Rgba], *, half: bool = False) -> Path:
    folder.mkdir()
    for i, frame in enumerate(frames):
        (folder / f"fire{i}.exr").write_bytes(exr_bytes(light(frame), half=half))
    return folder


def exr_bytes(pixels: Pixels, *, half: bool = False) -> bytes:
    height, width = pixels.shape[:2]
    frame = av.VideoFrame(width, height, "gbrapf32le")
    for plane, channel in zip(frame.planes, (1, 2, 0, 3), strict=True):
        padded = np.zeros((height, plane.line_size // 4), np.float32)
        padded[:, :width] = pixels[..., channel]
        plane.update(padded.tobytes())
    encoder: Any = av.CodecContext.create("exr", "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "gbrapf32le"
    encoder.time_base = Fraction(1, 24)
    encoder.options = {"format": "half" if half else "float", "compression": "zip16"}
    return b"".join(bytes(packet) for packet in [*encoder.encode(frame), *encoder.encode(None)])


def write_video(
    path: Path,
    frames: Sequence[Rgba],
    codec: str,
    layout: str,
    options: dict[str, str] | None = None,
    rate: int = 12,
) -> Path:
    height, width = frames[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height, stream.pix_fmt = width, height, layout
        for i, frame in enumerate(frames):
            picture = av.VideoFrame.from_ndarray(frame, format="rgba")
            picture.pts = i
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def edit_chunks(data: bytes, keep: Callable[[bytes], bool]) -> bytes:
    """Return a PNG with only the chunks whose name ``keep`` accepts."""
    parts, at = [data[:8]], 8
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        if keep(data[at + 4 : at + 8]):
            parts.append(data[at : at + 12 + length])
        at += 12 + length
    return b"".join(parts)
