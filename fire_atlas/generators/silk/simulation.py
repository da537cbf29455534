"""Simulate the sheets of a scene, record them frame by frame, and close the recording to a loop."""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.silk.mechanics import (
    ExternalAcceleration,
    SheetState,
    Vectors,
    lengths,
    step,
)
from fire_atlas.generators.silk.scene import SilkScene

Real = TypeVar("Real", np.float32, np.float64)

_WARM_UP = 1.5
"""Seconds simulated before the first frame, so that the fire is moving by then."""

_OVERLAP, _MAX_OVERLAP = 0.35, 1.0
"""Fraction of a loop over which its end is blended into its beginning, and limit in seconds."""

_IGNITION_DELAY, _IGNITION_TIME = 0.25, 0.3
"""Seconds in a flame until a match catches fire, and from then until it burns fully."""

_IGNITION_DISTANCE = 0.05
"""Maximum distance from a flame at which a match catches fire, heights."""

_MAX_SPEED_UP = 3.0
"""Rough limit on a texture's speed, in multiples of ``Fuel.image_rate``."""


@dataclass(frozen=True, slots=True)
class Recording:
    """The simulated sheets, one entry per frame.

    Attributes:
        x: (frames, sheets, rows, columns, 3) float32 positions, heights. In a loop there is one
            more entry, equal to entry 0.
        loops: Whether the first frame follows the last.
        v_rms: (frames, sheets) root mean square speed of the nodes relative to the base, heights/s.
        rate: (frames, sheets) texture images per second.
        lit: (frames, sheets) 0 where a sheet does not burn yet, 1 where it burns fully.
        burnt: (frames, intruders) time for which a match has burnt, s; 0 for other intruders.
    """

    x: NDArray[np.float32]
    loops: bool
    v_rms: NDArray[np.float64]
    rate: NDArray[np.float64]
    lit: NDArray[np.float64]
    burnt: NDArray[np.float64]


def simulate(scene: SilkScene, frames: int, loops: bool) -> Recording:
    """Simulate and record ``frames`` frames of a fire that is already burning.

    Even if the forces of a loop are periodic the motion of the sheets is not, so the frames that
    would follow the end are blended into the beginning, node by node.
    """
    overlap = _overlap(frames, scene.fps) if loops else 0
    total = frames + overlap + 1 if loops else frames
    warm_up = math.ceil(_WARM_UP * scene.fps)
    shape = scene.model.rest.shape
    x = np.empty((total, *shape), np.float32)
    lit = np.empty((total, shape[0]))
    burnt = np.empty((total, len(scene.intruders)))
    ignition = _Ignition(scene)
    state = SheetState.resting(scene.model.rest.copy())
    for n in range(-warm_up, total):
        if n >= 0:
            x[n] = state.x
            lit[n] = ignition.lit
            burnt[n] = ignition.burnt
        state = _next_frame(scene, state, n / scene.fps)
        ignition.update(scene, state, (n + 1) / scene.fps)
    if loops:
        x, lit, burnt = (_closed(each, frames, overlap) for each in (x, lit, burnt))
    # Of the sheets as they are shown: where a loop is closed they move otherwise than simulated.
    v_rms = np.stack([_v_rms(velocity_of(x, scene.fps, loops, n)) for n in range(len(x))])
    return Recording(x, loops, v_rms, texture_rate(scene, v_rms), lit, burnt)


def velocity_of(x: NDArray[np.float32], fps: float, loops: bool, i: int) -> NDArray[np.float64]:
    """Return the velocity (sheets, rows, columns, 3) of the nodes in frame ``i``, heights/s, from
    the frames before and after."""
    frames = len(x) - 1 if loops else len(x)
    if loops:
        before, after, steps = (i - 1) % frames, (i + 1) % frames, 2
    else:
        before, after = max(i - 1, 0), min(i + 1, frames - 1)
        steps = max(after - before, 1)
    return np.asarray((x[after] - x[before]) * (fps / steps), np.float64)


