"""Files over the limits: pictures, animations, videos, sheets, atlases, recipes, manifests.

Each has to be refused, in a process of its own, with the right exit code and an error that names
it, within 5 s of a CPU and 500 MB of memory, and with no file built.
"""

import json
import os
import random
import signal
import struct
import subprocess
import tempfile
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from threading import Timer
from typing import Any, TypeVar

from PIL import Image

from fire_atlas.sources.png import write_chunk
from tests.campaign import corpus
from tests.campaign.forks import is_careless
from tests.campaign.rows import chosen, run_rows
from tests.support import exr_files
from tests.support.repo import command, environment

_SECONDS = 5
_LONGEST = 120
"""Seconds after which a build is killed that only waits, far more than a busy machine takes."""

_BYTES = 500_000_000

_SIDES = [(9000, 9000), (16384, 4097), (30_000, 30_000), (65_535, 65_535), (1, 20_000)]
"""Sizes of pictures, px, that are too large."""

_PNG = b"\x89PNG\r\n\x1a\n"

T = TypeVar("T")

Make = Callable[[Path, int], dict[str, Any]]
"""Writes what is too large into a folder, in one way of several by its number; returns the keys of
a recipe that reads it."""


def _head(width: int, height: int) -> bytes:
    """Return the header of a PNG in RGBA."""
    return _PNG + write_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0))


def _from(path: Path, data: bytes, **source: Any) -> dict[str, Any]:
    path.write_bytes(data)
    return {"source": {"path": path.name, **source}}


def _png(folder: Path, number: int) -> dict[str, Any]:
    return _from(folder / "a.png", _head(*_SIDES[number % len(_SIDES)]))


def _png_data(folder: Path, number: int) -> dict[str, Any]:
    """Compressed pixels far beyond what the size needs: noise, or zeros that grow to a gigabyte."""
    large = [random.Random(number).randbytes(1 << 22), _zeros()][number % 2]
    data = _head(64, 64) + write_chunk(b"IDAT", large) + write_chunk(b"IEND", b"")
    return _from(folder / "a.png", data)


def _zeros() -> bytes:
    """Return a gigabyte of zeros, compressed."""
    packer, piece = zlib.compressobj(1), bytes(1 << 20)
    return b"".join([*(packer.compress(piece) for _ in range(1 << 10)), packer.flush()])


def _header_only(folder: Path, number: int) -> dict[str, Any]:
    """Other pictures whose header states a size that is too large."""
    width, height = 30_000, 20_000
    bmp = struct.pack("<IHHIIiiHH24x", 54, 0, 0, 54, 40, width, height, 1, 24)
    tga = struct.pack("<BBB9xHHBB", 0, 0, 2, width, height, 32, 8)
    jpeg = struct.pack(">HBHHB", 17, 8, height, width, 3)
    ending, data = _nth(number, [
        ("bmp", b"BM" + bmp), ("tga", tga + bytes(64)), ("tif", _tiff(width, height)),
        ("jpg", b"\xff\xd8\xff\xc0" + jpeg + bytes(9)),
    ])  # fmt: skip
    return _from(folder / f"a.{ending}", data)


def _tiff(width: int, height: int) -> bytes:
    tags = [(256, 4, width), (257, 4, height), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 8),
            (277, 3, 1), (278, 4, height), (279, 4, width * height)]  # fmt: skip
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4)


def _gif(folder: Path, number: int) -> dict[str, Any]:
    """Too many frames, or too many pixels in all of them."""
    width, height, count = _nth(number, [(8, 8, 10_001), (8000, 8000, 2000), (60_000, 60_000, 2)])
    screen = struct.pack("<HHBBB", width, height, 0x80, 0, 0) + bytes(6)
    frame = b"\x21\xf9\x04\0\x0a\0\0\0\x2c" + struct.pack("<HHHHB", 0, 0, 1, 1, 0)
    return _from(
        folder / "a.gif", b"GIF89a" + screen + (frame + b"\x02\x02\x44\x01\0") * count + b";"
    )


def _apng(folder: Path, number: int) -> dict[str, Any]:
    side, count = _nth(number, [(8, 10_001), (8000, 2000)])
    row = zlib.compress(bytes(5))
    parts = [_head(side, side), write_chunk(b"acTL", struct.pack(">II", count, 0))]
    for i in range(count):
        control = struct.pack(">IIIIIHHBB", 2 * i, 1, 1, 0, 0, 1, 24, 0, 0)
        parts.append(write_chunk(b"fcTL", control))
        pixels = write_chunk(b"fdAT", struct.pack(">I", 2 * i + 1) + row)
        parts.append(pixels if i else write_chunk(b"IDAT", row))
    return _from(folder / "a.png", b"".join(parts) + write_chunk(b"IEND", b""))


