"""Refuse clips that do not show one whole flame which burns upwards in one place, with advice.

Frames are looked at as small copies, first a few of them and then all, so that a refusal takes
seconds, whatever the size and length of the clip. The few refuse only what every one of them shows.
Advice that names a threshold or frames was tried: with it, the clip is learnt.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, kept
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import as_bytes
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.features import FireMask
from fire_atlas.generators.profile.learn.wholeness import Break, SeenFrame, breaks, presence
from fire_atlas.generators.profile.model import (
    FEW_FRAMES,
    MANY_FRAMES,
    MAX_FRAMES,
    MIN_FRAMES,
    FeaturePoints,
    Side,
    node_heights,
)
from fire_atlas.vision.sampling import evenly_spread

PROXY_SIDE = 480
"""Longest side of the copies, px."""

_SAMPLES = 12
"""Number of frames that are looked at before all others."""

_MAX_WIDTH = 2.0
"""Maximum width of the foot of one flame, relative to its height."""

_WALL = 0.9
"""Share of the frame's columns in which a wall of fire burns, at least."""

_TILTED, _FAR_TILTED = 0.12, 0.24
"""Distance from what always burns to what sometimes does, in sizes of the fire, from which its
direction counts; and where only a few frames are known."""

_MIN_CHROMA, _MIN_PEAK = 0.15, 0.85
"""What is less colourful than the first and less bright than the second is no flame."""

_MIN_DRIFT, _MAX_DRIFT = 0.7, 1.3
"""Limits on the size of a flame at the end of a clip, relative to that at its beginning."""

_AGREES = 0.2
"""Change of the size of a flame's body that goes with one of its height x width, at least; both as
logarithms."""

_BODY = 0.2, 1.0
"""Lowest and highest part of a flame, in heights, that are its body."""

_LOWER, _HIGHER = (0.7, 0.5), (1.4, 2.0)
"""Thresholds that are tried before they are advised, relative to the clip's."""

_LISTED = 4
"""Maximum number of frames that a message lists."""

_TRIED_PARTS = 8
"""Maximum number of parts of a clip that are tried before one is advised."""

_AS_IT_IS = "use the clip as it is with source.kind: frames"

_WANTED = {
    Break.OUT: ("burns in every frame", _LOWER),
    Break.SMALL: ("stays about as large", _LOWER),
    Break.PIECES: ("stays in one piece", _LOWER),
    Break.PART_LOST: ("keeps all its parts", _LOWER),
    Break.CUT: ("has room at its sides", _HIGHER),
    Break.LIFTED: ("stays on its base", _LOWER),
    Break.ELSEWHERE: ("stays in one place", ()),
    Break.ASLANT: ("sways in one place", ()),
    Break.PART_ADDED: ("changes evenly", _HIGHER),
}
"""What a flame has to do instead, and thresholds, relative to the clip's, with which it may."""


@dataclass(frozen=True, slots=True)
class _Fault:
    """Why nothing can be learnt from a clip.

    Attributes:
        what: What is wrong.
        advice: What to do about it, whether or not anything that is tried helps.
        factors: Thresholds, relative to that of the clip, with which it may be right.
        broken: (frames,) whether that is wrong in a frame; None if all frames are alike.
        is_wall: Whether the fire is as wide as the frame.
    """

    what: str
    advice: str
    factors: tuple[float, ...] = ()
    broken: NDArray[np.bool_] | None = None
    is_wall: bool = False


@dataclass(frozen=True, slots=True)
class _Verdict:
    """What is found of a clip, as small copies of its frames show it.

    Attributes:
        threshold: Brightness (0..255) above which a pixel is flame.
        frames: What is seen in its frames; of a clip with a gross fault, in a few of them.
        fault: Why nothing can be learnt from it, or None.
    """

    threshold: float
    frames: list[SeenFrame]
    fault: _Fault | None


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
    refuse_length(name, proxy.count)
    # In bytes more of them are kept, and advice is soon tried.
    copies = kept(replace(proxy, picture=lambda i: as_bytes(proxy.picture(i))))
    verdict = _judged(copies, threshold, workers)
    if verdict.fault is not None:
        raise SourceError(f"{name}: {_with_advice(copies, threshold, verdict, workers)}")
    return verdict.threshold, float(np.mean([frame.edges[2] for frame in verdict.frames]))


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


