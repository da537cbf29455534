"""Which sheets burn: those of an object in the flame only once a flame has lit it (Figure 6)."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.silk.intruders import distance_to
from fire_atlas.generators.silk.mechanics import lengths, refined
from fire_atlas.generators.silk.raster import sample_texture
from fire_atlas.generators.silk.scene import SilkScene
from fire_atlas.generators.silk.sheet_textures import SheetTextures
from fire_atlas.generators.silk.simulation import WARM_UP, Recording, closed, closing_frames, mixed

_DELAY, _RISE = 0.25, 0.3
"""Seconds in a flame until an object catches fire, and from then until it burns fully."""

_DISTANCE = 0.05
"""Maximum distance from a flame at which it catches fire, heights."""

_BURNING = 0.15
"""Heat (or light, of images of light) from which on a place on a sheet is a flame that can be
seen."""

_FINE = 0.5 * _DISTANCE
"""Maximum distance between the places on a sheet that are looked at, heights."""


@dataclass(frozen=True, slots=True)
class Ignition:
    """What burns in each frame.

    Attributes:
        burning: (frames, sheets) 0 where a sheet does not burn yet, 1 where it burns fully.
        burnt: (frames, intruders) time for which an intruder has burnt, s.
    """

    burning: NDArray[np.float64]
    burnt: NDArray[np.float64]

    @classmethod
    def of(cls, scene: SilkScene, recording: Recording, textures: SheetTextures) -> Self:
        """Find when the objects catch fire: ``textures`` say where the flames are.

        An object that is in a flame before the first frame has caught fire by then. In a loop the
        frames after the end are blended into the beginning, as the sheets are.
        """
        frames = len(recording.x) - recording.loops
        overlap = closing_frames(frames, scene.fps) if recording.loops else 0
        warm_up = math.ceil(WARM_UP * scene.fps)
        flames = _Flames(scene, recording, textures)
        heated = np.zeros(len(scene.intruders))
        steps = []
        for n in range(-warm_up, frames + overlap + recording.loops):
            if n >= 0:
                steps.append(heated.copy())
            shown = n % frames if recording.loops else max(n, 0)
            time = (shown if recording.loops else n) / scene.fps
            burning = _burning(scene, heated)
            for i, body in enumerate(scene.intruders):
                burns = heated[i] >= _DELAY
                if burns or (body.ignites and flames.touch(i, time, shown, burning)):
                    heated[i] += 1 / scene.fps
        times = np.array(steps).reshape(len(steps), len(scene.intruders))
        burning, burnt = _burning(scene, times), np.maximum(times - _DELAY, 0.0)
        if recording.loops:
            burning, burnt = (closed(share, frames, overlap) for share in (burning, burnt))
        return cls(burning, burnt)

    def changing_to(self, after: "Ignition", share: NDArray[np.float64]) -> "Ignition":
        """Return what burns while a fire changes between its loops in two winds.

        ``share`` (frames,) is the weight of ``after`` in each frame, 0..1.
        """
        return Ignition(
            mixed(self.burning, after.burning, share), mixed(self.burnt, after.burnt, share)
        )


def _burning(scene: SilkScene, heated: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each sheet burns (..., sheets), 0..1, by the time (..., intruders), s, for
    which what it is lit with has been in a flame."""
    share = np.clip((heated - _DELAY) / _RISE, 0.0, 1.0)
    always = np.ones((*heated.shape[:-1], 1))
    lit_by = np.array(scene.lit_by)
    return np.asarray(np.concatenate([share, always], axis=-1)[..., lit_by])


@dataclass(frozen=True, slots=True)
class _Flames:
    """Where flames are."""

    scene: SilkScene
    recording: Recording
    textures: SheetTextures

    def touch(self, i: int, time: float, shown: int, burning: NDArray[np.float64]) -> bool:
        """Return whether a flame that is not its own touches intruder ``i`` at ``time`` s.

        The sheets are as in frame ``shown`` and burn as far as ``burning`` (sheets,) says.
        """
        body = self.scene.intruders[i]
        distance, ends = body.radius + _DISTANCE, body.kindling(time)
        for s in np.flatnonzero(burning > 0.5):
            x = self.recording.x[shown, s : s + 1].astype(np.float64)
            # Between two nodes a sheet is no nearer than by their distance.
            apart = max(float(lengths(np.diff(x, axis=axis)).max()) for axis in (1, 2))
            if self.scene.attached_to[s] == i or distance_to(ends, x).min() > distance + apart:
                continue
            places = refined(x, _FINE)
            near = distance_to(ends, places)[0] < distance
            if near.any():
                texel = self.textures.texel_grid(slice(0, 1), *places.shape[1:3])[0][near]
                heat = self.textures.image(shown, int(s)).max(axis=-1, keepdims=True)
                if (sample_texture(heat, texel.astype(np.float32)) > _BURNING).any():
                    return True
        return False
