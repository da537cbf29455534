"""Look at small copies of frames: in which of them a flame is not whole or not in its place, and
why."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes, brightness, encode_unit
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.learn.features import FireMask, feature_points
from fire_atlas.generators.profile.model import FeaturePoints
from fire_atlas.vision.steps import held_steps

_MIN_AREA = 24
"""Minimum number of pixels of a flame that has an outline."""

_RIVAL = 0.35
"""Area of a second flame beside the first from which they are rivals, relative to the first."""

_MAX_SHIFT, _MIN_AREA_SHARE = 0.4, 0.35
"""A flame whose foot is further from the usual place, in heights, or whose area is smaller than a
share of the usual, is broken."""

_OUT = 0.15
"""Share of the usual area below which hardly anything burns."""

_CORE, _MIN_CORE = 0.8, 0.1
"""Pixels that are flame in this share of the frames are its core, if that is more than the second
share of its area."""

_GAP, _MIN_GAP, _MAX_GAP = 6.0, 0.1, 0.25
"""A flame is broken that leaves out of the core, and is smaller than usual by, more than this many
times what the clip's upper quartile leaves out, within limits; or that leaves out more than the
upper limit, whatever its size."""

_FLASH, _MIN_FLASH = 10.0, 0.03
"""A flame is broken in a drawing that differs from both its neighbours in more than the second
share of its area, and in more than the first times what the clip's upper quartile does."""

_MIRRORED = 0.5
"""Drawings before and after a turn are alike: they differ by less than this fraction of the steps
next to them."""

_SAME_FOOT = 0.1
"""Distance of the foot from the usual place, in heights, up to which a flame stands there."""

_OVER_BASE = 0.75
"""Share of the pixels of a flame that left its base that are flame in whole frames too, at least:
otherwise it jumped elsewhere."""

_IN_PIECES = 0.33
"""A flame broke up, rather than lost a part, if this share of what it lacks is flame beside it."""


class Break(StrEnum):
    """Why a flame is not whole, or not in its place, in a frame; as messages say it."""

    OUT = "goes out"
    SMALL = "is far smaller than usual"
    PIECES = "breaks up"
    PART_LOST = "loses a part of itself"
    CUT = "is cut off at the side of the frame"
    LIFTED = "leaves its base"
    ELSEWHERE = "jumps elsewhere"
    ASLANT = "leans out of its usual place"
    PART_ADDED = "gains a part for a moment"


@dataclass(frozen=True, slots=True)
class SeenFrame:
    """What is seen in a small copy of a frame.

    Attributes:
        mask: (H, W / 8) mask of its largest flame, 8 pixels in a byte, because all frames are kept.
        binarized_mask: (H, W / 8) mask of all that is flame, also beside the largest.
        area, binarized_area: Numbers of pixels of these masks.
        strange_area: Number of pixels as bright as flame where hardly any frame burns.
        points: Feature points of the largest flame; None if the frame shows none.
        edges: Whether the flame touches the left, right, top and bottom edge, and whether it
            touches the top edge over more than half its width.
        breadth: Share of the frame's columns in which something is flame.
        has_rival: Whether it shows a second flame beside the first.
        chroma: Difference of the largest and smallest channel, relative to the largest, that 95 %
            of the flame's pixels do not exceed.
        peak: Brightness, 0..1, that 99 % of the flame's pixels do not exceed.
    """

    mask: Bytes
    binarized_mask: Bytes
    area: int
    binarized_area: int
    strange_area: int
    points: FeaturePoints | None
    edges: tuple[bool, bool, bool, bool, bool]
    breadth: float
    has_rival: bool
    chroma: float
    peak: float

    @classmethod
    def of(cls, clip: Clip, mask: FireMask, i: int) -> "SeenFrame":
        """Look at frame ``i`` of a small clip."""
        pixels = clip.read(i)
        bright = brightness(pixels, mask.blend_space)
        binarized = mask.binarized_brightness(bright)
        flame = largest_flame(binarized)
        points, has_rival, chroma, peak = None, False, 0.0, 0.0
        area = int(np.count_nonzero(flame))
        if area >= _MIN_AREA:
            points, has_rival = feature_points(flame), _has_rival(binarized, flame)
            chroma, peak = _colourfulness(mask.isolated_flame(pixels, bright, flame))
        width = points.width if points else clip.width
        edges = (
            bool(flame[:, :1].any()), bool(flame[:, -1:].any()),
            bool(flame[:2].any()), bool(flame[-1:].any()),
            bool(np.count_nonzero(flame[0]) > 0.5 * width),
        )  # fmt: skip
        return cls(
            mask=np.packbits(flame, axis=1),
            binarized_mask=np.packbits(binarized, axis=1),
            area=area,
            binarized_area=int(np.count_nonzero(binarized)),
            strange_area=int(np.count_nonzero((bright > mask.threshold) & (binarized == 0))),
            points=points,
            edges=edges,
            breadth=float(binarized.any(axis=0).mean()),
            has_rival=has_rival,
            chroma=chroma,
            peak=peak,
        )

    @property
    def flame(self) -> NDArray[np.bool_]:
        """(H, W) mask of its largest flame; columns beyond the frame are not set."""
        return _unpacked(self.mask)

    @property
    def binarized(self) -> NDArray[np.bool_]:
        """(H, W) mask of all that is flame; columns beyond the frame are not set."""
        return _unpacked(self.binarized_mask)


