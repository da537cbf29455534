"""Large footage: seconds and memory of a build beside those of only decoding its video.

Run it from the checkout: ``python -m tools.bench.footage FOLDER [VIDEO ...]``.

Without videos it writes two of fire with camera grain, 1920 x 1080 of 300 frames and 3840 x 2160 of
120, into FOLDER, where they stay for another run. For each it prints wall and processor time of
bare decoding (PyAV, no pixels converted, as many threads) and of the whole command, the peak of
resident memory, and the pages. Exits 1 if a build takes more than 3 times as long as decoding and
2 s, or more memory than its pages and 400 MB.
"""

import json
import resource
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

SIZES = {"hd": (1920, 1080, 300), "4k": (3840, 2160, 120)}
"""Width, height and frames of the videos to write."""

GRAIN = 4
"""Standard deviation of the grain, of 255."""

MEMORY = 400e6
"""Bytes that a build may take besides its pages."""

_DECODE = """
import sys, av
with av.open(sys.argv[1]) as container:
    stream = container.streams.video[0]
    stream.thread_type, stream.codec_context.thread_count = "AUTO", int(sys.argv[2])
    for frame in container.decode(stream):
        pass
"""
_MEASURED = """
import resource, runpy, sys
status = 0
try:
    runpy.run_module("fire_atlas", run_name="__main__")
except SystemExit as end:
    status = end.code or 0
unit = 1 if sys.platform == "darwin" else 1024
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
sys.exit(status)
"""


@dataclass(frozen=True, slots=True)
class Cost:
    """Seconds of a process, and what it printed."""

    wall: float
    cpu: float
    output: str


def write_fire(path: Path, width: int, height: int, count: int) -> None:
    """Write a video of rising flames on black under camera grain that is new in every frame."""
    rng, size = np.random.default_rng(1), (width // 4, height // 4)
    layers = [(_noise(rng, size, cells), speed) for cells, speed in ((6, 0.012), (20, 0.025))]
    y, x = np.mgrid[0 : 1 : size[1] * 1j, -1 : 1 : size[0] * 1j].astype(np.float32)
    shape = np.clip(1.3 * y - 1.2 * np.abs(x) * (1.2 - 0.4 * y) - 0.15, 0, 1)
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "17", "preset": "veryfast"}
        for i in range(count):
            rolled = [np.roll(n, -round(i * v * size[1]), axis=0)[: size[1]] for n, v in layers]
            heat = np.clip(2.2 * shape * sum(rolled) - 0.3, 0, 1)[..., None]
            flame = np.clip(heat * (2.2, 1.5, 1.6) - (0, 0.15, 0.8), 0, 1) * 255
            large = cv2.resize(flame.astype(np.uint8), (width, height))
            grain = rng.normal(0, GRAIN, (height // 4, width, 1)).astype(np.int16)
            shot = np.clip(large + np.tile(grain, (4, 1, 1)), 0, 255).astype(np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(shot)))
        container.mux(stream.encode(None))


def _noise(rng: np.random.Generator, size: tuple[int, int], cells: int) -> NDArray[np.float32]:
    """Return smooth noise, 0..0.5, twice as high as ``size`` (width, height)."""
    coarse = rng.random((2 * cells, cells), np.float32) / 2
    return np.asarray(cv2.resize(coarse, (size[0], 2 * size[1]), interpolation=cv2.INTER_CUBIC))


def measured(*command: str) -> Cost:
    """Run Python with these arguments, and return what it took."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, *command], check=True, stdout=subprocess.PIPE, text=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return Cost(wall, cpu, done.stdout)


def compare(video: Path, folder: Path, jobs: int) -> bool:
    """Print what decoding and building ``video`` takes; return whether it is within the bounds."""
    recipe = folder / f"{video.stem}.yaml"
    recipe.write_text(json.dumps({"source": {"path": str(video.resolve())}}), encoding="utf-8")
    idle = measured("-c", "import av")
    decoding = measured("-c", _DECODE, str(video), str(jobs))
    building = measured("-c", _MEASURED, "build", str(recipe), "--force", "-q", "--jobs", str(jobs))
    manifest = json.loads((folder / "build" / f"{video.stem}.manifest.json").read_text("utf-8"))
    pages, frame = manifest["statistics"]["pages"], manifest["statistics"]["frame_size"]
    peak = int(building.output.split()[-1])
    rest = peak - sum(4 * width * height for width, height in pages)
    decoded = decoding.wall - idle.wall
    bound = 3 * decoded + 2
    print(
        f"{video.name}: decoding {decoded:.2f} s (CPU {decoding.cpu - idle.cpu:.2f} s), build "
        f"{building.wall:.2f} s (CPU {building.cpu:.2f} s), at most {bound:.2f} s; frames {frame}, "
        f"pages {pages}, peak {peak / 1e6:.0f} MB, without pages {rest / 1e6:.0f} MB"
    )
    return building.wall <= bound and rest <= MEMORY


def main() -> int:
    folder, *given = map(Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    for name, size in {} if given else SIZES.items():
        given.append(folder / f"{name}.mp4")
        if not given[-1].exists():
            # In another process: what this one takes would count as the peak of those it starts.
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                pool.submit(write_fire, given[-1], *size).result()
    from fire_atlas.core.cpu import default_jobs

    within = [compare(video, folder, default_jobs()) for video in given]
    return 0 if all(within) else 1


if __name__ == "__main__":
    sys.exit(main())
