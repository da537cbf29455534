"""Measure the flight of flakes as footage of embers was measured: life, flicker, motion, births."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import expose, linear_to_srgb
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks, by_column
from tests.support.filmed.close_ups import HEIGHT, SEEN, CloseUps

Values = NDArray[np.float64]
Index = NDArray[np.intp]

_MOST_ROWS = 12_000
"""Flakes that are drawn and measured, at most: whole flights, evenly spread over all."""

_TRACKED, _FLICKERS, _HAS_THIRDS, _BORN = 6, 12, 9, 4
"""Frames in which a flake is seen without a break, from which its motion, its flicker and the
thirds of its life are measured, and from which it counts as born."""

_FEW = 5
"""Number of flakes, or of births, below which nothing is said of them."""

_GROUP_DISTANCE, _GROUP_FRAMES, _GROUP = 0.05, 2, 4
"""Births this close, heights and frames, are a group, if they are so many."""

_MOST_BIRTHS = 1500
"""Births that are compared with each other, at most."""

_SPEEDS = {"length, slow": (0.3, 0.6), "length, fast": (0.6, 1.2)}
"""Ranges of speed, heights/s, for which the length of flakes is stated."""


@dataclass(frozen=True, slots=True)
class Sightings:
    """Flakes that can be seen, flight by flight, in the order of their frames.

    Attributes:
        rows: (sightings, columns), as in ``Tracks.frames``.
        measured: Measures of each.
        starts: Where each run begins: sightings of one flake in successive frames.
        fps: Frames per second.
        height: Height of the frames, px.
    """

    rows: Values
    measured: CloseUps
    starts: Index
    fps: float
    height: int

    @classmethod
    def of(cls, tracks: Tracks) -> Self:
        """Draw and measure the flakes of ``tracks``, or of a part of its flights."""
        rows, flight, since = _in_order(tracks)
        numbers = np.unique(flight)
        part = numbers[:: max(1, -(-len(rows) // _MOST_ROWS))]
        kept = np.isin(flight, part) & _is_inside(rows, tracks)
        rows, flight, since = rows[kept], flight[kept], since[kept]
        measured = CloseUps.of(rows, tracks.height)
        seen = measured.seen()
        rows, flight, since = rows[seen], flight[seen], since[seen]
        goes_on = (np.diff(flight) == 0) & (np.diff(since) == 1)
        starts = np.flatnonzero(np.concatenate([[True], ~goes_on])) if len(rows) else np.zeros(0)
        return cls(rows, measured.where(seen), starts.astype(np.intp), tracks.fps, tracks.height)

    def runs(self, least: int) -> Iterator[Index]:
        """Yield the indices (runs, frames) of all runs of each length, from ``least`` on."""
        lengths = np.diff(np.append(self.starts, len(self.rows)))
        for length in np.unique(lengths[lengths >= least]):
            yield self.starts[lengths == length][:, None] + np.arange(length)


def _in_order(tracks: Tracks) -> tuple[Values, Index, Index]:
    """Return all rows by flight and frame, their flights, and their frames since these began."""
    flight, since = np.concatenate(tracks.flights), np.concatenate(tracks.flight_frames)
    order = np.lexsort((since, flight))
    return np.concatenate(tracks.frames)[order], flight[order], since[order]


def _is_inside(rows: Values, tracks: Tracks) -> NDArray[np.bool_]:
    """Return which flakes are whole in the frame."""
    column = by_column(rows)
    reach = column["size"] * column["stretch"] / 2
    return np.asarray(
        (np.minimum(column["x"], tracks.width - column["x"]) > reach)
        & (np.minimum(column["y"], tracks.height - column["y"]) > reach)
    )


def flight_figures(seen: Sightings) -> dict[str, float]:
    """Return the figures of life, flicker and motion by their names in ``filmed.ROWS``."""
    moving = [_motion(seen, run) for run in seen.runs(_TRACKED)]
    figures = _life(seen) | _flicker(seen)
    if sum(len(each["speed"]) for each in moving) < _FEW:
        return figures
    of_run = {name: np.concatenate([each[name] for each in moving]) for name in moving[0]}
    # What hardly moves, less than .35 px a frame, has no direction.
    moves = of_run["speed"] * HEIGHT / seen.fps >= 0.35
    of_run = {name: values[moves] for name, values in of_run.items()}
    if moves.sum() < _FEW:
        return figures
    return figures | _motion_figures(of_run, seen.fps)


def _motion(seen: Sightings, run: Index) -> dict[str, Values]:
    """Return what is measured of the motion of runs (runs, frames) of one length, (runs,) each."""
    at = [seen.rows[:, COLUMNS.index(axis)][run] / seen.height for axis in "xy"]
    smooth = [0.25 * axis[:, :-2] + 0.5 * axis[:, 1:-1] + 0.25 * axis[:, 2:] for axis in at]
    vx, vy = (np.diff(axis, axis=1) * seen.fps for axis in smooth)
    speed, direction = np.hypot(vx, vy), np.arctan2(vy, vx)
    turn = (np.diff(direction, axis=1) + np.pi) % (2 * np.pi) - np.pi
    slow = np.minimum(speed[:, 1:], speed[:, :-1]) * HEIGHT / seen.fps <= 1.0
    turn[slow] = np.nan
    turn[(~slow).sum(axis=1) < 3] = np.nan
    sign = np.sign(turn)
    change = np.where(np.isnan(sign[:, 1:] + sign[:, :-1]), np.nan, sign[:, 1:] != sign[:, :-1])
    acceleration = np.hypot(np.diff(vx, axis=1), np.diff(vy, axis=1)) * seen.fps
    path = np.hypot(*(np.diff(axis, axis=1) for axis in at)).sum(axis=1)
    chord = np.hypot(*(axis[:, -1] - axis[:, 0] for axis in at))
    middle = np.median(speed, axis=1)
    length, width = seen.measured.length[run], seen.measured.width[run]
    return {
        "speed": middle,
        "direction": np.degrees(np.arctan2(-np.median(vy, axis=1), np.median(vx, axis=1))),
        "turn": _median(np.abs(turn)) * seen.fps,
        "change": _mean(change),
        "acceleration": np.median(acceleration, axis=1),
        "path": path / np.maximum(chord, 1 / HEIGHT),
        "length": np.median(length / width, axis=1),
        "travel": np.median(length, axis=1) / np.maximum(middle * HEIGHT / seen.fps, 1e-9),
        "frames": np.full(len(run), run.shape[1], np.float64),
    }


def _median(values: Values) -> Values:
    """Return the median of each row without NaN, (rows,); NaN if it has only these."""
    has = ~np.isnan(values).all(axis=1)
    found = np.full(len(values), np.nan)
    found[has] = np.nanmedian(values[has], axis=1)
    return found


def _mean(values: Values) -> Values:
    """Return the mean of each row without NaN, (rows,); NaN if it has only these."""
    known = ~np.isnan(values)
    total = np.where(known, values, 0.0).sum(axis=1)
    return np.where(known.any(axis=1), total / np.maximum(known.sum(axis=1), 1), np.nan)


def _motion_figures(of_run: dict[str, Values], fps: float) -> dict[str, float]:
    speed, direction = of_run["speed"], of_run["direction"]
    sideways = (np.abs(direction) <= 30) | (np.abs(direction) >= 150)
    figures = {
        "speed": float(np.median(speed)),
        "speed spread": float(np.log(speed).std()),
        "up": float((~sideways & (direction > 0)).mean()),
        "sideways": float(sideways.mean()),
        "down": float((~sideways & (direction < 0)).mean()),
        "acceleration": float(np.median(of_run["acceleration"])),
        "path": float(np.median(of_run["path"])),
    }
    for name, key in (("turn", "turn"), ("sign changes", "change")):
        known = of_run[key][~np.isnan(of_run[key])]
        if len(known) >= _FEW:
            figures[name] = float(np.median(known))
    for name, (low, high) in _SPEEDS.items():
        some = of_run["length"][(speed >= low) & (speed < high)]
        if len(some) >= _FEW:
            figures[name] = float(np.median(some))
    fast = of_run["travel"][speed * HEIGHT / fps > 6]
    if len(fast) >= _FEW:
        figures["travel"] = float(np.median(fast))
    return figures


def _life(seen: Sightings) -> dict[str, float]:
    """Return for how long flakes are seen, and their light in the thirds of that time."""
    lengths = np.diff(np.append(seen.starts, len(seen.rows)))
    lives = lengths[lengths >= _TRACKED] / seen.fps
    if len(lives) < _FEW:
        return {}
    thirds = []
    for run in seen.runs(_HAS_THIRDS):
        third, light = run.shape[1] // 3, seen.measured.light[run]
        parts = (light[:, :third], light[:, third:-third], light[:, -third:])
        means = np.stack([part.mean(axis=1) for part in parts], axis=1)
        thirds.append(means / means.max(axis=1, keepdims=True))
    figures = {
        "life": float(np.median(lives)),
        "life p90": float(np.percentile(lives, 90)),
    }
    if sum(map(len, thirds)) >= _FEW:
        first, second, last = np.median(np.concatenate(thirds), axis=0).tolist()
        figures |= {"first third": first, "second third": second, "last third": last}
    return figures


def _flicker(seen: Sightings) -> dict[str, float]:
    """Return how the logarithm of light varies about a parabola over a flake's life."""
    found: list[Values] = []
    for run in seen.runs(_FLICKERS):
        light = np.log(seen.measured.light[run])
        frame = np.arange(run.shape[1])
        smooth = np.polynomial.polynomial.polyfit(frame, light.T, 2)
        rest = light - np.polynomial.polynomial.polyval(frame, smooth)
        power = np.abs(np.fft.rfft(rest * np.hanning(run.shape[1]), axis=1))[:, 1:] ** 2
        frequency = np.fft.rfftfreq(run.shape[1], 1 / seen.fps)[1:]
        variance = np.maximum((rest**2).sum(axis=1), 1e-12)
        found.append(np.stack([
            rest.std(axis=1),
            np.abs(np.diff(light, axis=1)).mean(axis=1),
            power @ frequency / np.maximum(power.sum(axis=1), 1e-12),
            (rest[:, 1:] * rest[:, :-1]).sum(axis=1) / variance,
        ], axis=1))  # fmt: skip
    if sum(map(len, found)) < _FEW:
        return {}
    depth, step, centroid, lag = np.median(np.concatenate(found), axis=0).tolist()
    return {"flicker": depth, "flicker step": step, "flicker Hz": centroid, "flicker lag": lag}


