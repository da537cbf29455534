"""Solve the buoyancy field of a whole clip, frame by frame, and record it for flakes to fly in."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.buoyancy import BuoyancyField, BuoyancySolver
from fire_atlas.effect.field.forcing import Forcing

_OVERLAP = 0.25
"""Seconds over which the end of a loop's field cross-fades into its beginning."""

_LEAD_IN = 0.5
"""The last frames of a loop, this many seconds, first act on still air, so that the field begins as
it ends."""


@dataclass(frozen=True, slots=True)
class FieldRecord:
    """The buoyancy field of every frame of a clip.

    Attributes:
        u, v: (frames, rows, columns) float32, px/s.
        brightness: (frames, rows, columns) uint8, of each cell; 255 is as bright as flame.
        cell: Side of a cell, px.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        heat: (frames, rows, columns) float16, 1 in the flame, 0 in cold air; None if not recorded.
        tiles: Whether the right side of the field joins its left one.
    """

    u: NDArray[np.float32]
    v: NDArray[np.float32]
    brightness: NDArray[np.uint8]
    cell: int
    fps: float
    loop: bool
    heat: NDArray[np.float16] | None = None
    tiles: bool = False

    @classmethod
    def empty(
        cls,
        frames: int,
        shape: tuple[int, int],
        cell: int,
        fps: float,
        loop: bool,
        *,
        has_heat: bool = False,
        tiles: bool = False,
    ) -> Self:
        """Return a record of zeros, to be written frame by frame."""
        u, v = (np.zeros((frames, *shape), np.float32) for _ in range(2))
        heat = np.zeros(u.shape, np.float16) if has_heat else None
        return cls(u, v, np.zeros(u.shape, np.uint8), cell, fps, loop, heat, tiles)

    def write(self, frame: int, field: BuoyancyField, brightness: Plane) -> None:
        """Record one frame; frames past the end of a loop are cross-faded into its first ones.

        The state after a loop's end is not quite the one it began with: its first frames fade from
        the former to the latter.
        """
        past_end = frame - len(self.u)
        if past_end < 0:
            self.u[frame], self.v[frame] = field.u, field.v
            self.brightness[frame] = np.rint(brightness * 255)
            if self.heat is not None:
                self.heat[frame] = field.heat
            return
        weight = np.float32(1 - past_end / _overlap_frames(self.fps))
        for plane, now in ((self.u, field.u), (self.v, field.v), (self.heat, field.heat)):
            if plane is not None:
                began = plane[past_end % len(plane)]
                began += ((now - began) * weight).astype(plane.dtype)

    def played(self, shown: NDArray[np.intp], fuel: NDArray[np.float64]) -> Self:
        """Return the record of a clip that plays frames ``shown`` of this once, with ``fuel`` 0..1
        of the fire's in each, both (n,)."""
        share = fuel.astype(np.float32)[:, None, None]
        brightness = np.rint(self.brightness[shown] * share).astype(np.uint8)
        heat = None if self.heat is None else (self.heat[shown] * share).astype(np.float16)
        return replace(
            self, u=self.u[shown], v=self.v[shown], brightness=brightness, loop=False, heat=heat
        )

    def cross_faded(
        self,
        after: "FieldRecord",
        leaving: NDArray[np.intp],
        entering: NDArray[np.intp],
        share: NDArray[np.float64],
    ) -> "FieldRecord":
        """Return the record of a clip that leads from this loop to another: frames ``leaving`` of
        this and ``entering`` of ``after``, of weight ``share``, each (n,)."""

        def faded(one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.float32]:
            weight = share.astype(np.float32)[:, None, None]
            return np.asarray(one[leaving] * (1 - weight) + other[entering] * weight, np.float32)

        u, v, brightness = (
            faded(getattr(self, n), getattr(after, n)) for n in ("u", "v", "brightness")
        )
        heat = None
        if self.heat is not None and after.heat is not None:
            heat = faded(self.heat, after.heat).astype(np.float16)
        return replace(
            self, u=u, v=v, brightness=np.rint(brightness).astype(np.uint8), loop=False, heat=heat
        )

    def interpolated(self, time: float) -> NDArray[np.float32]:
        """Return u, v (px/s) and brightness (0..1) of each cell at ``time`` s: (rows, columns, 3).

        Outside its frames a loop repeats; a one-shot clip holds its first or last field. Optical
        flow leads from one frame to the next, so a frame's field is valid half a frame later. A
        smooth step leads from one field to the next, so that each holds for most of a frame.
        """
        count = len(self.u)
        position = time * self.fps - 0.5
        if not self.loop:
            position = min(max(position, 0.0), count - 1.0)
        first = int(np.floor(position))
        part = _smoother_step(position - first)
        here, there = first % count, (first + 1) % count if self.loop or part else first % count
        planes = (
            cv2.addWeighted(
                of[here], (1 - part) / white, of[there], part / white, 0.0, dtype=cv2.CV_32F
            )
            for of, white in ((self.u, 1), (self.v, 1), (self.brightness, 255))
        )
        return np.asarray(cv2.merge(tuple(planes)), np.float32)


