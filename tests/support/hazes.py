"""Haze over a grid of lines: what a client that reads it as documented should show."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.core.shipped import shipped

SIDE, LINE, BRIGHT, DARK = 16, 3, 220, 40
"""Distance and width of the lines, px, and bytes of lines and ground."""

Picture = NDArray[np.float32]

RECIPE: dict[str, Any] = {
    "source": {"path": str(shipped("samples") / "campfire"), "fps": 24, "height": 160},
    "timeline": {"fps": 12},
    "flakes": "none",
    "maps": {"haze": True},
}


def built(folder: Path, **keys: Any) -> Path:
    """Build a small campfire with haze; return the folder of the build."""
    recipe = folder / "fire.yaml"
    recipe.write_text(json.dumps({**RECIPE, **keys}), encoding="utf-8")
    assert main(["build", str(recipe)]) == 0
    return folder / "build"


@dataclass(frozen=True)
class HazePage:
    """The haze of a build on one page, as its JSON says.

    Attributes:
        shift: (H, W, 2), px to the right and down.
        frames: Entries of the frames.
        entry: Of the map.
    """

    shift: Picture
    frames: list[dict[str, Any]]
    entry: dict[str, Any]

    @classmethod
    def read(cls, build: Path, name: str = "fire") -> "HazePage":
        atlas = json.loads((build / f"{name}.json").read_text(encoding="utf-8"))
        (entry,) = (each for each in atlas["meta"]["maps"] if each["kind"] == "haze")
        assert entry["decode"] == "(rg * 255 - 128) / 127"
        with Image.open(build / entry["image"]) as image:
            red_green = np.asarray(image.convert("RGBA"))[..., :2].astype(np.float32)
        shift = as_plane((red_green - 128) / 127 * entry["scale"])
        return cls(shift, list(atlas["frames"].values()), entry)

    def of(self, i: int) -> Picture:
        """Return the shifts of a whole frame, (H, W, 2); 0 where it was cut off."""
        place, trim, size = (
            self.frames[i][key] for key in ("frame", "spriteSourceSize", "sourceSize")
        )
        whole = np.zeros((size["h"], size["w"], 2), np.float32)
        part = self.shift[
            place["y"] : place["y"] + place["h"], place["x"] : place["x"] + place["w"]
        ]
        whole[trim["y"] : trim["y"] + trim["h"], trim["x"] : trim["x"] + trim["w"]] = part
        return whole


def _box(entry: dict[str, int]) -> tuple[slice, slice]:
    x, y, width, height = (entry[key] for key in "xywh")
    return slice(y, y + height), slice(x, x + width)


def lines(width: int, height: int) -> list[tuple[int, int, int, int]]:
    """Return the rectangles x, y, width, height of the lines of a grid, px."""
    across = [(0, y, width, LINE) for y in range(0, height, SIDE)]
    return across + [(x, 0, LINE, height) for x in range(0, width, SIDE)]


def grid(width: int, height: int) -> Picture:
    """Return the grid, (height, width) of bytes."""
    picture = np.full((height, width), DARK, np.float32)
    for x, y, w, h in lines(width, height):
        picture[y : y + h, x : x + w] = BRIGHT
    return picture


def bent(shift: Picture, zoom: int = 1) -> Picture:
    """Return the grid as it is seen through haze (H, W, 2), drawn ``zoom`` times as large."""
    large = shift
    if zoom != 1:
        resized = cv2.resize(shift, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_LINEAR)
        large = as_plane(resized * zoom)
    height, width = large.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return np.asarray(
        cv2.remap(
            grid(width, height), x + large[..., 0], y + large[..., 1], cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
    )  # fmt: skip


def seam_ratio(pictures: list[Bytes]) -> float:
    """Return the step from the last picture to the first over the median of the others."""
    moved = [
        float(np.abs(np.subtract(one, other, dtype=np.float32)).mean())
        for one, other in zip(pictures, [*pictures[1:], pictures[0]], strict=True)
    ]
    return moved[-1] / float(np.median(moved[:-1]))
