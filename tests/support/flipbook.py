"""A built flipbook as an engine sees it, and three engines that play it.

Each is written from its engine's formula alone, with a sampler of its own: they share the files
they read, and nothing of the tool that wrote them.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

Picture = NDArray[np.float64]
"""(h, w, 4) in 0..255, premultiplied, as on the page."""


@dataclass(frozen=True, slots=True)
class Flipbook:
    """Pages and motion pages of a grid, and which cell is which frame of the first animation."""

    pages: list[Picture]
    motion: list[Picture]
    places: list[tuple[int, int, int]]
    cell: tuple[int, int]
    box: tuple[int, int, int, int]
    reading: dict[str, Any]
    loop: bool

    def after(self, i: int) -> int:
        last = len(self.places) - 1
        return i + 1 if i < last else (0 if self.loop else last)

    def frame_part(self, cell: Picture) -> Picture:
        """Cut the frame's part out of what a cell shows."""
        x, y, width, height = self.box
        return cell[y : y + height, x : x + width]


def read_flipbook(build: Path, name: str) -> Flipbook:
    """Read ``NAME.json``, the pages it names and its siblings'."""
    first = json.loads((build / f"{name}.json").read_text(encoding="utf-8"))
    others = first["meta"].get("related_multi_packs", [])
    documents = [first, *(json.loads((build / o).read_text(encoding="utf-8")) for o in others)]
    grid = first["meta"]["fireAtlas"]["grid"]
    cell = grid["cellWidth"], grid["cellHeight"]
    named: dict[str, tuple[int, int, int]] = {}
    boxes = []
    for number, document in enumerate(documents):
        for title, frame in document["frames"].items():
            x, y = frame["frame"]["x"], frame["frame"]["y"]
            named[title] = number, x // cell[0], y // cell[1]
            boxes.append((x % cell[0], y % cell[1], frame["frame"]["w"], frame["frame"]["h"]))
    animation = sorted({a for document in documents for a in document["animations"]})[0]
    played = [f for d in documents for f in d["animations"].get(animation, [])]
    motions = [_map(document, "motion") for document in documents]
    return Flipbook(
        [_image(build / document["meta"]["image"]) for document in documents],
        [_image(build / motion["image"]) for motion in motions],
        [named[frame] for frame in sorted(played)],
        cell,
        boxes[0],
        motions[0],
        first["meta"]["fireAtlas"]["loops"][animation],
    )


def _map(document: dict[str, Any], kind: str) -> dict[str, Any]:
    entry: dict[str, Any] = next(m for m in document["meta"]["maps"] if m["kind"] == kind)
    return entry


def _image(path: Path) -> Picture:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA"), np.float64)


def plain(book: Flipbook, i: int, blend: float) -> Picture:
    """Blend two frames as they are."""
    one, other = (_cut(book, book.pages, j) for j in (i, book.after(i)))
    return one * (1 - blend) + other * blend


def _cut(book: Flipbook, images: list[Picture], i: int) -> Picture:
    page, column, row = book.places[i]
    width, height = book.cell
    return images[page][row * height : (row + 1) * height, column * width : (column + 1) * width]


Signs = tuple[int, int]


def unity(book: Flipbook, i: int, blend: float, signs: Signs = (1, 1)) -> Picture:
    """Play as Unity's VFX Graph does: textures stand on their heads, V grows upwards.

    mv = rg·2 − 1, in units of a cell's UV times the scale; rows sampled one pixel at a time.
    """
    width, height = book.cell
    scale = book.reading["scale"]
    u = np.tile((np.arange(width) + 0.5) / width, (height, 1))
    v = np.tile(((np.arange(height) + 0.5) / height)[:, None], (1, width))
    total = np.zeros((height, width, 4))
    for j, way, share in ((i, -blend, 1 - blend), (book.after(i), 1 - blend, blend)):
        texel = _cut(book, book.motion, j)[::-1] / 255
        motion = (texel[..., :2] * 2 - 1) * scale * signs
        total += share * _unity_sample(book, j, u + motion[..., 0] * way, v + motion[..., 1] * way)
    return total[::-1]