def _colourfulness(pixels: NDArray[np.float32]) -> tuple[float, float]:
    """Return ``chroma`` and ``peak`` of ``SeenFrame`` for pixels (n, 4) of a flame."""
    channels = encode_unit(pixels[:, :3].T)
    most, least = channels.max(axis=0), channels.min(axis=0)
    chroma = (most - least) / np.maximum(most, 1e-3)
    return float(np.quantile(chroma, 0.95)), float(np.quantile(most, 0.99))


def _has_rival(binarized: Bytes, flame: NDArray[np.bool_]) -> bool:
    """Return whether a second flame of similar size stands beside this one."""
    rest, least = (binarized > 0) & ~flame, _RIVAL * np.count_nonzero(flame)
    if np.count_nonzero(rest) < least:
        return False
    other = largest_flame(rest.astype(np.uint8))
    if np.count_nonzero(other) < least:
        return False
    mine, its = (np.flatnonzero(mask.any(axis=0)) for mask in (flame, other))
    return bool(its[0] > mine[-1] or its[-1] < mine[0])


def presence(frames: Sequence[SeenFrame]) -> NDArray[np.float32]:
    """Return the share (H, W), 0..1, of the frames in which each pixel is flame."""
    total = np.zeros(frames[0].flame.shape, np.float32)
    for frame in frames:
        total += frame.flame
    return total / np.float32(len(frames))


def breaks(frames: Sequence[SeenFrame]) -> list[Break | None]:
    """Return why the flame is broken in each of successive frames, of which at least one shows a
    flame; None where it is whole and in its place."""
    found = _lasting_breaks(frames)
    flashes = _flashes(frames, [lasting is not None for lasting in found])
    # Where its neighbours show what it lacks, pieces are seen more surely.
    return [
        flash if flash is Break.PIECES else lasting or flash
        for lasting, flash in zip(found, flashes, strict=True)
    ]


def _lasting_breaks(frames: Sequence[SeenFrame]) -> list[Break | None]:
    """Return in which frames the flame differs from what it mostly is in the clip, and how."""
    area = np.array([frame.area for frame in frames])
    present = np.array([frame.points is not None for frame in frames])
    usual = float(np.median(area[present]))
    large = present & (area >= _MIN_AREA_SHARE * usual)
    # Those that are large enough, so that one of them at least is in the usual place.
    points = [frame.points for frame in itertools.compress(frames, large) if frame.points]
    height = float(np.median([flame.height for flame in points]))
    foot = np.array([(np.inf, np.inf) if f.points is None else f.points.bottom for f in frames])
    shift = np.abs(foot - _usual_place(points)).max(axis=1)
    whole = large & (shift <= _MAX_SHIFT * height)
    away = large & ~whole
    share = presence(list(itertools.compress(frames, whole)))
    lack, core = 1 - area / usual, share > _CORE
    if np.count_nonzero(core) >= _MIN_CORE * usual:
        gap = 1 - np.array([frame.flame[core].mean() for frame in frames])
        rest = 1 - np.array([frame.binarized[core].mean() for frame in frames])
        limit = np.clip(_GAP * np.quantile(gap, 0.75), _MIN_GAP, _MAX_GAP)
        # A flame that sways leaves out some of the core too, but is no smaller for it.
        whole &= (np.minimum(gap, lack) <= limit) & (gap <= _MAX_GAP)
    else:
        gap, rest = lack, 1 - np.array([frame.binarized_area for frame in frames]) / usual
    in_pieces = (gap > 0) & (rest <= (1 - _IN_PIECES) * gap)
    strange = np.array([frame.strange_area for frame in frames])
    gone = strange - np.median(strange) >= _MIN_AREA_SHARE * usual

    def why(i: int) -> Break:
        if gone[i]:
            return Break.ELSEWHERE
        if in_pieces[i]:
            return Break.PIECES
        if not large[i]:
            return Break.SMALL if area[i] > _OUT * usual else Break.OUT
        if away[i]:
            over = (share[frames[i].flame] > 0).mean()
            return Break.LIFTED if over >= _OVER_BASE else Break.ELSEWHERE
        if lack[i] > _MIN_GAP:
            return _lost(frames[i])
        # It is no smaller than usual, and yet leaves its place out.
        return Break.ASLANT if shift[i] <= _SAME_FOOT * height else Break.ELSEWHERE

    return [None if whole[i] else why(i) for i in range(len(frames))]


