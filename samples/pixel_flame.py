"""A pixel-art camp flame: hard-edged nested layers of licking tongues, and pixels they let go.

The tongues are those of the cartoon, drawn at the size of the sprite and cleaned up the way a
pixel artist would.  Lengths are in pixels of a ``CELL`` frame, time in loops.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from cartoon import TAU, Tongue, smooth_union, tongue_distance
from painting import Field, Pixels

Mask = npt.NDArray[np.bool_]

CELL = (48, 32)  #: height, width
FRAMES = 8
BASE = 46  #: row below the lowest pixel of the flame
FOOT = 6.0  #: height of the tongues' feet above it

TONGUES = (
    Tongue(0.5, 27, 7.6, 0.5, 3.6, 0.00),
    Tongue(-7, 18, 5.4, -5.5, 2.6, 0.42),
    Tongue(7.5, 19, 5.2, 5.5, 2.6, 0.70),
)
STRETCH = 0.24  #: how far a tongue's height swings about its mean


class Layer(NamedTuple):
    """One flat colour: the flame shrunk towards its foot, a little behind the one outside it."""

    scale: float
    delay: float  #: loops
    colour: tuple[int, int, int]


LAYERS = (
    Layer(1.00, 0.00, (122, 16, 28)),
    Layer(0.87, 0.02, (196, 36, 28)),
    Layer(0.73, 0.05, (238, 92, 28)),
    Layer(0.57, 0.08, (252, 156, 36)),
    Layer(0.41, 0.11, (255, 216, 72)),
    Layer(0.25, 0.13, (255, 246, 184)),
)


class Spark(NamedTuple):
    """A cluster of pixels that leaves a tip: where it is first seen, and how it drifts."""

    frame: int  #: of its first appearance
    x: int
    y: int
    drift: tuple[int, ...]  #: columns to the right, per frame of age


#: Width, height and layer of a cluster by age in frames, and the rows it has risen.
STAGES = ((2, 3, 1, 0), (2, 2, 1, 3), (1, 2, 0, 5), (1, 1, 0, 7))

SPARKS = (
    Spark(3, 15, 8, (0, 0, 1, 1)),
    Spark(1, 6, 19, (0, 0, 0, 1)),
    Spark(5, 22, 14, (0, 0, 0, -1)),
)


def flame_distance(x: Field, y: Field, time: float) -> Field:
    """Signed distance to the tongues, ``y`` upwards from their feet."""
    total = np.full(x.shape, 1e3, np.float32)
    for tongue in TONGUES:
        swing = np.sin(TAU * (tongue.beats * time + tongue.phase))
        lick = replace(tongue, height=tongue.height * float(1 + STRETCH * swing))
        total = smooth_union(total, tongue_distance(lick, x, y, time), 2.5)
    return total


def tidied(mask: Mask) -> Mask:
    """``mask`` without specks: pixels with fewer than two neighbours go, notches fill up."""
    cross = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.uint8)
    for _ in range(3):
        around = cv2.filter2D(mask.astype(np.uint8), -1, cross, borderType=cv2.BORDER_CONSTANT)
        mask = (mask & (around >= 2)) | (around >= 3)
    return mask


def layer_mask(layer: Layer, time: float) -> Mask:
    """The pixels of ``layer``, shape ``CELL``."""
    rows, columns = np.mgrid[0 : CELL[0], 0 : CELL[1]].astype(np.float32) + np.float32(0.5)
    x = (columns - CELL[1] / 2) / np.float32(layer.scale)
    lift = 1.5 * (1 - layer.scale)
    y = (BASE - lift - rows) / np.float32(layer.scale) - np.float32(FOOT)
    return tidied(flame_distance(x, y, time - layer.delay) < 0)


def stamp_sparks(image: Pixels, number: int) -> None:
    """Draw the clusters in flight at frame ``number`` onto ``image``."""
    for spark in SPARKS:
        age = (number - spark.frame) % FRAMES
        if age < len(STAGES):
            width, height, layer, risen = STAGES[age]
            left, top = spark.x + spark.drift[age], spark.y - risen
            image[top : top + height, left : left + width] = (*LAYERS[layer].colour, 255)


def pixel_frame(number: int) -> Pixels:
    """RGBA frame ``number`` of ``FRAMES``, shape (*``CELL``, 4), opacity 0 or 255."""
    image = np.zeros((*CELL, 4), np.uint8)
    for layer in LAYERS:
        image[layer_mask(layer, number / FRAMES)] = (*layer.colour, 255)
    stamp_sparks(image, number)
    return image


def pixel_frames() -> list[Pixels]:
    """One loop of the pixel-art flame."""
    return [pixel_frame(number) for number in range(FRAMES)]
