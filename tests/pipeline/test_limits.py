"""What would take more memory or time than anybody meant is refused, and the message says how."""

import struct
import time
import zlib
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from fire_atlas.cli.arguments import parse
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.sources.png import write_chunk
from tests.support.repo import Repo


def png_of(width: int, height: int) -> bytes:
    """Return a PNG that says it is of this size, and holds no pixels."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    data = struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))
    return b"\x89PNG\r\n\x1a\n" + data


def test_a_huge_picture_is_refused_before_it_is_decoded(repo: Repo) -> None:
    (repo.folder / "huge.png").write_bytes(png_of(10_000, 10_000))
    ran = repo.run("build", repo.recipe(path="huge.png"))
    assert ran.code == 1 and "--limit-pixels 100000000" in ran.err
    allowed = repo.run("build", repo.recipe(path="huge.png"), "--limit-pixels", "100000000")
    assert "--limit-pixels" not in allowed.err and "truncated" in allowed.err


def gif(repo: Repo) -> dict[str, Any]:
    frames = [Image.new("L", (40, 30), 40 * i) for i in range(4)]
    frames[0].save(repo.folder / "a.gif", save_all=True, append_images=frames[1:])
    return {"path": "a.gif"}


def sheet(repo: Repo) -> dict[str, Any]:
    Image.new("RGBA", (40, 30)).save(repo.folder / "a.png")
    return {"path": "a.png", "grid": {"columns": 2, "rows": 1}}


def folder(repo: Repo) -> dict[str, Any]:
    repo.clip(height=80)
    return {"path": "clip"}


def texture(repo: Repo) -> dict[str, Any]:
    repo.clip(count=12, height=80)
    return {"kind": "silk", "height": 24, "width": 20, "texture": {"path": "clip"}}


def learnt(repo: Repo) -> dict[str, Any]:
    repo.clip(count=12, height=80)
    return {"kind": "profile", "path": "clip"}


@pytest.mark.parametrize("source", [gif, sheet, folder, texture, learnt])
@pytest.mark.parametrize("packs", [True, False])
def test_the_limit_holds_for_every_kind_of_source(repo: Repo, source: Any, packs: bool) -> None:
    keys = {"flakes": "none", "motion_blur": "none"} if packs else {}
    recipe = repo.recipe(source=source(repo), **keys)
    for command in ("build", "preview"):
        ran = repo.run(command, recipe, "--limit-pixels", "1000")
        assert ran.code == 1 and "say --limit-pixels" in ran.err, ran
    assert not repo.build.exists() or not list(repo.build.iterdir())


def test_learning_has_the_limit_too(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(repo.folder)
    ran = repo.run("learn", repo.clip(count=12, height=80), "--limit-pixels", "1000")
    assert ran.code == 1 and "say --limit-pixels" in ran.err
    assert not list(Path.cwd().glob("*.profile.json"))


def test_the_command_line_has_the_limit_of_the_sources() -> None:
    assert parse(["build", "fire.yaml"]).max_pixels == MAX_PIXELS


def still_gif(width: int, height: int, frames: int) -> bytes:
    """A GIF of this size whose frames after the first change one pixel each."""
    screen = struct.pack("<HHBBB", width, height, 0x80, 0, 0) + bytes(6)
    patch = struct.pack("<HHHHB", 0, 0, 1, 1, 0) + b"\x02\x02\x44\x01\0"
    control = b"\x21\xf9\x04\0\x0a\0\0\0"
    return b"GIF89a" + screen + frames * (control + b"\x2c" + patch) + b"\x3b"


def test_frames_times_pixels_are_limited_before_anything_is_decoded(repo: Repo) -> None:
    (repo.folder / "big.gif").write_bytes(still_gif(8000, 8000, 2000))
    recipe = repo.recipe(source={"path": "big.gif"})
    began = time.monotonic()
    ran = repo.run("build", recipe)
    assert ran.code == 1 and time.monotonic() - began < 5
    assert "2000 frames of 8000x8000 are 128 thousand million pixels, more than 17.2" in ran.err
    assert "or allow it: --limit-pixels 500000000" in ran.err
    assert ran.err.startswith(f"error: {recipe}:1: source.path: {repo.folder / 'big.gif'}: ")
    assert not repo.build.exists() or not list(repo.build.iterdir())


def test_a_timeline_is_limited_too(repo: Repo) -> None:
    repo.clip(count=3, height=64)
    recipe = repo.recipe(timeline={"frames": 9000}, flakes="none")
    ran = repo.run("build", recipe, "--limit-pixels", "50000")
    assert ran.code == 1 and "use fewer (timeline.frames, or a smaller source.height)" in ran.err


def test_a_png_with_more_data_than_its_size_needs_is_refused(repo: Repo) -> None:
    path = repo.clip(count=1) / "0000.png"
    data = path.read_bytes()
    at = data.index(b"IDAT") - 4
    more = write_chunk(b"IDAT", bytes(1 << 20))
    path.write_bytes(data[:at] + more + data[at:])
    ran = repo.run("build", repo.recipe(flakes="none"))
    assert ran.code == 1 and "bytes of compressed pixels, and" in ran.err