def _webp(folder: Path, number: int) -> dict[str, Any]:
    side, count = _nth(number, [(16_000, 100), (8000, 2000), (8, 10_001)])
    still = folder / "still.webp"
    Image.new("RGBA", (1, 1)).save(still, lossless=True)
    picture = still.read_bytes()
    picture = picture[picture.index(b"VP8L") :]
    still.unlink()
    size = struct.pack("<I", side - 1)[:3] * 2
    frame = bytes(12) + struct.pack("<I", 40)[:3] + b"\0" + picture
    chunks = _riff(b"VP8X", b"\x12\0\0\0" + size) + _riff(b"ANIM", bytes(6))
    chunks += _riff(b"ANMF", frame) * count
    return _from(folder / "a.webp", b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WEBP" + chunks)


def _riff(name: bytes, data: bytes) -> bytes:
    return name + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)


def _video(folder: Path, number: int) -> dict[str, Any]:
    """Uncompressed, so that it is quickly written; the pixels of large frames are a hole."""
    side, count = _nth(number, [(2, 10_001), (16, 20_000), (9000, 2), (20_000, 1)])
    path = folder / "a.y4m"
    with path.open("wb") as file:
        file.write(f"YUV4MPEG2 W{side} H{side} F24:1 Ip A1:1 C420jpeg\n".encode())
        size = side * side * 3 // 2
        if count > 100:
            file.write((b"FRAME\n" + bytes(size)) * count)
        else:
            file.write(b"FRAME\n")
            file.truncate(size + 100)
    return {"source": {"path": path.name}}


def _exr(folder: Path, number: int) -> dict[str, Any]:
    """Too many pixels, in the picture or outside of it, or too much in the header."""
    small, large = (0, 0, 15, 15), (0, 0, 29_999, 29_999)
    colours = dict.fromkeys("RGB", 1)
    data = _nth(number, [
        exr_files.header(colours, large, large, {}),
        exr_files.header(colours, large, small, {}),
        exr_files.header(colours, small, large, {}),
        exr_files.header(colours, small, small, {"a": ("string", bytes(2 << 20))}),
        exr_files.header({f"c{i}.R": 1 for i in range(60_000)}, small, small, {}),
    ])  # fmt: skip
    return _from(folder / "a.exr", data + bytes(1 << 12))


def _atlas(folder: Path, number: int) -> dict[str, Any]:
    """JSON that is too large, too deep, or names too many frames or pixels."""
    Image.new("RGBA", (16, 16)).save(folder / "page.png")
    path = folder / "a.json"
    match number:
        case 3:
            _describe(path, 10_001, 16)
        case 4:
            _describe(path, 2000, 30_000)
        case _:
            _write_json(path, number)
    return {"source": {"path": path.name}}


def _describe(path: Path, count: int, side: int) -> None:
    """Write an atlas of so many frames, which are so large before they are trimmed."""
    place, whole = {"x": 0, "y": 0, "w": 8, "h": 8}, {"w": side, "h": side}
    frame = {
        "frame": place,
        "rotated": False,
        "trimmed": True,
        "spriteSourceSize": place,
        "sourceSize": whole,
    }
    frames = {f"fire_{i:05}.png": frame for i in range(count)}
    meta = {"image": "page.png", "size": {"w": 16, "h": 16}, "format": "RGBA8888", "scale": "1"}
    path.write_text(json.dumps({"frames": frames, "meta": meta}))


def _sheet(folder: Path, number: int) -> dict[str, Any]:
    """A sheet of too many frames, or too large."""
    side, columns, rows = _nth(number, [(256, 128, 80), (256, 1024, 11), (20_000, 2, 2)])
    grid = {"columns": columns, "rows": rows}
    if side > 256:
        return _from(folder / "a.png", _head(side, side), grid=grid)
    Image.new("RGBA", (side, side)).save(folder / "a.png")
    return {"source": {"path": "a.png", "grid": grid}}


def _folder(folder: Path, number: int) -> dict[str, Any]:
    """Links to one picture, too many; or to one that is too large."""
    frames = folder / "clip"
    frames.mkdir()
    count, data = _nth(number, [(10_001, b"one"), (3, _head(9000, 9000))])
    (folder / "one").write_bytes(data)
    for i in range(count):
        (frames / f"{i:05}.png").symlink_to("../one")
    return {"source": {"path": "clip"}}


def _timeline(folder: Path, number: int) -> dict[str, Any]:
    """Frames of too many pixels, each of them or all."""
    corpus.write_clip(folder / "clip")
    count, height = _nth(number, [(9000, 16_000), (10_000, 5000)])
    return {"source": {"path": "clip", "height": height}, "timeline": {"frames": count}}


