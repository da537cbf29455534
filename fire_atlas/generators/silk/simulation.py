"""The simulation of a scene, recorded frame by frame, and closed into a circle."""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.silk.mechanics import External, State, step
from fire_atlas.generators.silk.mesh import Vectors, length
from fire_atlas.generators.silk.scene import Scene

Real = TypeVar("Real", np.float32, np.float64)

_SETTLING = 1.5
"""Seconds the sheets move before the first frame."""

_OVERLAP = 0.35
"""Part of a loop over which its end is blended into its beginning; at most ``_LONGEST`` s."""

_LONGEST = 1.0

_KINDLING = 0.25, 0.3
"""Seconds a match must be in a flame until it catches fire, and in which it then comes alight."""

_HEAT = 0.05
"""How far from a flame a match still catches fire, heights."""

_BRISK = 3.0
"""How many times as fast as in calm air a texture plays at most: frames cannot show more."""


@dataclass(frozen=True, slots=True)
class Recording:
    """What the sheets do, one entry a frame.

    Attributes:
        x: (frames, sheets, rows, columns, 3) float32 positions, heights.
        v_rms: (frames, sheets) root mean square speed of the nodes, heights/s.
        rate: (frames, sheets) images of the texture a second.
        lit: (frames, sheets) how much each sheet burns, 0..1.
    """

    x: NDArray[np.float32]
    v_rms: NDArray[np.float64]
    rate: NDArray[np.float64]
    lit: NDArray[np.float64]


def simulate(scene: Scene, frames: int, loops: bool) -> Recording:
    """Move the sheets through ``frames`` frames, from a fire that burns already.

    If it ``loops``, entry ``frames`` follows and equals entry 0: the forces of a loop come round,
    but sheets do not by themselves, so the frames that would follow its end are blended into its
    beginning, node by node.
    """
    overlap = _overlap(frames, scene.fps) if loops else 0
    extra = overlap + 1 if loops else 0
    settling = math.ceil(_SETTLING * scene.fps)
    shape = scene.model.rest.shape
    x = np.empty((frames + extra, *shape), np.float32)
    v_rms = np.empty((frames + extra, shape[0]))
    lit = np.empty((frames + extra, shape[0]))
    kindling = _Kindling(scene)
    state = State.resting(scene.model.rest.copy())
    for n in range(-settling, frames + extra):
        if n >= 0:
            x[n] = state.x
            v_rms[n] = _rms(state.velocity(scene.dt))
            lit[n] = kindling.lit
        state = _frame(scene, state, n / scene.fps)
        kindling.look(scene, state, (n + 1) / scene.fps)
    rate = texture_rate(scene, v_rms)
    told = Recording(x, v_rms, rate, lit)
    return _closed(told, frames, overlap) if loops else told


def texture_rate(scene: Scene, v_rms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Images a second that a texture plays at, proportional to v_rms² but for a base (eq. 17).

    Fast sheets are held to what frames can show.
    """
    energy = (v_rms / scene.fuel.speed) ** 2
    excess = (_BRISK - 1) / 0.5
    swift = excess * -np.expm1(-energy / excess)
    return np.asarray(scene.fuel.rate * (0.5 + 0.5 * swift))


def _overlap(frames: int, fps: float) -> int:
    return max(1, min(round(frames * _OVERLAP), round(_LONGEST * fps)))


def _frame(scene: Scene, state: State, time: float) -> State:
    """Carry the sheets on by one frame."""
    for n in range(scene.steps):
        now = time + n * scene.dt
        state = _ridden(scene, state, now)
        state = step(scene.model, state, _forces(scene, now), scene.dt)
    return state


def _forces(scene: Scene, now: float) -> External:
    """What moves the nodes at one moment besides their springs."""

    def external(x: Vectors, v: Vectors) -> Vectors:
        a = scene.air.acceleration(now, x, v)
        for i, body in enumerate(scene.bodies):
            push = body.push(now, x)
            # A match does not push the flame away that it carries.
            push[[rider == i for rider in scene.rider]] = 0.0
            a += push
        return a

    return external


def _ridden(scene: Scene, state: State, now: float) -> State:
    """Let the base of each sheet that rides on an intruder move with it for the next step."""
    riders = [(sheet, body) for sheet, body in enumerate(scene.rider) if body >= 0]
    if not riders:
        return state
    x, before = state.x.copy(), state.before.copy()
    pinned = scene.model.free[0, :, 0, 0] == 0
    for sheet, i in riders:
        body = scene.bodies[i]
        rest = scene.model.rest[sheet, pinned] - body.places[0]
        x[sheet, pinned] = rest + body.at(now)
        moved = body.at(now + scene.dt) - body.at(now)
        before[sheet, pinned] = x[sheet, pinned] - moved
    return State(x, before)


class _Kindling:
    """Which sheets burn: all but those of matches that no flame has reached yet."""

    def __init__(self, scene: Scene) -> None:
        self.lit = np.array([float(body < 0) for body in scene.rider])
        self._heated = [0.0] * len(scene.bodies)
        # The flame is narrower than its sheet.
        across = np.abs(np.linspace(-1, 1, scene.model.rest.shape[2]))
        self._burning = across <= max(scene.fuel.burner.width, float(across.min()))

    def look(self, scene: Scene, state: State, time: float) -> None:
        """See who is in whose flame at ``time``, one frame after the last look."""
        delay, swell = _KINDLING
        for i, body in enumerate(scene.bodies):
            if not body.is_match:
                continue
            flame = state.x[:, :, self._burning]
            near = length(flame - body.at(time)).min(axis=(1, 2)) < body.radius + _HEAT
            others = np.array([rider != i for rider in scene.rider])
            if self._heated[i] >= delay or (near & others & (self.lit > 0.5)).any():
                self._heated[i] += 1 / scene.fps
            share = min(max((self._heated[i] - delay) / swell, 0.0), 1.0)
            self.lit[~others] = share


def _rms(v: Vectors) -> NDArray[np.float64]:
    return np.asarray(np.sqrt((v * v).sum(axis=-1).mean(axis=(1, 2))))


def _closed(told: Recording, frames: int, overlap: int) -> Recording:
    """The first ``frames`` entries and one more that equals the first.

    Entry i < overlap goes over from what came after the end (i = 0) to what was first recorded.
    """
    weight = smooth_step(np.linspace(0.0, 1.0, overlap + 1))

    def closed(values: NDArray[Real]) -> NDArray[Real]:
        w = weight.reshape(-1, *[1] * (values.ndim - 1)).astype(values.dtype)
        kept = values[: frames + 1].copy()
        blend = (1 - w) * values[frames : frames + overlap + 1] + w * values[: overlap + 1]
        many = min(overlap + 1, frames)
        kept[:many] = blend[:many]
        kept[frames] = kept[0]
        return kept

    return Recording(closed(told.x), closed(told.v_rms), closed(told.rate), closed(told.lit))