def texture_rate(scene: SilkScene, v_rms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return texture images per second: a base rate plus a part proportional to v_rms² (eq. 17).

    It levels off for fast sheets, because frames cannot show faster textures.
    """
    energy = (v_rms / scene.of_fuels(lambda fuel: fuel.reference_speed)) ** 2
    limit = (_MAX_SPEED_UP - 1) / 0.5
    limited = limit * -np.expm1(-energy / limit)
    image_rate = scene.of_fuels(lambda fuel: fuel.image_rate)
    return np.asarray(image_rate * (0.5 + 0.5 * limited))


def blended(before: Recording, after: Recording, share: NDArray[np.float64]) -> Recording:
    """Return a recording that changes from one loop to another; ``share`` (frames,) is the weight
    of ``after``, 0..1."""
    weight = np.append(share, share[0])

    def mixed(one: NDArray[Real], other: NDArray[Real]) -> NDArray[Real]:
        return one + (other - one) * weight.reshape(-1, *[1] * (one.ndim - 1)).astype(one.dtype)

    return Recording(
        mixed(before.x, after.x),
        before.loops,
        mixed(before.v_rms, after.v_rms),
        mixed(before.rate, after.rate),
        mixed(before.lit, after.lit),
        mixed(before.burnt, after.burnt),
    )


def _overlap(frames: int, fps: float) -> int:
    return max(1, min(round(frames * _OVERLAP), round(_MAX_OVERLAP * fps)))


def _next_frame(scene: SilkScene, state: SheetState, time: float) -> SheetState:
    """Advance the sheets by one frame."""
    for n in range(scene.steps):
        now = time + n * scene.dt
        state = _move_attached(scene, state, now)
        state = step(scene.model, state, _external(scene, now), scene.dt)
    return state


def _external(scene: SilkScene, now: float) -> ExternalAcceleration:
    """Return a function for the acceleration by forces and intruders at time ``now``."""

    def external(x: Vectors, v: Vectors) -> Vectors:
        a = scene.forces.acceleration(now, x, v)
        for i, body in enumerate(scene.intruders):
            if body.strength == 0:
                continue
            push = body.acceleration(now, x)
            # A match does not push away its own flame.
            push[[carrier == i for carrier in scene.attached_to]] = 0.0
            a += push
        return a

    return external


def _move_attached(scene: SilkScene, state: SheetState, now: float) -> SheetState:
    """Move the base of each sheet attached to an intruder to its position, for the next step."""
    attached = [(sheet, i) for sheet, i in enumerate(scene.attached_to) if i >= 0]
    if not attached:
        return state
    x, previous = state.x.copy(), state.previous.copy()
    pinned = scene.model.free[0, :, 0, 0] == 0
    for sheet, i in attached:
        body = scene.intruders[i]
        rest = scene.model.rest[sheet, pinned] - body.positions[0]
        x[sheet, pinned] = rest + body.position(now)
        moved = body.position(now + scene.dt) - body.position(now)
        previous[sheet, pinned] = x[sheet, pinned] - moved
    return SheetState(x, previous)


class _Ignition:
    """Tracks which sheets burn: all except those of matches that no flame has lit yet."""

    def __init__(self, scene: SilkScene) -> None:
        self.lit = np.array([float(i < 0) for i in scene.attached_to])
        self.burnt = np.zeros(len(scene.intruders))
        self._heated = [0.0] * len(scene.intruders)
        # Columns that the flame covers: it is narrower than its sheet.
        across = np.abs(np.linspace(-1, 1, scene.model.rest.shape[2]))
        widest = max(fuel.burner.width for fuel in scene.fuels)
        self._flame = across <= max(widest, float(across.min()))

    def update(self, scene: SilkScene, state: SheetState, time: float) -> None:
        """Heat the matches that are in a flame at ``time``; call this once per frame."""
        for i, body in enumerate(scene.intruders):
            if not body.is_match:
                continue
            flame = state.x[:, :, self._flame]
            distance = lengths(flame - body.position(time)).min(axis=(1, 2))
            near = distance < body.radius + _IGNITION_DISTANCE
            others = np.array([carrier != i for carrier in scene.attached_to])
            if self._heated[i] >= _IGNITION_DELAY or (near & others & (self.lit > 0.5)).any():
                self._heated[i] += 1 / scene.fps
            share = (self._heated[i] - _IGNITION_DELAY) / _IGNITION_TIME
            self.lit[~others] = min(max(share, 0.0), 1.0)
            self.burnt[i] = max(self._heated[i] - _IGNITION_DELAY, 0.0)


def _v_rms(v: Vectors) -> NDArray[np.float64]:
    """Return the root mean square speed of each sheet's nodes, relative to its base."""
    v = v - v[:, :1]
    return np.asarray(np.sqrt((v * v).sum(axis=-1).mean(axis=(1, 2))))


def _closed(values: NDArray[Real], frames: int, overlap: int) -> NDArray[Real]:
    """Return the first ``frames`` entries and one more that equals the first.

    The first ``overlap`` entries fade from those recorded after the end to their own.
    """
    weight = smooth_step(np.linspace(0.0, 1.0, overlap + 1))
    w = weight.reshape(-1, *[1] * (values.ndim - 1)).astype(values.dtype)
    loop = values[: frames + 1].copy()
    blend = (1 - w) * values[frames : frames + overlap + 1] + w * values[: overlap + 1]
    blended = min(overlap + 1, frames)
    loop[:blended] = blend[:blended]
    loop[frames] = loop[0]
    return loop
