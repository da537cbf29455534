"""Damaged files of every format: refused with a SourceError or read, never anything else."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.errors import SourceError
from tests.support import exr_files, icc_files
from tests.support import synthetic_fire as fire

Writer = Callable[[Path], Path]


def still(path: Path) -> Path:
    Image.fromarray(fire.fires(1)[0]).convert("RGB").save(path)
    return path


def animation(path: Path) -> Path:
    return fire.write_animation(path, fire.fires(3), duration=50)


def exr(path: Path) -> Path:
    path.write_bytes(fire.exr_bytes(fire.light(fire.fires(1)[0])))
    return path


def profiled(path: Path) -> Path:
    profile = icc_files.matrix_profile(icc_files.P3, icc_files.power(1.8))
    tags = Image.Exif()
    tags[0x0112] = 6
    image = Image.fromarray(fire.fires(1)[0]).convert("RGB")
    image.save(path, icc_profile=profile, exif=tags)
    return path


def layered_exr(path: Path) -> Path:
    planes = {name: (np.full((9, 7), 0.5, np.float32), 1) for name in ("a.R", "a.G", "a.B", "a.A")}
    path.write_bytes(exr_files.lines(planes, (-1, -1, 5, 7), (0, 0, 9, 9)))
    return path


def film(path: Path) -> Path:
    codec, layout = {
        ".mp4": ("libx264", "yuv420p"),
        ".webm": ("libvpx-vp9", "yuva420p"),
        ".mov": ("qtrle", "argb"),
    }[path.suffix]
    return fire.write_video(path, fire.fires(3), codec, layout)


FILES: list[tuple[str, Writer]] = [
    ("a.gif", animation), ("a.png", animation), ("a.webp", animation), ("s.png", still),
    ("s.jpg", still), ("s.webp", still), ("s.bmp", still), ("s.tga", still), ("s.tiff", still),
    ("s.exr", exr), ("l.exr", layered_exr), ("p.png", profiled), ("p.jpg", profiled),
    ("p.webp", profiled), ("p.tiff", profiled), ("v.mp4", film), ("v.webm", film), ("v.mov", film),
]  # fmt: skip


def read_or_refuse(path: Path) -> float | str:
    """The brightest light in the first frames, or the message that refuses them."""
    try:
        clip = fire.open_clip(path)
        brightest = max(float(clip.read(i).max()) for i in range(min(clip.count, 5)))
    except SourceError as error:
        return str(error)
    assert np.isfinite(brightest)
    return brightest


@pytest.mark.filterwarnings("ignore::UserWarning:PIL")
@pytest.mark.parametrize(("name", "write"), FILES, ids=[name for name, _ in FILES])
def test_damage_is_refused_or_harmless(
    name: str, write: Writer, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data = np.frombuffer(write(tmp_path / name).read_bytes(), np.uint8)
    rng = np.random.default_rng(6)
    damaged = tmp_path / f"damaged{Path(name).suffix}"
    for n in range(60):
        copy = data.copy()
        # Every other time the header, where a wrong byte does most.
        places = rng.integers(0, len(copy) if n % 2 else min(60, len(copy)), 1 + n % 4)
        copy[places] = rng.integers(0, 256, len(places))
        damaged.write_bytes(copy.tobytes())
        outcome = read_or_refuse(damaged)
        assert isinstance(outcome, float) or damaged.name in outcome
    assert capfd.readouterr().err == ""
