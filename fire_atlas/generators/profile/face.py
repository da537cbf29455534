"""One side of a fire as its clip showed it, with all sway taken out: the detail that is learnt.

Every frame is straightened onto one grid. There each place is bright in some frames and dark in
others. What is kept is, for each place, its colours from the dimmest to the brightest (`shades`),
and for each frame how bright it is there compared with the others (`heat`, a normal score).
Heats can be mixed: of independent ones, each N(0, 1), Σ w·h / √Σ w² is N(0, 1) again, and looked up
among the shades it gives every place the colours it has in the clip, as often, and as sharp. Mixed
colours would be a grey cloud. (The idea is that of histogram-preserving blending, Heitz and Neyret
2018, for textures.)
"""

import itertools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import (
    Bytes,
    Pixels,
    Plane,
    as_plane,
    brightness,
    decode_bytes,
    encode_bytes,
    unpremultiply,
)
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.grid import Grid
from fire_atlas.generators.profile.measure import Measures
from fire_atlas.generators.profile.pose import Pose, along
from fire_atlas.generators.profile.segment import Fire
from fire_atlas.vision.flow import SMALLEST_SIDE, optical_flow

LEVELS = 12
"""Shades kept of a place."""

HEAT_UNIT = 40.0
"""Steps of a byte per unit of heat; 128 is the mean."""

DRIFT_UNIT = 8.0
"""Cells a second in which drifts are told, up to 127 of them."""

DRIFT_CELL = 6
"""Cells in a row, and in a column, that share one drift."""

_TIP = 0.06
"""Part of the flame's height over which it fades out below an edge that cuts its tip off."""


_UPRIGHT = 1.5
"""A fire that leans less than this, degrees, may as well lean the other way."""

_NOISE = 0.5
"""Width, in cells, of the noise of a place's order, that is smoothed away."""


@dataclass(frozen=True, slots=True)
class Face:
    """What was learnt of one side.

    Attributes:
        half: Half the foot's width, flame heights.
        pose: How the flame stands in each frame.
        heat: (frames, rows, columns) uint8: ``(value - 128) / HEAT_UNIT`` is a normal score.
        shades: (levels, rows, columns, 4) uint8 sRGB, straight, from dimmest to brightest.
        drift: (frames, r, c, 2) float32: how what is seen moves across the grid, x and y (down),
            cells a second, for squares of ``DRIFT_CELL`` cells.
        kinship: Correlation of the heat of one frame with that of the next.
        breadth: Cells across over which the heat is alike.
        is_even: Whether left and right look alike, so that frames may be mirrored.
    """

    half: float
    pose: Pose
    heat: Bytes
    shades: Bytes
    drift: NDArray[np.float32]
    kinship: float
    breadth: float
    is_even: bool

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.heat)


def learn_face(
    clip: Clip, fire: Fire, measures: Measures, pose: Pose, grid: Grid, workers: Workers
) -> Face:
    """Straighten every frame of ``clip`` onto ``grid`` and keep what differs between them."""

    def straight(i: int) -> tuple[Bytes, Plane]:
        pixels = clip.read(i)
        content = fire.content(pixels, fire.lit(pixels))
        flat = _straightened(content, i, measures, pose, grid)
        return _bytes_of(flat), brightness(flat, clip.blend_space)

    pictures, shown = zip(*workers.map(straight, range(clip.count)), strict=True)
    order = np.argsort(_with_surroundings(shown), axis=0, kind="stable")
    scores = ndtri((np.arange(clip.count) + 0.5) / clip.count)
    scores = scores / scores.std()
    heat = np.empty(order.shape, np.float32)
    np.put_along_axis(
        heat, order, np.broadcast_to(scores[:, None, None], order.shape).astype(np.float32), axis=0
    )
    for plane in heat:
        cv2.GaussianBlur(plane, (0, 0), _NOISE, plane)
    heat /= heat.std(axis=0)
    lively = np.ptp(np.stack(shown), axis=0) > 16
    return Face(
        half=measures.half / measures.height,
        pose=pose,
        heat=np.clip(np.rint(heat * HEAT_UNIT + 128), 0, 255).astype(np.uint8),
        shades=_shades(np.stack(pictures), np.argsort(np.stack(shown), axis=0, kind="stable")),
        drift=_drift(shown, clip.fps),
        kinship=_kinship(heat, lively),
        breadth=_breadth(heat, lively),
        is_even=_is_even(np.mean(shown, axis=0), measures),
    )


def _straightened(content: Pixels, i: int, measures: Measures, pose: Pose, grid: Grid) -> Pixels:
    """Return frame ``i`` on the grid, its sway taken out."""
    (x, foot), height, half = measures.base, measures.height, measures.half
    heights = grid.heights
    middle = x + along(pose.offset[i], heights) * height
    reach = along(pose.ratio[i], heights) * half
    columns = middle[:, None] + reach[:, None] * grid.across - 0.5
    rows = np.broadcast_to((foot - heights * height - 0.5)[:, None], grid.shape)
    flat = cv2.remap(
        content, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_CONSTANT, borderValue=(0, 0, 0, 0),
    )  # fmt: skip
    flat = np.clip(flat, 0, None)
    flat[..., 3] = np.minimum(flat[..., 3], 1)
    if measures.cut > 0:
        fade = smooth_step((rows + 0.5) / (_TIP * height))
        flat *= fade[..., None].astype(np.float32)
    return as_plane(flat)