def _profile(folder: Path, number: int) -> dict[str, Any]:
    _write_json(folder / "fire.profile.json", number)
    return {"source": {"kind": "profile", "path": "fire.profile.json"}}


def _manifest(folder: Path, number: int) -> dict[str, Any]:
    corpus.write_clip(folder / "clip")
    (folder / "build").mkdir()
    _write_json(folder / "build" / "fire.manifest.json", number)
    return {"source": {"path": "clip"}}


def _write_json(path: Path, number: int) -> None:
    """Write JSON that is too large, too deep, or has too many values."""
    with path.open("wb") as file:
        match number % 3:
            case 0:
                file.truncate(257 << 20)
            case 1:
                file.write(b"[" * 500_000)
            case _:
                file.write(b'{"frames": [')
                for _ in range(100):
                    file.write(b"0," * 1_000_000)
                file.write(b"0]}")


def _extends(folder: Path, number: int) -> dict[str, Any]:
    """A row of recipes that extend each other, too long; the last is there, or names the first."""
    count = 60
    for i in range(count):
        base = f"./base{i + 1}.yaml" if i + 1 < count else _nth(number, ["campfire", "./fire.yaml"])
        (folder / f"base{i}.yaml").write_text(f"extends: {base}\n")
    return {"extends": "./base0.yaml"}


def _recipe(folder: Path, number: int) -> dict[str, Any]:
    """A recipe that is too long, too deep, has too many values, or whose aliases grow."""
    text = _nth(number, [
        "# long\n" * 200_000,
        "a: " + "[" * 500 + "]" * 500,
        "a: " + "{a: " * 100_000 + "1" + "}" * 100_000,
        "a: [" + "0," * 30_000 + "0]",
        "a0: &a0 [1,1,1,1,1,1,1,1,1]\n"
        + "".join(f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30)),
    ])  # fmt: skip
    (folder / "base.yaml").write_text(text)
    return {"extends": "./base.yaml"}


def _nth(number: int, ways: Sequence[T]) -> T:
    return ways[number % len(ways)]


_KINDS: dict[str, tuple[Make, int]] = {
    "png": (_png, 5), "png data": (_png_data, 2),
    "picture": (_header_only, 4), "gif": (_gif, 3), "apng": (_apng, 2), "webp": (_webp, 3),
    "video": (_video, 4), "exr": (_exr, 5), "atlas": (_atlas, 5), "sheet": (_sheet, 3),
    "folder": (_folder, 2), "timeline": (_timeline, 2), "profile": (_profile, 3),
    "manifest": (_manifest, 3), "extends": (_extends, 2), "recipe": (_recipe, 5),
}  # fmt: skip
"""What makes files of each kind, and in how many ways: each is tried once in a whole campaign."""

_OF_RECIPES = {"extends", "recipe"}
"""Kinds that are refused as invalid recipes are."""


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` files drawn by chance, or all."""
    tries = {kind: ways for kind, (_, ways) in _KINDS.items()}
    return run_rows(refused, chosen(tries, count, seed), seed)


def refused(kind: str, numbers: Sequence[int], _: int) -> list[list[str]]:
    """Build from files of one kind; return what was wrong each time."""
    return [_try(kind, number) for number in numbers]


def _try(kind: str, number: int) -> list[str]:
    with tempfile.TemporaryDirectory(prefix="limits-") as name:
        folder = Path(name)
        recipe, said = folder / "fire.yaml", folder / "said"
        keys = _KINDS[kind][0](folder, number)
        recipe.write_text(json.dumps(keys))
        before = _files(folder / "build")
        with said.open("wb") as file:
            process = subprocess.Popen(
                command("build", recipe, "-q"), env=environment(), stdout=file, stderr=file
            )
            end = Timer(_LONGEST, partial(os.kill, process.pid, signal.SIGKILL))
            end.start()
            _, status, used = os.wait4(process.pid, 0)
            end.cancel()
        process.returncode = code = os.waitstatus_to_exitcode(status)
        seconds = used.ru_utime + used.ru_stime  # a busy machine says nothing about the tool
        text = said.read_text()
        faults = []
        if code != (2 if kind in _OF_RECIPES else 1):
            faults.append(f"exit code {code}")
        if seconds > _SECONDS:
            faults.append(f"took {seconds:.1f} s")
        if used.ru_maxrss * 1024 > _BYTES:
            faults.append(f"took {used.ru_maxrss / 1000:.0f} MB")
        if not (text.startswith("error: ") and str(folder) in text) or is_careless(text):
            faults.append("no error that names the file")
        if _files(folder / "build") != before:
            faults.append("files were built")
        return [f"{fault} ({text.strip()[:300]})" for fault in faults]


def _files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []
