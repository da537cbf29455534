"""Packs rectangles with the packers of PyPI, in a virtual environment that has them.

Asked on stdin: ``{"sizes": [[w, h], ...], "max", "gap", "rotate"}``. Answer, on stdout:
``{name: {"pages": [[w, h], ...], "seconds"}}``.
"""

import json
import sys
import time
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any

SHAPES = 24
"""Page widths tried with the slow search."""

Rects = Iterable[tuple[int, int, int, int]]


def extent(rects: Rects) -> list[int]:
    """Size of what is used of a page."""
    known = list(rects)
    return [max(x + w for x, _, w, _ in known), max(y + h for _, y, _, h in known)]


def rectpack(asked: dict[str, Any], width: int, algorithm: str) -> list[list[int]]:
    module = import_module("rectpack")
    gap = asked["gap"]
    packer = module.newPacker(rotation=asked["rotate"], pack_algo=getattr(module, algorithm))
    for w, h in asked["sizes"]:
        packer.add_rect(w + gap, h + gap)
    packer.add_bin(width + gap, asked["max"] + gap, count=float("inf"))
    packer.pack()
    return [extent((r.x, r.y, r.width - gap, r.height - gap) for r in page) for page in packer]


def best_of_rectpack(asked: dict[str, Any], shapes: int) -> list[list[int]]:
    area = sum((w + asked["gap"]) * (h + asked["gap"]) for w, h in asked["sizes"])
    widest = max(max(size) for size in asked["sizes"])
    widths = {asked["max"]}
    for i in range(shapes):
        widths.add(min(asked["max"], max(widest, int(area**0.5 * (0.7 + 0.8 * i / shapes)))))
    algorithms = ("MaxRectsBl", "MaxRectsBssf", "MaxRectsBaf", "SkylineBlWm")
    tried = [
        rectpack(asked, width, algorithm) for width in sorted(widths) for algorithm in algorithms
    ]
    return min(tried, key=lambda pages: (len(pages), sum(w * h for w, h in pages)))


def py_texture_packer(asked: dict[str, Any]) -> list[list[int]]:
    packer = import_module("PyTexturePacker.MaxRectsPacker.MaxRectsPacker").MaxRectsPacker(
        max_width=asked["max"], max_height=asked["max"], enable_rotated=asked["rotate"],
        border_padding=0, shape_padding=asked["gap"],
    )  # fmt: skip
    images = []
    for width, height in asked["sizes"]:
        image = import_module("PyTexturePacker.ImageRect").ImageRect()
        image.width, image.height = width, height
        images.append(image)
    return [
        extent((r.x, r.y, r.width, r.height) for r in atlas.image_rect_list)
        for atlas in packer._pack(images)
    ]


def main() -> None:
    asked = json.load(sys.stdin)
    peers: dict[str, Callable[[], list[list[int]]]] = {
        "PyTexturePacker": lambda: py_texture_packer(asked),
        "rectpack": lambda: best_of_rectpack(asked, 0),
    }
    if asked.get("slow"):
        peers[f"rectpack, {SHAPES} shapes"] = lambda: best_of_rectpack(asked, SHAPES)
    answers = {}
    for name, pack in peers.items():
        start = time.perf_counter()
        pages = pack()
        answers[name] = {"pages": pages, "seconds": time.perf_counter() - start}
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()