def _usual_place(points: Sequence[FeaturePoints]) -> NDArray[np.float64]:
    """Return where a flame mostly stands, (2,): its foot in the frame to which most are near."""
    at = np.array([flame.bottom for flame in points])
    apart = np.abs(at[:, None] - at).max(axis=2)
    return np.asarray(at[np.argmin(np.quantile(apart, 0.4, axis=1))])


def _lost(frame: SeenFrame) -> Break:
    """Return why a flame in its place lacks a part."""
    left, right, *_ = frame.edges
    return Break.CUT if left or right else Break.PART_LOST


def _flashes(frames: Sequence[SeenFrame], broken: Sequence[bool]) -> list[Break | None]:
    """Return which of successive frames differ from the drawing before and from the one after far
    more than is usual: there, for a moment, a part of the flame is missing or added.

    The first and the last drawing, and those next to frames that are ``broken`` anyway, have no
    other on one side, so that nothing is known of them.
    """
    lengths = [_size(a.mask ^ b.mask) for a, b in itertools.pairwise(frames)]
    begins = np.append(True, ~held_steps(np.array(lengths, np.float64), closed=False))
    drawings = list(itertools.compress(frames, begins))
    masks = [drawing.mask for drawing in drawings]
    is_broken = list(itertools.compress(broken, begins))
    flash = np.zeros(len(drawings))
    for i in range(1, len(drawings) - 1):
        flash[i] = _size((masks[i] ^ masks[i - 1]) & (masks[i] ^ masks[i + 1]))
    usual = float(np.median([frame.area for frame in frames]))
    limit = max(_MIN_FLASH * usual, _FLASH * float(np.quantile(flash, 0.75)))
    found: list[Break | None] = [None] * len(drawings)
    for i in np.flatnonzero(flash > limit).tolist():
        known = not (is_broken[i - 1] or is_broken[i + 1])
        if known and not _is_turn(masks[max(i - 2, 0) : i + 3]):
            found[i] = _flash(masks[i - 1], drawings[i], masks[i + 1])
    return [found[k] for k in (np.cumsum(begins) - 1).tolist()]


def _flash(before: Bytes, frame: SeenFrame, after: Bytes) -> Break:
    """Return what happens to a flame in a drawing that differs from both its neighbours, given as
    masks."""
    missing = before & after & ~frame.mask
    if _size(frame.mask & ~(before | after)) > _size(missing):
        return Break.PART_ADDED
    if _size(missing & frame.binarized_mask) >= _IN_PIECES * _size(missing):
        return Break.PIECES
    return _lost(frame)


def _is_turn(drawings: list[Bytes]) -> bool:
    """Return whether the clip is played in reverse from the third of five drawings on."""
    if len(drawings) < 5:
        return False
    first, second, _, fourth, fifth = drawings
    return _size(first ^ fifth) < _MIRRORED * (_size(first ^ second) + _size(fourth ^ fifth))


def _unpacked(mask: Bytes) -> NDArray[np.bool_]:
    return np.unpackbits(mask, axis=1).view(np.bool_)


def _size(mask: Bytes) -> int:
    """Return how many pixels of a mask (H, W / 8) are set."""
    return int(np.count_nonzero(np.unpackbits(mask)))
