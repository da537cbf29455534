"""A wooden crate, seen from the front: boards with a grain, a frame around them and a brace.

Lengths are in pixels of the ``SIZE`` picture, whose frame a recipe shares.
"""

from __future__ import annotations

import cv2
import numpy as np
from painting import Field, Pixels, layer_over, soft_step, straight

SIZE = 256  #: px of either side of the picture
LEFT, TOP, SIDE = 68, 110, 120  #: the crate: its left and upper edge, and its width and height
FRAME = 18  #: width of the boards around it
BOARDS = 5  #: boards behind them

WOOD, GAP = (132.0, 92.0, 52.0), (38.0, 24.0, 14.0)


def grain(seed: int, shape: tuple[int, int]) -> Field:
    """Noise about 0 of streaks from left to right."""
    rng = np.random.Generator(np.random.Philox(seed))
    noise = rng.normal(size=shape).astype(np.float32)
    return np.asarray(6 * cv2.GaussianBlur(noise, (0, 0), sigmaX=14, sigmaY=0.9), np.float32)


def board(seed: int, shape: tuple[int, int]) -> Field:
    """Brightness about 1 of a board, dark at its edges."""
    height, width = shape
    rows, columns = (np.arange(n, dtype=np.float32) + 0.5 for n in (height, width))
    edge = np.minimum.outer(np.minimum(rows, height - rows), np.minimum(columns, width - columns))
    shade = np.random.Generator(np.random.Philox(seed + 900)).uniform(0.82, 1.0)
    return (shade + 0.16 * grain(seed, shape)) * (0.55 + 0.45 * soft_step(0.0, 3.0, edge))


def crate() -> Pixels:
    """The picture: RGBA of shape (SIZE, SIZE, 4), transparent around the crate."""
    light = np.zeros((SIDE, SIDE), np.float32)
    step = (SIDE - 2 * FRAME) / BOARDS
    for number in range(BOARDS):
        top, bottom = (FRAME + round(step * k) for k in (number, number + 1))
        light[top:bottom] = 0.72 * board(number, (bottom - top, SIDE))
    rows, columns = np.mgrid[:SIDE, :SIDE] + 0.5
    brace = np.abs(rows + columns - SIDE) < 0.75 * FRAME
    turned = cv2.warpAffine(
        board(20, (SIDE, 2 * SIDE)), cv2.getRotationMatrix2D((SIDE, SIDE / 2), 45, 1),
        (2 * SIDE, SIDE),
    )[:, SIDE // 2 : -SIDE // 2]  # fmt: skip
    light[brace] = np.maximum(turned[brace], 0.6)
    light[:FRAME], light[-FRAME:] = board(11, (FRAME, SIDE)), board(12, (FRAME, SIDE))
    light[:, :FRAME] = board(13, (FRAME, SIDE)).T
    light[:, -FRAME:] = board(14, (FRAME, SIDE)).T
    image = np.zeros((SIZE, SIZE, 4), np.float32)
    cover = np.zeros((SIZE, SIZE), np.float32)
    inside = slice(TOP, TOP + SIDE), slice(LEFT, LEFT + SIDE)
    cover[inside] = 1
    image = layer_over(image, GAP, cover)
    cover[inside] = np.clip(light, 0, 1)
    return straight(layer_over(image, WOOD, cover))
