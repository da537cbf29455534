"""Sound files of every kind that is read, small ones, for campaigns to change."""

import contextlib
import io
import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main

SIZE = 24, 20
"""Height and width of all pictures, px."""


def flames(count: int = 3) -> list[NDArray[np.uint8]]:
    """Return frames (H, W, 4) of a small flame that flickers."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    frames = []
    for i in range(count):
        heat = np.clip(1 - np.hypot((x - 9.5) / 6, (y - 17) / (11 + 2 * np.sin(i))), 0, 1)
        rgba = np.stack([255 * heat**0.3, 255 * heat, 120 * heat**2, 255 * heat**0.5], axis=-1)
        frames.append(rgba.astype(np.uint8))
    return frames


def command(*arguments: object) -> tuple[int, str]:
    """Run ``fire-atlas`` in this process; return its exit code and all it printed."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        code = main([str(argument) for argument in arguments])
    return code, out.getvalue()


def write_images(folder: Path) -> list[Path]:
    """Write a picture or an animation in each image format; return the files."""
    frames = flames()
    pictures = [Image.fromarray(frame) for frame in frames]
    first, *rest = pictures
    for name in ("still.png", "still.webp", "still.tga", "still.tiff"):
        first.save(folder / name)
    for name in ("still.jpg", "still.bmp"):
        first.convert("RGB").save(folder / name)
    for name in ("moves.gif", "moves.png", "moves.webp"):
        first.save(folder / name, save_all=True, append_images=rest, duration=50)
    first.convert("P").save(folder / "palette.png")
    first.convert("L").save(folder / "grey.gif")
    deep = cv2.cvtColor(frames[0].astype(np.uint16) * 257, cv2.COLOR_RGBA2BGRA)
    cv2.imwrite(str(folder / "deep.png"), deep)
    cv2.imwrite(str(folder / "deep.tiff"), deep)
    cv2.imwrite(str(folder / "float.tiff"), deep[..., :3].astype(np.float32) / 65535)
    (folder / "light.exr").write_bytes(_exr(frames[0]))
    return sorted(folder.iterdir())


def write_videos(folder: Path) -> list[Path]:
    """Write a film in each container; return the files."""
    for name, codec, layout in (
        ("film.mp4", "libx264", "yuv420p"),
        ("film.webm", "libvpx-vp9", "yuva420p"),
        ("film.mov", "qtrle", "argb"),
        ("film.avi", "mjpeg", "yuvj420p"),
    ):
        with av.open(str(folder / name), "w") as container:
            stream: Any = container.add_stream(codec, rate=12)
            stream.height, stream.width = SIZE
            stream.pix_fmt = layout
            for i, frame in enumerate(flames()):
                picture = av.VideoFrame.from_ndarray(frame, format="rgba")
                picture.pts = i
                container.mux(stream.encode(picture))
            container.mux(stream.encode(None))
    return sorted(folder.iterdir())


def write_clip(folder: Path, count: int = 3) -> None:
    """Write a flame as numbered PNGs."""
    folder.mkdir()
    for i, frame in enumerate(flames(count)):
        Image.fromarray(frame).save(folder / f"{i:04}.png")


def write_build(folder: Path) -> Path:
    """Build a recipe with maps, several pages and tracks in ``folder``; return its outputs."""
    write_clip(folder / "clip", 6)
    recipe = {
        "source": {"path": "clip", "fps": 12},
        "flakes": {"rate": 60, "alpha": 0.01},
        "maps": {"motion": "godot", "flame": True},
        "atlas": {"max_size": 64},
    }
    (folder / "fire.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    _succeed("build", folder / "fire.yaml", "-q")
    return folder / "build"


def write_profile(folder: Path) -> Path:
    """Learn a profile; return its file."""
    write_clip(folder / "learnt", 12)
    _succeed("learn", folder / "learnt", "-o", folder / "fire.profile.json", "-q")
    return folder / "fire.profile.json"


def _succeed(*arguments: object) -> None:
    code, said = command(*arguments)
    assert code == 0, said


def _exr(frame: NDArray[np.uint8]) -> bytes:
    height, width = frame.shape[:2]
    light = av.VideoFrame(width, height, "gbrapf32le")
    for plane, channel in zip(light.planes, (1, 2, 0, 3), strict=True):
        padded = np.zeros((height, plane.line_size // 4), np.float32)
        padded[:, :width] = frame[..., channel] / 255
        plane.update(padded.tobytes())
    encoder: Any = av.CodecContext.create("exr", "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "gbrapf32le"
    encoder.time_base = Fraction(1, 24)
    encoder.options = {"compression": "zip16"}
    return b"".join(bytes(packet) for packet in [*encoder.encode(light), *encoder.encode(None)])
