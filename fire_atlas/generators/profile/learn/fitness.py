"""Refuse clips that do not show one whole flame which burns upwards in one place, with advice.

Frames are looked at as small copies, first a few of them and then all, so that a refusal takes
seconds, whatever the size and length of the clip.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes, linear_to_srgb
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.learn.features import FireMask, feature_points
from fire_atlas.generators.profile.model import (
    FEW_FRAMES,
    MANY_FRAMES,
    MAX_FRAMES,
    MIN_FRAMES,
    FeaturePoints,
)
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.steps import held_steps

PROXY_SIDE = 480
"""Longest side of the copies, px."""

_SAMPLES = 12
"""Number of frames that are looked at before all others."""

_MAX_WIDTH = 2.0
"""Maximum width of the foot of one flame, relative to its height."""

_MIN_CHROMA, _MIN_PEAK = 0.15, 0.85
"""What is less colourful than the first and less bright than the second is no flame."""

_MAX_SHIFT, _MIN_AREA_SHARE = 0.4, 0.35
"""A flame whose foot is further from the usual place, in heights, or whose area is smaller than a
share of the usual, is broken."""

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

_MIN_AREA = 24
"""Minimum number of pixels of a flame that has an outline."""

_LISTED = 4
"""Maximum number of frames that a message lists."""


@dataclass(frozen=True, slots=True)
class _Frame:
    """What is seen in a small copy of a frame.

    Attributes:
        mask: (H, W / 8) mask of its largest flame, 8 pixels in a byte, because all frames are kept.
        area: Number of its pixels.
        points: Its feature points; None if it shows no flame.
        edges: Whether the flame touches the left, right, top and bottom edge, and whether it
            touches the top edge over more than half its width.
        has_rival: Whether it shows a second flame beside the first.
        chroma: Difference of the largest and smallest channel, relative to the largest, that 95 %
            of the flame's pixels do not exceed.
        peak: Brightness, 0..1, that 99 % of the flame's pixels do not exceed.
    """

    mask: Bytes
    area: int
    points: FeaturePoints | None
    edges: tuple[bool, bool, bool, bool, bool]
    has_rival: bool
    chroma: float
    peak: float

    @property
    def flame(self) -> NDArray[np.bool_]:
        """(H, W) mask of its largest flame; columns beyond the frame are not set."""
        return np.unpackbits(self.mask, axis=1).view(np.bool_)


def refuse_unfit(
    proxy: Clip, name: str, threshold: float | None, workers: Workers
) -> tuple[float, float]:
    """Refuse a clip that a profile cannot be learnt from; messages call it ``name``.

    Args:
        proxy: A copy of the clip, with sides no longer than ``PROXY_SIDE``.
        name: Its name in messages.
        threshold: Brightness (0..255) above which a pixel is flame; None: chosen here.
        workers: Pool that reads the frames.

    Returns:
        The threshold, and the share of the frames whose tip leaves the frame.

    Raises:
        SourceError: The clip does not show a single, upright flame that is not cut off and burns
            in one place in every frame.
    """
    _refuse_length(name, proxy.count)
    mask = FireMask.of(proxy, threshold)
    cut_share = 0.0
    # A few frames tell soon whether all need be looked at.
    for numbers in (evenly_spread(0, proxy.count - 1, _SAMPLES), range(proxy.count)):
        frames = list(workers.map(lambda i: _seen(proxy, mask, i), numbers))
        cut_share = _refuse_frames(name, mask, frames, list(numbers))
    return mask.threshold, cut_share


def _seen(clip: Clip, mask: FireMask, i: int) -> _Frame:
    pixels = clip.read(i)
    binarized = mask.binarized(pixels)
    flame = largest_flame(binarized)
    points, has_rival, chroma, peak = None, False, 0.0, 0.0
    area = int(np.count_nonzero(flame))
    if area >= _MIN_AREA:
        points, has_rival = feature_points(flame), _has_rival(binarized, flame)
        chroma, peak = _colourfulness(mask.isolated(pixels, binarized)[flame])
    width = points.width if points else clip.width
    edges = (
        bool(flame[:, :1].any()), bool(flame[:, -1:].any()),
        bool(flame[:2].any()), bool(flame[-1:].any()),
        bool(np.count_nonzero(flame[0]) > 0.5 * width),
    )  # fmt: skip
    return _Frame(np.packbits(flame, axis=1), area, points, edges, has_rival, chroma, peak)


def _colourfulness(pixels: NDArray[np.float32]) -> tuple[float, float]:
    """Return ``chroma`` and ``peak`` of ``_Frame`` for pixels (n, 4) of a flame."""
    colours = linear_to_srgb(np.clip(pixels[:, :3], 0, 1))
    most, least = colours.max(axis=1), colours.min(axis=1)
    chroma = (most - least) / np.maximum(most, 1e-3)
    return float(np.quantile(chroma, 0.95)), float(np.quantile(most, 0.99))


def _has_rival(binarized: NDArray[np.uint8], flame: NDArray[np.bool_]) -> bool:
    """Return whether a second flame of similar size stands beside this one."""
    rest = (binarized > 0) & ~flame
    other = largest_flame(rest.astype(np.uint8))
    if np.count_nonzero(other) < 0.35 * np.count_nonzero(flame):
        return False
    mine, its = (np.flatnonzero(mask.any(axis=0)) for mask in (flame, other))
    return bool(its[0] > mine[-1] or its[-1] < mine[0])


def _refuse_frames(name: str, mask: FireMask, frames: list[_Frame], numbers: list[int]) -> float:
    """Refuse frames, of these ``numbers``, that do not show one whole flame; return the share whose
    tip is cut off."""
    seen = [frame for frame in frames if frame.points is not None]
    if len(seen) < 0.5 * len(frames):
        raise SourceError(_no_fire(name, mask, len(seen), len(frames)))
    _refuse_rivals(name, frames)
    cut_share = _refuse_cut(name, frames)
    _refuse_tilted(name, _presence(seen), len(seen))
    _refuse_wide(name, [frame.points for frame in seen if frame.points is not None])
    _refuse_grey(name, seen)
    _refuse_broken(name, frames, numbers)
    return cut_share


def _no_fire(name: str, mask: FireMask, seen: int, count: int) -> str:
    if not mask.fire.any():
        return (
            f"{name}: no fire found: nothing in it moves and is bright; choose a clip in which the "
            f"fire flickers, so that its frames differ"
        )
    return (
        f"{name}: no fire found in {count - seen} of {count} frames: too little in them is "
        f"brighter than {mask.threshold:.0f} of 255; set source.threshold lower, or choose other "
        f"frames with source.start and source.count"
    )


def length_advice(count: int) -> str | None:
    """Return advice on a clip of ``count`` frames that is shorter or longer than is best."""
    if FEW_FRAMES <= count <= MANY_FRAMES:
        return None
    best = f"{FEW_FRAMES} to {MANY_FRAMES} are best"
    if count < FEW_FRAMES:
        return f"{best}; {count} show few poses of the fire, so that what is generated repeats them"
    return (
        f"{best}; of {count}, those beyond mostly make the profile larger and slower to learn: "
        "--set start=N and --set count=N choose some"
    )


def _refuse_length(name: str, count: int) -> None:
    best = f"{FEW_FRAMES} to {MANY_FRAMES}"
    if count < MIN_FRAMES:
        raise SourceError(
            f"{name}: has {count} frame{'s' * (count > 1)}; a profile is learnt from at "
            f"least {MIN_FRAMES}, best from {best}"
        )
    if count > MAX_FRAMES:
        raise SourceError(
            f"{name}: has {count} frames; a profile is learnt from at most {MAX_FRAMES}, and "
            f"{best} are enough: choose some with source.start and source.count"
        )


def _refuse_rivals(name: str, frames: list[_Frame]) -> None:
    rivals = sum(frame.has_rival for frame in frames)
    if rivals > 0.6 * len(frames):
        raise SourceError(
            f"{name}: shows several flames side by side in {rivals} of {len(frames)} frames; "
            f"a profile is of one flame: crop the clip to one, or set source.threshold lower if "
            f"they belong together"
        )


def _refuse_cut(name: str, frames: list[_Frame]) -> float:
    """Return the share of frames whose tip is cut off; refuse flames cut off more than that."""
    left, right, top, bottom, wide = np.mean([frame.edges for frame in frames], axis=0)
    advice = "film it with room on all sides, or set source.threshold higher if this is its glow"
    if min(left, right, top, bottom) > 0.5:
        raise SourceError(f"{name}: the fire touches every edge, so it has no outline; {advice}")
    for share, edge in ((left, "left"), (right, "right")):
        if share > 0.5:
            raise SourceError(f"{name}: the fire is cut off at the {edge} edge; {advice}")
    if wide > 0.5 or top > 0.9:
        raise SourceError(
            f"{name}: the tip of the flame is cut off in {100 * max(wide, top):.0f} % of the "
            f"frames; {advice}"
        )
    return float(top)


def _refuse_tilted(name: str, present: NDArray[np.float32], count: int) -> None:
    """Refuse fire that does not burn upwards, which is the direction from the pixels that are
    always flame to those that sometimes are, in ``count`` frames."""
    # What a single frame shows, of a few, says where that frame is broken.
    seldom = max(0.05, 1.5 / count)
    always, sometimes = present > 0.8, (present > seldom) & (present < 0.5)
    if not always.any() or not sometimes.any():
        return
    (y0, x0), (y1, x1) = (np.argwhere(mask).mean(axis=0) for mask in (always, sometimes))
    rows, columns = np.argwhere(present > 0.05).T
    size = float(np.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1))
    right, up = (x1 - x0) / size, (y0 - y1) / size
    if max(abs(right), -up) < 0.12 or up > abs(right):
        return
    where = "downwards" if -up > abs(right) else "to the right" if right > 0 else "to the left"
    raise SourceError(
        f"{name}: the fire burns {where}; a profile is of fire that burns upwards: turn the clip "
        f"so that its base is at the bottom"
    )


def _refuse_wide(name: str, points: list[FeaturePoints]) -> None:
    ratio = float(np.median([each.width / max(each.height, 1.0) for each in points]))
    if ratio > _MAX_WIDTH:
        raise SourceError(
            f"{name}: the fire is {ratio:.1f} times as wide as it is high: a row or a ring of "
            f"flames; a profile is of one flame: crop the clip to one"
        )


def _refuse_grey(name: str, frames: list[_Frame]) -> None:
    chroma, peak = np.median([(frame.chroma, frame.peak) for frame in frames], axis=0)
    if chroma < _MIN_CHROMA and peak < _MIN_PEAK:
        raise SourceError(
            f"{name}: shows something grey that does not glow (at most {255 * peak:.0f} of 255): "
            f"smoke or steam; a profile is of a flame: choose a clip of one, or use the clip as it "
            f"is with source.kind: frames"
        )


def _refuse_broken(name: str, frames: list[_Frame], numbers: list[int]) -> None:
    """Refuse a flame that goes out, breaks up, leaves its base, or gives way to another picture:
    fire that is generated from it would do so now and then."""
    bad = _broken(frames)
    if numbers == list(range(numbers[0], numbers[0] + len(numbers))):
        bad |= _flashes(frames)
    broken = list(itertools.compress(numbers, bad))
    if not broken:
        return
    which = f"{len(broken)} of {len(frames)} frames"
    if len(broken) <= _LISTED:
        which = f"frame{'s' * (len(broken) > 1)} {', '.join(map(str, broken))}"
    raise SourceError(
        f"{name}: the flame goes out, breaks up, is cut off, leaves its base or jumps elsewhere in "
        f"{which}; "
        f"choose a part of the clip in which it burns whole and in one place with source.start and "
        f"source.count, or set source.threshold lower if parts of it are dim"
    )


def _presence(frames: list[_Frame]) -> NDArray[np.float32]:
    """Return the share (H, W), 0..1, of the frames in which each pixel is flame."""
    total = np.zeros(frames[0].flame.shape, np.float32)
    for frame in frames:
        total += frame.flame
    return total / np.float32(len(frames))


def _broken(frames: list[_Frame]) -> NDArray[np.bool_]:
    """Return in which frames the flame is not whole, or not in its place."""
    area = np.array([frame.area for frame in frames])
    whole = np.array([frame.points is not None for frame in frames])
    usual = float(np.median(area[whole]))
    whole &= area >= _MIN_AREA_SHARE * usual
    # Those that are large enough, so that one of them at least is in the usual place.
    points = [frame.points for frame in itertools.compress(frames, whole) if frame.points]
    height = float(np.median([each.height for each in points]))
    foot = np.array([(np.inf, np.inf) if f.points is None else f.points.bottom for f in frames])
    at = np.array([each.bottom for each in points])
    # The usual place is that of the frame to which most others are near.
    apart = np.abs(at[:, None] - at).max(axis=2)
    place = at[np.argmin(np.quantile(apart, 0.4, axis=1))]
    whole &= np.abs(foot - place).max(axis=1) <= _MAX_SHIFT * height
    core = _presence(list(itertools.compress(frames, whole))) > _CORE
    if np.count_nonzero(core) >= _MIN_CORE * usual:
        gap = 1 - np.array([frame.flame[core].mean() for frame in frames])
        limit = np.clip(_GAP * np.quantile(gap, 0.75), _MIN_GAP, _MAX_GAP)
        # A flame that sways leaves out some of the core too, but is no smaller for it.
        whole &= (np.minimum(gap, 1 - area / usual) <= limit) & (gap <= _MAX_GAP)
    return ~whole


def _flashes(frames: list[_Frame]) -> NDArray[np.bool_]:
    """Return which of successive frames differ from the drawing before and from the one after far
    more than is usual: there, for a moment, a part of the flame is missing or added.

    The first and the last drawing have no other on one side, so that nothing is known of them.
    """
    masks = [frame.mask for frame in frames]
    lengths = np.array([_size(a ^ b) for a, b in itertools.pairwise(masks)], np.float64)
    begins = np.append(True, ~held_steps(lengths, closed=False))
    drawings = list(itertools.compress(masks, begins))
    flash = np.zeros(len(drawings))
    for i in range(1, len(drawings) - 1):
        flash[i] = _size((drawings[i] ^ drawings[i - 1]) & (drawings[i] ^ drawings[i + 1]))
    usual = float(np.median([frame.area for frame in frames]))
    limit = max(_MIN_FLASH * usual, _FLASH * float(np.quantile(flash, 0.75)))
    broken = flash > limit
    for i in np.flatnonzero(broken).tolist():
        broken[i] = not _is_turn(drawings[max(i - 2, 0) : i + 3])
    return np.asarray(broken[np.cumsum(begins) - 1])


def _is_turn(drawings: list[Bytes]) -> bool:
    """Return whether the clip is played in reverse from the third of five drawings on."""
    if len(drawings) < 5:
        return False
    first, second, _, fourth, fifth = drawings
    return _size(first ^ fifth) < _MIRRORED * (_size(first ^ second) + _size(fourth ^ fifth))


def _size(mask: Bytes) -> int:
    """Return how many pixels of a mask (H, W / 8) are set."""
    return int(np.count_nonzero(np.unpackbits(mask)))