def size_advice(side: Side) -> str | None:
    """Return advice on a clip, of which ``side`` was learnt, whose flame is much larger or smaller
    at its end than at its beginning."""
    heights = np.array([points.height for points in side.learnt_points])
    rows = (node_heights() >= _BODY[0]) & (node_heights() <= _BODY[1])
    drift = _drift(side.learnt_points, heights * side.pose.width_ratio[:, rows].mean(axis=1))
    if _is_steady(drift):
        return None
    what = "grows: a flash, not a fire" if drift > 1 else "shrinks: a fire that dies"
    return (
        f"{what}: its height x width in the last third of the frames is {drift:.2f} times that in "
        f"the first, and new fire jumps between these sizes; choose a part in which it stays as "
        f"large with --set start=N and --set count=N, or {_AS_IT_IS}"
    )


def _drift(points: Sequence[FeaturePoints], bodies: NDArray[np.floating]) -> float:
    """Return the mean height x width of the last third of the frames, relative to the first.

    A wick that joins the flame or leaves it changes the width of its foot, but not its body: 1 is
    returned if that, of the sizes (frames,) ``bodies``, does not go the same way.
    """
    feet = np.array([flame.height * max(flame.width, 1.0) for flame in points])
    third = max(1, len(feet) // 3)
    drift, of_bodies = (float(s[-third:].mean() / s[:third].mean()) for s in (feet, bodies))
    agrees = math.log(of_bodies) * math.copysign(1, drift - 1) >= _AGREES * abs(math.log(drift))
    return drift if agrees else 1.0


def _is_steady(drift: float) -> bool:
    return _MIN_DRIFT <= drift <= _MAX_DRIFT


def refuse_length(name: str, count: int) -> None:
    """Refuse to learn from a clip of too few or too many frames.

    Raises:
        SourceError: It has ``count``.
    """
    best = f"{FEW_FRAMES} to {MANY_FRAMES}"
    if count < MIN_FRAMES:
        sheet = "; if it is a sheet of frames, set source.grid: {columns: N, rows: N}"
        raise SourceError(
            f"{name}: has {count} frame{'s' * (count > 1)}; a profile is learnt from at "
            f"least {MIN_FRAMES}, best from {best}{sheet * (count == 1)}"
        )
    if count > MAX_FRAMES:
        raise SourceError(
            f"{name}: has {count} frames; a profile is learnt from at most {MAX_FRAMES}, and "
            f"{best} are enough: choose some with source.start and source.count"
        )


def _judged(proxy: Clip, threshold: float | None, workers: Workers) -> _Verdict:
    """Judge a clip by a few frames, and unless these all have a fault by all of them."""
    mask = FireMask.of(proxy, threshold)

    def look_at(numbers: Sequence[int]) -> dict[int, SeenFrame]:
        frames = workers.map(lambda i: SeenFrame.of(proxy, mask, i), numbers)
        return dict(zip(numbers, frames, strict=True))

    seen = dict[int, SeenFrame]()
    if proxy.count > _SAMPLES:
        seen = look_at(evenly_spread(0, proxy.count - 1, _SAMPLES))
        few = list(seen.values())
        if fault := _fault(mask, few, are_all=False):
            return _Verdict(mask.threshold, few, fault)
    seen |= look_at([i for i in range(proxy.count) if i not in seen])
    frames = [seen[i] for i in range(proxy.count)]
    return _Verdict(mask.threshold, frames, _fault(mask, frames, are_all=True))


def _fault(mask: FireMask, frames: Sequence[SeenFrame], are_all: bool) -> _Fault | None:
    """Return what is wrong with a clip, as all its frames show it, or a few: of these only what
    every one shows, or what is far off."""
    if gross := _dark(mask, frames, are_all) or _several(frames, are_all) or _cut(frames, are_all):
        return gross
    seen = [frame for frame in frames if frame.points is not None]
    if not are_all:
        return _tilted(seen, _FAR_TILTED)
    found = breaks(frames)
    whole = [frame for frame, why in zip(frames, found, strict=True) if why is None]
    # Frames in which a flame is elsewhere do not tell where it burns to.
    upright = whole if len(whole) > 0.5 * len(frames) else seen
    return _tilted(upright, _TILTED) or _wide(seen) or _grey(seen) or _broken(found)


def _exceeds(bad: NDArray[np.bool_], limit: float, are_all: bool) -> bool:
    """Return whether too many frames are ``bad``: more than a share of all, or each of a few."""
    return bool(bad.mean() > limit) if are_all else bool(bad.all())


def _where(bad: NDArray[np.bool_], are_all: bool = True) -> str:
    """Return in which frames, or in how many, something is wrong."""
    if not are_all:
        return "in nearly all frames"
    numbers = np.flatnonzero(bad).tolist()
    if len(numbers) > _LISTED:
        return f"in {len(numbers)} of {len(bad)} frames"
    return f"in frame{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"


def _dark(mask: FireMask, frames: Sequence[SeenFrame], are_all: bool) -> _Fault | None:
    dark = np.array([frame.points is None for frame in frames])
    if not _exceeds(dark, 0.5, are_all):
        return None
    if not mask.fire.any():
        return _Fault(
            "no fire found, for nothing in it moves and is bright",
            "choose a clip in which the fire flickers, so that its frames differ",
        )
    return _Fault(
        f"no fire found {_where(dark, are_all)}, for too little in them is brighter than "
        f"{mask.threshold:.0f} of 255",
        "choose a clip in which the fire is brighter than what is around it",
        _LOWER,
        dark if are_all else None,
    )


def _several(frames: Sequence[SeenFrame], are_all: bool) -> _Fault | None:
    rivals = np.array([frame.has_rival for frame in frames])
    if not _exceeds(rivals, 0.6, are_all):
        return None
    return _wall(frames) or _Fault(
        f"shows several flames side by side {_where(rivals, are_all)}; a profile is of one flame",
        f"crop the clip to one, or {_AS_IT_IS}",
        _LOWER,
        rivals if are_all else None,
    )


def _wall(frames: Sequence[SeenFrame]) -> _Fault | None:
    """Return that the fire is a wall, of frames in which it is not one whole flame, if it is."""
    if float(np.median([frame.breadth for frame in frames])) < _WALL:
        return None
    return _Fault(
        "this is a wall of fire, as wide as the frame; a profile is of one flame",
        f"crop a tongue, above where it joins the others, or {_AS_IT_IS}",
        _HIGHER,
        is_wall=True,
    )


def _cut(frames: Sequence[SeenFrame], are_all: bool) -> _Fault | None:
    left, right, top, bottom, wide = np.array([frame.edges for frame in frames]).T
    advice = f"film it with room on all sides, or {_AS_IT_IS}"
    if all(_exceeds(edge, 0.5, are_all) for edge in (left, right, top, bottom)):
        return _Fault("the fire touches every edge, so it has no outline", advice, _HIGHER)
    for edge, which in ((left, "left"), (right, "right")):
        if _exceeds(edge, 0.5, are_all):
            return _wall(frames) or _Fault(
                f"the fire is cut off at the {which} edge {_where(edge, are_all)}",
                advice,
                _HIGHER,
                edge if are_all else None,
            )
    # That a few tips are all cut off does not say that nine tenths of all are.
    if _exceeds(wide, 0.5, are_all) or (are_all and top.mean() > 0.9):
        return _Fault(
            f"the tip of the flame is cut off {_where(top, are_all)}",
            advice,
            _HIGHER,
            top if are_all else None,
        )
    return None


def _tilted(frames: Sequence[SeenFrame], least: float) -> _Fault | None:
    """Return that fire does not burn upwards, which is the direction from the pixels that are
    always flame to those that sometimes are, if these are ``least`` sizes of the fire apart."""
    present = presence(frames)
    # What a single frame shows, of a few, says where that frame is broken.
    seldom = max(0.05, 1.5 / len(frames))
    always, sometimes = present > 0.8, (present > seldom) & (present < 0.5)
    if not always.any() or not sometimes.any():
        return None
    (y0, x0), (y1, x1) = (np.argwhere(mask).mean(axis=0) for mask in (always, sometimes))
    rows, columns = np.argwhere(present > 0.05).T
    size = float(np.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1))
    right, up = (x1 - x0) / size, (y0 - y1) / size
    if max(abs(right), -up) < least or up > abs(right):
        return None
    where = "downwards" if -up > abs(right) else "to the right" if right > 0 else "to the left"
    return _Fault(
        f"the fire burns {where}; a profile is of fire that burns upwards",
        "turn the clip so that its base is at the bottom",
    )