def _unity_sample(
    book: Flipbook, j: int, u: NDArray[np.float64], v: NDArray[np.float64]
) -> Picture:
    """Sample the upturned texture at (u, v) of frame j's cell: four texels and their weights."""
    page, column, row = book.places[j]
    texture = book.pages[page][::-1]
    width, height = book.cell
    rows = texture.shape[0] // height
    x = (column + u) * width - 0.5
    y = (rows - 1 - row + v) * height - 0.5 + texture.shape[0] % height
    left, low = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - left)[..., None], (y - low)[..., None]

    def texel(dx: int, dy: int) -> Picture:
        column = np.clip(left + dx, 0, texture.shape[1] - 1)
        line = np.clip(low + dy, 0, texture.shape[0] - 1)
        picked: Picture = texture[line, column]
        return picked

    below = texel(0, 0) * (1 - fx) + texel(1, 0) * fx
    above = texel(0, 1) * (1 - fx) + texel(1, 1) * fx
    sampled: Picture = below * (1 - fy) + above * fy
    return sampled


def unreal(book: Flipbook, i: int, blend: float, signs: Signs = (1, 1)) -> Picture:
    """Play as a SubUV material does: V grows downwards over the whole sheet.

    ConstantBiasScale(−0.5, 2), then times the strength; a tent over the nearest texels samples.
    """
    width, height = book.cell
    strength = np.array(book.reading["strength"]["cellUv"])
    shown = []
    for j, way in ((i, -blend), (book.after(i), 1 - blend)):
        page, column, row = book.places[j]
        texture = book.pages[page]
        sheet = np.array([texture.shape[1] / width, texture.shape[0] / height])
        bias_scale = (_cut(book, book.motion, j)[..., :2] / 255 - 0.5) * 2
        y, x = np.mgrid[:height, :width]
        uv = (np.stack([column + (x + 0.5) / width, row + (y + 0.5) / height], axis=-1)) / sheet
        uv = uv + bias_scale * signs * strength / sheet * way
        at = uv * [texture.shape[1], texture.shape[0]] - 0.5
        shown.append(tent(texture, at))
    lerped: Picture = shown[0] + (shown[1] - shown[0]) * blend
    return lerped


def tent(texture: Picture, at: NDArray[np.float64]) -> Picture:
    """Sample at (x, y) in texels: each counts by its nearness; the sheet's edge goes on beyond."""
    flat, size = texture.reshape(-1, 4), np.array(texture.shape[1::-1])
    total = np.zeros((*at.shape[:2], 4))
    for corner in np.ndindex(2, 2):
        texel = np.floor(at) + corner
        near = np.prod(1 - np.abs(at - texel), axis=-1)
        column, row = np.moveaxis(np.clip(texel, 0, size - 1).astype(np.intp), -1, 0)
        total += near[..., None] * flat[row * texture.shape[1] + column]
    return total


def godot(
    book: Flipbook, i: int, blend: float, signs: Signs = (1, 1), *, straight: bool = False
) -> Picture:
    """Play as the shader ``motion.gdshader`` does: pixels, y down, an exact zero.

    A sample is kept half a pixel inside its cell, and that of a ``straight`` page is multiplied by
    its alpha.
    """
    width, height = book.cell
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    frames = []
    for j, way in ((i, -blend), (book.after(i), 1 - blend)):
        data = _cut(book, book.motion, j)[..., :2]
        pixels = (data - 128) / 127 * book.reading["scale"] * way * signs
        x = np.clip(columns + pixels[..., 0], 0, width - 1).astype(np.float32)
        y = np.clip(rows + pixels[..., 1], 0, height - 1).astype(np.float32)
        image = np.ascontiguousarray(_cut(book, book.pages, j))
        sample = np.asarray(cv2.remap(image, x, y, cv2.INTER_LINEAR), np.float64)
        if straight:
            sample[..., :3] *= sample[..., 3:] / 255
        frames.append(sample)
    return np.asarray(frames[0] * (1 - blend) + frames[1] * blend, np.float64)


Engine = Callable[[Flipbook, int, float, Signs], Picture]

ENGINES: dict[str, Engine] = {"unity": unity, "unreal": unreal, "godot": godot}
