"""How small and how fast pages are written.

Run it from the checkout: ``python -m tools.bench.pages [runs]``, with FIRE_ATLAS_CLIPS naming a
folder of real clips. For pages of three clips, prints

- the bytes of ``compression: small`` beside oxipng's level 4 (bound: 3 % more);
- the time of ``compression: fast`` beside the least that such a file takes: rows minus those above
  them, deflated by run lengths in as many threads (bound: 1.3 ×).

Exits 1 if a bound is not kept.
"""

import io
import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib import import_module
from pathlib import Path

import cv2
import numpy as np
from zlib_ng import zlib_ng

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames
from fire_atlas.atlas.trim import trimmed
from fire_atlas.core.cpu import default_jobs
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.recipe.output import Atlas
from tools.bench.scene import argument

CLIPS = ("cartoon_wesnoth_campfire", "sim_unity_flame02", "cartoon_tauran_flame_sheet")
BAND = 64


def page_of(clip: Path) -> Bytes:
    """Return the page of a clip's own frames."""
    sprites = []
    for path in sorted((clip / "frames").iterdir()):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert image is not None
        rgba = cv2.cvtColor(
            image, cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGBA
        )
        sprites.append(trimmed(np.asarray(rgba, np.uint8)))
    settings = Atlas()
    animation = AnimationFrames("fire", tuple(sprites), 40, True, (0, 0))
    (sheet,) = build_sheets("fire", [animation], settings)
    return draw_page(sheet, 0, sprites, Edges.of(settings, 1))


def written(page: Bytes, settings: Atlas, workers: Workers) -> bytes:
    file = io.BytesIO()
    write_page(file, page, settings, workers)
    return file.getvalue()


def least(page: Bytes, pool: ThreadPoolExecutor) -> int:
    """Filter and deflate a page, and nothing else; return the bytes."""
    height, width = page.shape[:2]
    flat = page.reshape(height, 4 * width)

    def band(top: int) -> int:
        rows = flat[top : top + BAND]
        filtered = np.full((len(rows), 1 + 4 * width), 2, np.uint8)
        filtered[0, 1:] = rows[0] - flat[top - 1] if top else rows[0]
        np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
        stream = zlib_ng.compressobj(1, zlib_ng.DEFLATED, -15, 9, zlib_ng.Z_RLE)
        data = stream.compress(filtered.data) + stream.flush(zlib_ng.Z_FULL_FLUSH)
        zlib_ng.adler32(filtered.data)
        return len(data)

    return sum(pool.map(band, range(0, height, BAND)))


def best(runs: int, *works: Callable[[], object]) -> list[float]:
    """Return the least seconds of each work; they take turns, so that a busy machine is fair."""
    seconds = [float("inf")] * len(works)
    for _ in range(runs):
        for i, work in enumerate(works):
            start = time.perf_counter()
            work()
            seconds[i] = min(seconds[i], time.perf_counter() - start)
    return seconds


def main() -> int:
    runs, jobs = argument(1, 7), default_jobs()
    clips = Path(os.environ["FIRE_ATLAS_CLIPS"])
    oxipng = import_module("oxipng")
    kept = True
    print(f"{jobs} workers, best of {runs}")
    print(f"{'clip':28} {'page':>13}     fast    least ratio      small  level 4  more")
    with Workers(jobs) as workers, ThreadPoolExecutor(jobs) as pool:
        for name in CLIPS:
            page = page_of(clips / name)
            fast, small = Atlas(), Atlas(compression="small")
            ours, floor = best(
                runs,
                partial(written, page, fast, workers),
                partial(least, page, pool),
            )
            size = len(written(page, small, workers))
            level4 = len(oxipng.optimize_from_memory(written(page, fast, workers), level=4))
            kept &= size <= 1.03 * level4 and ours <= 1.3 * floor
            print(
                f"{name:28} {page.shape[1]:5} x {page.shape[0]:<5} {1000 * ours:5.1f} ms"
                f" {1000 * floor:5.1f} ms {ours / floor:5.2f} {size:10} {level4:8}"
                f" {100 * (size / level4 - 1):4.1f} %",
                flush=True,
            )
    print("kept" if kept else "not kept")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
