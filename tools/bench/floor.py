"""The least a build can take: frames are decoded, copied into pages and encoded, and nothing else.

Run it as a process of its own: ``python -m tools.bench.floor CLIP JOBS``.
"""

import io
import sys
from pathlib import Path

import cv2
import numpy as np

from fire_atlas.atlas.pack import pack
from fire_atlas.atlas.page_rules import PageRules
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import trimmed
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png


def build_least(clip: Path, jobs: int) -> None:
    """Read the frames of ``clip`` and write them into pages, with the writer and the workers of a
    build."""

    def sprite(path: Path) -> Sprite:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert image is not None
        return trimmed(np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2RGBA), np.uint8))

    with Workers(jobs) as workers:
        sprites = list(workers.map(sprite, sorted(clip.glob("*.png"))))
        sizes = [(s.image.shape[1], s.image.shape[0]) for s in sprites]
        packing = pack(sizes, [range(len(sizes))], PageRules(4096, padding=2))
        for number, (width, height) in enumerate(packing.pages):
            page: Bytes = np.zeros((height, width, 4), np.uint8)
            for place, s in zip(packing.places, sprites, strict=True):
                if place.page == number:
                    h, w = s.image.shape[:2]
                    page[place.y : place.y + h, place.x : place.x + w] = s.image
            write_png(io.BytesIO(), page, workers)


if __name__ == "__main__":
    build_least(Path(sys.argv[1]), int(sys.argv[2]))