@dataclass(frozen=True, slots=True)
class SolvedFrame:
    """The buoyancy field after a frame has acted on it.

    Attributes:
        number: Of the frame; past the end of a loop, its first frames again.
        field: The field.
        forcing: How the frame drove it.
    """

    number: int
    field: BuoyancyField
    forcing: Forcing


def forcing_order(clip: Clip) -> list[int]:
    """Return the frames of a clip in the order in which ``solve_field`` takes their forcing.

    A loop's last frames come first, because they act on the field before its first frame.
    """
    lead = _lead_frames(clip)
    return [*range(clip.count - lead, clip.count), *range(clip.count - lead)]


def solve_field(
    forcings: Iterator[Forcing], clip: Clip, solver: BuoyancySolver
) -> Iterator[SolvedFrame]:
    """Solve eq. 12 through all frames of a clip, and yield the field after each.

    Args:
        forcings: The forcing of each frame, in the order of ``forcing_order(clip)``.
        clip: The clip; only its length and rate are used.
        solver: Solves the equation.
    """
    field = None
    for n, forcing in _steps(forcings, clip):
        field = solver.advance(
            field or solver.initial(forcing), forcing, n / clip.fps, 1 / clip.fps
        )
        if n >= 0:
            yield SolvedFrame(n, field, forcing)


def record_field(
    frames: Iterable[SolvedFrame], clip: Clip, solver: BuoyancySolver, *, has_heat: bool = False
) -> FieldRecord:
    """Return a record of the field of each frame of a clip, as ``solve_field`` yields them."""
    record = FieldRecord.empty(
        clip.count, solver.shape, solver.cell, clip.fps, clip.loop,
        has_heat=has_heat, tiles=solver.tiles,
    )  # fmt: skip
    for frame in frames:
        record.write(frame.number, frame.field, frame.forcing.brightness)
    return record


def _steps(forcings: Iterator[Forcing], clip: Clip) -> Iterator[tuple[int, Forcing]]:
    """Yield the number of each step of the solver, and the forcing that acts in it.

    The last frames of a loop act before frame 0, in steps of negative numbers, and again at its
    end. Then the first frames act once more, to cross-fade the end into the beginning.
    """
    count, lead = clip.count, _lead_frames(clip)
    overlap = _overlap_frames(clip.fps) if lead else 0
    last = list(islice(forcings, lead))
    yield from zip(range(-lead, 0), last, strict=True)
    first = []
    for n, forcing in enumerate(forcings):
        if n < overlap:
            first.append(forcing)
        yield n, forcing
    yield from zip(range(count - lead, count), last, strict=True)
    if lead:
        # In a short loop some of the first frames are among the last ones: then these follow.
        again = first + last
        yield from ((count + n, again[n % count]) for n in range(overlap))


def _lead_frames(clip: Clip) -> int:
    """Return how many of a loop's last frames act before its first; 0 for a one-shot clip."""
    return min(max(1, round(_LEAD_IN * clip.fps)), clip.count) if clip.loop else 0


def _overlap_frames(fps: float) -> int:
    """Return over how many frames the end of a loop's field cross-fades into its beginning."""
    return max(1, round(_OVERLAP * fps))


def _smoother_step(part: float) -> float:
    """Rise from 0 to 1 with zero slope and curvature at both ends (Perlin's smootherstep)."""
    return part**3 * (part * (6 * part - 15) + 10)