def birth_figures(tracks: Tracks) -> dict[str, float]:
    """Return the figures of births, and of flakes in sight, by their names in ``filmed.ROWS``.

    All flights count. Those that begin as a clip that plays once does are not births.
    """
    rows, flight, _ = _in_order(tracks)
    seen = _can_be_seen(rows)
    frames = _frames_in_order(tracks)[seen]
    rows, flight = rows[seen], flight[seen]
    count = len(tracks.frames)
    if not len(rows):
        return {}
    in_sight = np.bincount(frames, minlength=count)
    figures = {"in sight": float(in_sight.var() / max(in_sight.mean(), 1e-9))}
    _, first, times = np.unique(flight, return_index=True, return_counts=True)
    begins = 0 if tracks.loop else 3
    first = first[(times >= _BORN) & (frames[first] >= begins)]
    window = max(2, round(tracks.fps / 4))
    if len(first) <= 3 * _FEW or (count - begins) // window < 4:
        return figures
    births = np.bincount(frames[first], minlength=count)[begins:]
    per_window = births[: len(births) // window * window].reshape(-1, window).sum(axis=1)
    figures["births"] = float(per_window.var() / per_window.mean())
    born = first[:_MOST_BIRTHS]
    return figures | _groups(rows, frames[born], born, tracks)


def _can_be_seen(rows: Values) -> NDArray[np.bool_]:
    """Return which flakes have a middle bright enough to stand out from black."""
    column = by_column(rows)
    light = np.maximum.reduce([column[name] for name in "rgb"]) * column["a"]
    return np.asarray(255 * linear_to_srgb(expose(light.astype(np.float32))) > SEEN)


def _frames_in_order(tracks: Tracks) -> Index:
    """Return the frame of each row, in the order of ``_in_order``."""
    flight, since = np.concatenate(tracks.flights), np.concatenate(tracks.flight_frames)
    return np.asarray(tracks.frame_numbers[np.lexsort((since, flight))], np.intp)


def _groups(rows: Values, frame: Index, born: Index, tracks: Tracks) -> dict[str, float]:
    """Return how the flakes of groups of births fly apart, from place and motion 3 frames later.

    Args:
        rows: (rows, columns), by flight and frame.
        frame: (births,), frame of each birth.
        born: (births,), row of each birth.
        tracks: Where they are from.
    """
    axes = [COLUMNS.index(axis) for axis in "xy"]
    start, later = rows[born][:, axes], rows[born + _BORN - 1][:, axes]
    velocity = (later - start) * tracks.fps / (_BORN - 1) / tracks.height
    apart = np.hypot(*(start[:, None] - start).transpose(2, 0, 1)) / tracks.height
    delay = np.abs(frame[:, None] - frame)
    near = (apart < _GROUP_DISTANCE) & (delay <= _GROUP_FRAMES)
    grouped = near.sum(axis=1) >= _GROUP
    if grouped.sum() < _GROUP:
        return {}
    near = near[grouped]
    members = near.sum(axis=1)[:, None]
    mean, centre = (near @ each / members for each in (velocity, later / tracks.height))
    relative, away = velocity - mean[:, None], later / tracks.height - centre[:, None]
    sizes = np.linalg.norm(relative, axis=2) * np.linalg.norm(away, axis=2)
    cosine = (relative * away).sum(axis=2) / np.maximum(sizes, 1e-12)
    spread = np.sqrt((near * (relative**2).sum(axis=2)).sum(axis=1) / members[:, 0])
    return {
        "radial": float((near * cosine).sum() / near.sum()),
        "burst spread": float(np.median(spread / np.maximum(np.hypot(*mean.T), 1e-9))),
    }
