"""Films made and decoded by the program ffmpeg, which shares no library file with PyAV."""

import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.support.requirements import missing

Frames = NDArray[Any]
"""Frames of a film, (N, H, W, 3 or 4), uint8 or uint16, sRGB, straight alpha."""

SCALING = "flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp"
"""How ffmpeg converts between YCbCr and R'G'B', and resizes: chroma is interpolated."""

_ENCODED = {
    (3, "uint8"): "gbrp", (4, "uint8"): "gbrap", (3, "uint16"): "gbrp16le",
    (4, "uint16"): "gbrap16le",
}  # fmt: skip
_DECODED = {
    (3, "uint8"): "rgb24", (4, "uint8"): "rgba", (3, "uint16"): "rgb48le", (4, "uint16"): "rgba64le"
}  # fmt: skip
"""By channels and type, ffmpeg's names of planes, and of samples side by side. It makes these of
those without a loss, but not always those of these."""

_PLANES = [1, 2, 0, 3]
"""Which of R, G, B, A each plane holds."""


@cache
def program() -> str:
    """Return the path of ffmpeg; without it, skip the test."""
    return shutil.which("ffmpeg") or missing("needs ffmpeg (Debian: apt-get install ffmpeg)")


def run(*arguments: str | Path, stdin: bytes = b"") -> bytes:
    """Run ffmpeg, and return what it writes to its output. Files are overwritten."""
    command = [program(), "-v", "error", "-nostdin", "-y", *map(str, arguments)]
    if stdin:
        command.remove("-nostdin")
    done = subprocess.run(command, input=stdin, capture_output=True, check=False)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr.decode()}"
    return done.stdout


def encode(path: Path, frames: Frames, rate: str, filters: str, *options: str) -> None:
    """Write ``frames`` as a film; ``filters`` make of them what the encoder gets."""
    height, width, channels = frames.shape[1:]
    layout = _ENCODED[channels, frames.dtype.name]
    source = ("-f", "rawvideo", "-pix_fmt", layout, "-s", f"{width}x{height}", "-r", rate)
    made = ("-threads", "1", "-bitexact", "-strict", "experimental", "-map_metadata", "-1")
    planes = frames[..., _PLANES[:channels]].transpose(0, 3, 1, 2)
    run(*source, "-i", "-", "-vf", filters, *made, *options, path, stdin=planes.tobytes())


def decode(
    path: Path,
    filters: str,
    size: tuple[int, int],
    channels: int,
    depth: type[np.uint8] | type[np.uint16],
    *options: str,
) -> Frames:
    """Return every frame of the first video stream once, as stored: not turned.

    Args:
        path: The film.
        filters: What makes frames of width and height ``size`` of the stored ones.
        size: Width and height, px.
        channels: 3, or 4 with alpha.
        depth: Type of a sample.
        options: What ffmpeg is told about the file: a decoder, for example.
    """
    layout = _DECODED[channels, np.dtype(depth).name]
    source: list[str | Path] = ["-threads", "1", "-noautorotate", *options, "-i", path]
    made = ("-map", "0:v:0", "-vf", f"{filters},format={layout}", "-fps_mode", "passthrough")
    raw = run(*source, *made, "-f", "rawvideo", "-")
    return np.frombuffer(raw, depth).reshape(-1, size[1], size[0], channels)
