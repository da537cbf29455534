"""Simulate the sheets of a scene, record them frame by frame, and close the recording to a loop."""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.silk.mechanics import ExternalAcceleration, SheetState, Vectors, step
from fire_atlas.generators.silk.scene import SilkScene

Real = TypeVar("Real", np.float32, np.float64)

WARM_UP = 1.5
"""Seconds simulated before the first frame, so that the fire is moving by then."""

_OVERLAP, _MAX_OVERLAP = 0.35, 1.0
"""Fraction of a loop over which its end is blended into its beginning, and limit in seconds."""

_MAX_SPEED_UP = 2.5
"""Limit on a texture's speed by that of its sheet, in multiples of ``Fuel.image_rate``."""


@dataclass(frozen=True, slots=True)
class Recording:
    """The simulated sheets, one entry per frame.

    Attributes:
        x: (frames, sheets, rows, columns, 3) float32 positions, heights. In a loop there is one
            more entry, equal to entry 0.
        loops: Whether the first frame follows the last.
        v: (frames, sheets, rows, columns, 3) float32 velocities in the last step before each frame,
            heights/s.
        v_rms: (frames, sheets) root mean square speed of the nodes relative to the base, heights/s,
            as simulated: without what closing a loop adds, which would thin the gas there.
        rate: (frames, sheets) texture images per second.
    """

    x: NDArray[np.float32]
    v: NDArray[np.float32]
    loops: bool
    v_rms: NDArray[np.float64]
    rate: NDArray[np.float64]


def simulate(scene: SilkScene, frames: int, loops: bool) -> Recording:
    """Simulate and record ``frames`` frames of a fire that is already burning.

    Even if the forces of a loop are periodic the motion of the sheets is not, so the frames that
    would follow the end are blended into the beginning, node by node.
    """
    overlap = closing_frames(frames, scene.fps) if loops else 0
    total = frames + overlap + 1 if loops else frames
    warm_up = math.ceil(WARM_UP * scene.fps)
    shape = scene.model.rest.shape
    x = np.empty((total, *shape), np.float32)
    v = np.empty_like(x)
    state = SheetState.resting(scene.model.rest.copy())
    for n in range(-warm_up, total):
        x[max(n, 0)], v[max(n, 0)] = state.x, state.velocity(scene.dt)
        state = _next_frame(scene, state, n / scene.fps, frames / scene.fps if loops else None)
    simulated = shown = np.stack([mean_square_speed(velocity) for velocity in v])
    if loops:
        simulated, v = closed(simulated, frames, overlap), closed(v, frames, overlap)
        # Where a loop is closed, sheets also move from where they are in one to where in the other.
        blended = min(overlap + 1, frames)
        apart = (x[: overlap + 1] - x[frames : frames + overlap + 1])[:blended]
        v[:blended] += _closing_rate(overlap, scene.fps)[:blended] * apart
        v[frames] = v[0]
        x = closed(x, frames, overlap)
        shown = np.stack([mean_square_speed(velocity) for velocity in v])
    # A texture is as fast as its sheet is seen to be.
    return Recording(x, v, loops, np.sqrt(simulated), texture_rate(scene, np.sqrt(shown)))


def texture_rate(scene: SilkScene, v_rms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return texture images per second: a base rate plus a part proportional to v_rms² (eq. 17),
    both as fast as pressure and oxygen drive the gas.

    It levels off for fast sheets, because frames cannot show faster textures.
    """
    energy = (v_rms / scene.of_fuels(lambda fuel: fuel.reference_speed)) ** 2
    limit = (_MAX_SPEED_UP - 0.5) / 0.5
    limited = limit * -np.expm1(-energy / limit)
    gas_speed = np.array([scene.controls.gas_speed(n / scene.fps) for n in range(len(v_rms))])
    image_rate = scene.of_fuels(lambda fuel: fuel.image_rate) * gas_speed[:, None]
    return np.asarray(image_rate * (0.5 + 0.5 * limited))


def blended(before: Recording, after: Recording, share: NDArray[np.float64]) -> Recording:
    """Return a recording that changes from one loop to another; ``share`` (frames,) is the weight
    of ``after``, 0..1."""
    return Recording(
        mixed(before.x, after.x, share),
        mixed(before.v, after.v, share),
        before.loops,
        mixed(before.v_rms, after.v_rms, share),
        mixed(before.rate, after.rate, share),
    )


def mixed(before: NDArray[Real], after: NDArray[Real], share: NDArray[np.float64]) -> NDArray[Real]:
    """Return values (frames + 1, ...) that go from those of one loop to those of another."""
    weight = np.append(share, share[0]).reshape(-1, *[1] * (before.ndim - 1))
    return before + (after - before) * weight.astype(before.dtype)


def closing_frames(frames: int, fps: float) -> int:
    """Return the number of frames after the end of a loop that are blended into its beginning."""
    return max(1, min(round(frames * _OVERLAP), round(_MAX_OVERLAP * fps)))


def _next_frame(
    scene: SilkScene, state: SheetState, time: float, period: float | None
) -> SheetState:
    """Advance the sheets by one frame; what has keyframes begins again after ``period``, s."""
    for n in range(scene.steps):
        now = time + n * scene.dt
        moment = now if period is None else now % period
        state = _move_attached(scene, state, moment)
        stiffening = scene.controls.pressure.at(moment)
        state = step(scene.model, state, _external(scene, now, moment), scene.dt, stiffening)
    return state


def _external(scene: SilkScene, now: float, moment: float) -> ExternalAcceleration:
    """Return a function for the acceleration by forces and intruders; see ``SheetForces``."""

    def external(x: Vectors, v: Vectors) -> Vectors:
        a = scene.forces.acceleration(now, moment, x, v)
        for i, body in enumerate(scene.intruders):
            if body.strength == 0:
                continue
            push = body.push(moment, x) / scene.forces.mass[..., None]
            # It does not push away its own flame.
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


def mean_square_speed(v: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the mean square speed (sheets,) of each sheet's nodes, relative to its base."""
    relative = np.asarray(v - v[:, :1], np.float64)
    return np.asarray((relative * relative).sum(axis=-1).mean(axis=(1, 2)))


def _closing_weight(overlap: int) -> NDArray[np.float64]:
    """Return the weight (overlap + 1,) of a loop's first frames, against those after its end."""
    return smooth_step(np.linspace(0.0, 1.0, overlap + 1))


def _closing_rate(overlap: int, fps: float) -> NDArray[np.float32]:
    """Return how fast that weight grows, (overlap + 1, 1, 1, 1, 1), 1/s."""
    share = np.linspace(0.0, 1.0, overlap + 1)
    return np.asarray(6 * share * (1 - share) * fps / overlap, np.float32).reshape(-1, 1, 1, 1, 1)


def closed(values: NDArray[Real], frames: int, overlap: int) -> NDArray[Real]:
    """Return the first ``frames`` entries and one more that equals the first.

    The first ``overlap`` entries fade from those recorded after the end to their own.
    """
    w = _closing_weight(overlap).reshape(-1, *[1] * (values.ndim - 1)).astype(values.dtype)
    loop = values[: frames + 1].copy()
    blend = (1 - w) * values[frames : frames + overlap + 1] + w * values[: overlap + 1]
    blended = min(overlap + 1, frames)
    loop[:blended] = blend[:blended]
    loop[frames] = loop[0]
    return loop