def _wide(frames: Sequence[SeenFrame]) -> _Fault | None:
    ratio = float(np.median([flame.width / max(flame.height, 1.0) for flame in _points(frames)]))
    if ratio <= _MAX_WIDTH:
        return None
    return _wall(frames) or _Fault(
        f"the fire is {ratio:.1f} times as wide as it is high: a row or a ring of flames; a "
        f"profile is of one flame",
        f"crop the clip to one, or {_AS_IT_IS}",
    )


def _grey(frames: Sequence[SeenFrame]) -> _Fault | None:
    chroma, peak = np.median([(frame.chroma, frame.peak) for frame in frames], axis=0)
    if chroma >= _MIN_CHROMA or peak >= _MIN_PEAK:
        return None
    return _Fault(
        f"shows something grey that does not glow (at most {255 * peak:.0f} of 255): smoke or "
        f"steam; a profile is of a flame",
        f"choose a clip of one, or {_AS_IT_IS}",
    )


def _broken(found: Sequence[Break | None]) -> _Fault | None:
    """Return in which frames a flame goes out, breaks up, leaves its base, or gives way to another
    picture: fire that is generated from it would do so now and then."""
    kinds = [kind for kind, _ in Counter(filter(None, found)).most_common()]
    if not kinds:
        return None
    told = [f"{kind} {_where(np.array([cause is kind for cause in found]))}" for kind in kinds]
    wanted = [_WANTED[kind][0] for kind in kinds]
    return _Fault(
        f"the flame {_listed(told)}; a profile is of a flame that {_listed(wanted)}",
        f"film it with room on all sides, or {_AS_IT_IS}" if Break.CUT in kinds else _AS_IT_IS,
        tuple(dict.fromkeys(factor for kind in kinds for factor in _WANTED[kind][1])),
        np.array([cause is not None for cause in found]),
    )


