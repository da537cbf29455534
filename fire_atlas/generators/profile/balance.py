"""What chance leaves is put right: a fire leans and sways as its clip does, and its time goes
slower where it would jump.

In the clip neighbouring frames differ by some amount at most. In generated fire several parts of
it may change at once. So its frames are made, compared, and dealt out anew over its time until no
two that follow one another differ by more than the clip's 99th percentile.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.workers import Workers
from fire_atlas.effect.field.wind import peak_level
from fire_atlas.generators.profile.blaze import Blaze, Burning
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.profile.trial import tried
from fire_atlas.recipe.wind import Wind

_ROUNDS = 8
"""How often time is changed, at most. Where that was done, other moments are seen."""

_LIKE = 0.05
"""Steps that differ by less than this share are alike."""

_SEAM = 0.15
"""A loop's last step may differ from the usual ones by this share."""

_ROOM = 0.95
"""Part of the largest step allowed that is aimed at."""

_BRAKE = 3.0
"""Time is slowed by this power of what a step is too large by: part of a step is flicker, which is
there however short it is, and all that is slowed here goes faster elsewhere."""


def balanced(profile: Profile, asked: Burning, workers: Workers) -> Blaze:
    """Light a fire, and put its lean, its sway and its time right."""
    return _unhurried(_upright(profile, asked, workers), workers)


def _upright(profile: Profile, asked: Burning, workers: Workers) -> Blaze:
    """Light a fire that in still air leans as its clip does."""
    leans = np.array(profile.front.leans)
    calm = Blaze.of(profile, replace(asked, wind=Wind()))
    gain, lean = tried(calm, workers).mending(leans)
    # What is too short to show all of the clip need not lean as all of it does.
    whole = min(asked.frames * calm.reels[0].rate / len(leans), 1.0)
    return replace(Blaze.of(profile, asked), gain=gain**whole, bias=lean * whole)


def _unhurried(blaze: Blaze, workers: Workers) -> Blaze:
    """Return ``blaze`` with its time dealt out so that it does not jump, and closes unseen."""
    asked, reel = blaze.asked, blaze.reels[0]
    # Of a clip played faster than the result every so many frames are seen. A cartoon that is held
    # jumps as its clip does, and so does a fire that is blown about.
    most = blaze.profile.front.statistics.step * max(reel.rate, 1.0)
    if reel.holds or peak_level(asked.wind) > 0:
        most = math.inf
    best, least = blaze, math.inf
    for _ in range(_ROUNDS):
        steps = tried(blaze, workers).steps
        seam = float(_unlike(steps)[-1]) / _SEAM if asked.loop else 0.0
        jump = float(steps.max(initial=0.0)) / most
        if max(seam, jump) < least:
            best, least = blaze, max(seam, jump)
        if least <= 1.0:
            break
        times = _begun(blaze, steps) if seam > 1.0 else _dealt(blaze, steps, _ROOM * most)
        blaze = replace(blaze, times=times)
    return best


def _unlike(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """How unlike the usual ``steps`` each is, as a logarithm."""
    size = np.maximum(steps, 1e-9)
    return np.asarray(np.abs(np.log(size / np.median(size))))


def _begun(blaze: Blaze, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times of a loop that begins where its step is one of the usual size, and no
    further away than need be: the wind does not go with it."""
    number = len(steps)
    later = np.arange(number)
    away = np.minimum(later, number - later) / number
    start = int(np.argmin(np.maximum(np.roll(_unlike(steps), 1), _LIKE) + away))
    return np.append(blaze.times[start:], blaze.times[:start] + blaze.period)


def _dealt(blaze: Blaze, steps: NDArray[np.float64], most: float) -> NDArray[np.float64]:
    """Return when frames should be, that they differ by ``most`` at most."""
    times = blaze.times
    if blaze.asked.loop:
        times = np.append(times, times[0] + blaze.period)
    # Not all can be slower than the mean.
    slower = np.maximum(steps / max(most, float(steps.mean())), 1.0) ** _BRAKE
    place = np.append(0.0, np.cumsum(slower))
    place *= len(steps) / place[-1]
    return np.asarray(np.interp(np.arange(blaze.asked.frames), place, times))