def _bytes_of(pixels: Pixels) -> Bytes:
    """Straight sRGB and coverage, uint8, of pixels."""
    coded = np.empty(pixels.shape, np.uint8)
    coded[..., :3] = encode_bytes(unpremultiply(pixels))
    coded[..., 3] = np.rint(np.clip(pixels[..., 3], 0, 1) * 255)
    return coded


def light_of(coded: Bytes) -> Pixels:
    """Pixels of straight sRGB and coverage, uint8, of any number of dimensions."""
    flat = coded.reshape(-1, coded.shape[-2], 4)
    alpha = flat[..., 3:].astype(np.float32) / np.float32(255)
    colour = decode_bytes(np.ascontiguousarray(flat[..., :3])) * alpha
    return np.concatenate([colour, alpha], axis=-1).reshape(coded.shape)


def _with_surroundings(shown: "tuple[Plane, ...]") -> NDArray[np.float32]:
    """(frames, rows, columns) by what frames are ordered at a place: its brightness.

    Where several are equally dark or bright, but for noise, that is brighter whose surroundings
    are: neighbouring places then agree on an order, and mixed heat has smooth outlines.
    """
    key = np.stack(shown)
    for plane, whole in zip(shown, key, strict=True):
        for sigma, weight in ((2.0, 0.3), (6.0, 0.2)):
            whole += np.float32(weight) * cv2.GaussianBlur(plane, (0, 0), sigma)
    return key


def _shades(pictures: Bytes, order: NDArray[np.intp]) -> Bytes:
    count = len(pictures)
    levels = min(LEVELS, count)
    shades = np.empty((levels, *pictures.shape[1:]), np.uint8)
    for level, place in enumerate(np.linspace(0, count - 1, levels)):
        lower = int(place)
        part = np.float32(place - lower)
        pair = [
            light_of(np.take_along_axis(pictures, order[k][None, ..., None], axis=0)[0])
            for k in (lower, min(lower + 1, count - 1))
        ]
        shades[level] = _bytes_of(pair[0] * (1 - part) + pair[1] * part)
    return shades


def _drift(shown: "tuple[Plane, ...]", fps: float) -> NDArray[np.float32]:
    """Optical flow from each straightened frame to the next, as ``Face.drift``."""
    rows, columns = shown[0].shape
    size = -(-columns // DRIFT_CELL), -(-rows // DRIFT_CELL)
    room = max(0, SMALLEST_SIDE - columns)
    thumbs = [
        np.pad(np.clip(np.rint(plane), 0, 255).astype(np.uint8), ((0, 0), (0, room)))
        for plane in shown
    ]
    flows = [
        optical_flow(before, after, is_small=True)[:, :columns]
        for before, after in itertools.pairwise(thumbs)
    ]
    flows.append(flows[-1])
    small = [cv2.resize(flow, size, interpolation=cv2.INTER_AREA) * fps for flow in flows]
    steps = np.clip(np.rint(np.stack(small) / DRIFT_UNIT), -127, 127)
    return (steps * DRIFT_UNIT).astype(np.float32)


def kinship(face: Face) -> Plane:
    """(rows, columns) 0..1: how much of a place's heat it still has one frame later."""
    alike = np.zeros(face.heat.shape[1:], np.float32)
    for before, after in itertools.pairwise(face.heat):
        alike += (before.astype(np.float32) - 128) * (after.astype(np.float32) - 128)
    alike /= np.float32((face.count - 1) * HEAT_UNIT**2)
    return as_plane(np.clip(cv2.GaussianBlur(alike, (0, 0), 2.0), 0, 1))


def _kinship(heat: NDArray[np.float32], lively: NDArray[np.bool_]) -> float:
    if not lively.any():
        return 1.0
    alike = [(a * b)[lively].mean() for a, b in itertools.pairwise(heat)]
    return float(np.clip(np.mean(alike), 0.0, 1.0))


def _breadth(heat: NDArray[np.float32], lively: NDArray[np.bool_]) -> float:
    """Cells across at which two places have less than half their heat in common, on average."""
    for apart in range(1, heat.shape[2] // 2):
        both = lively[:, apart:] & lively[:, :-apart]
        if not both.any():
            return float(apart)
        alike = float((heat[:, :, apart:] * heat[:, :, :-apart]).mean(axis=0)[both].mean())
        if alike < 0.5:
            return float(apart)
    return float(heat.shape[2] / 2)


def _is_even(mean: NDArray[np.floating], measures: Measures) -> bool:
    flat = mean - mean.mean()
    alike = float((flat * flat[:, ::-1]).sum()) > 0.9 * float((flat * flat).sum())
    return alike and abs(float(np.median(measures.leans))) < _UPRIGHT