def _listed(parts: Sequence[str]) -> str:
    """Return ``a, b and c``."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def _with_advice(proxy: Clip, threshold: float | None, verdict: _Verdict, workers: Workers) -> str:
    """Return what is wrong with a clip, and what to do: first that with which it was learnt."""
    fault = verdict.fault
    assert fault is not None, "advice is for what is wrong"
    advice: list[str] = []
    factors = fault.factors
    if threshold is not None:
        usual = _judged(proxy, None, workers)
        if _is_learnt(usual):
            advice.append(f"leave source.threshold out, so that {usual.threshold:.0f} is chosen")
            factors = ()
        elif usual.fault is not None and usual.fault.is_wall:
            # Some thresholds leave only bits of it.
            fault, factors = usual.fault, ()
    remark = ""
    if fault.broken is not None and (part := _whole_part(proxy, threshold, fault.broken, workers)):
        first, frames = part
        if _is_steady(drift := _seen_drift(frames)):
            advice.append(f"{_choosing(first, len(frames))}, which show it whole")
        else:
            remark = (
                f"; frames {first} to {first + len(frames) - 1} show it whole, but it "
                f"{'grows' if drift > 1 else 'shrinks'} in them ({drift:.2f} times the size)"
            )
    for tried in (round(verdict.threshold * factor) for factor in factors):
        if 0 < tried < 255 and _is_learnt(_judged(proxy, float(tried), workers)):
            advice.append(f"set source.threshold to {tried} instead of {verdict.threshold:.0f}")
            break
    return f"{fault.what}: {', or '.join([*advice, fault.advice])}{remark}"


def _is_learnt(verdict: _Verdict) -> bool:
    """Return whether a clip is learnt, and as a fire that burns on."""
    return verdict.fault is None and _is_steady(_seen_drift(verdict.frames))


def _seen_drift(frames: Sequence[SeenFrame]) -> float:
    """Return ``_drift`` of frames that all show a flame."""
    return _drift(_points(frames), np.array([frame.area for frame in frames]))


def _points(frames: Sequence[SeenFrame]) -> list[FeaturePoints]:
    return [frame.points for frame in frames if frame.points is not None]


def _choosing(first: int, count: int) -> str:
    """Return how to choose ``count`` frames from ``first`` on, of those that are used now."""
    start = f"source.start {first} higher and " if first else ""
    return f"set {start}source.count to {count} for frames {first} to {first + count - 1}"


def _whole_part(
    proxy: Clip, threshold: float | None, broken: NDArray[np.bool_], workers: Workers
) -> tuple[int, list[SeenFrame]] | None:
    """Return the first frame of a part of the clip, without ``broken`` frames, that can be learnt
    from, and what is seen in its frames; None if there is none."""
    runs = _runs(~broken)
    for _ in range(_TRIED_PARTS):
        first, count = max(runs, key=lambda run: run[1], default=(0, 0))
        if count < MIN_FRAMES:
            return None
        verdict = _judged(_part(proxy, first, count), threshold, workers)
        if verdict.fault is None:
            return first, verdict.frames
        runs.remove((first, count))
        if verdict.fault.broken is not None:
            runs += [(first + start, length) for start, length in _runs(~verdict.fault.broken)]
    return None


def _part(clip: Clip, start: int, count: int) -> Clip:
    return replace(clip, count=count, picture=lambda i: clip.picture(start + i))


def _runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and the number of each run of items that are set."""
    changes = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(stop - first)) for first, stop in changes.reshape(-1, 2)]
