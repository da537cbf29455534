"""The flakes of a fire that is lit, or put out: those that its loop sheds while fuel burns."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step
from fire_atlas.effect.flakes.replay import Opacity, Replayed, played_together
from fire_atlas.effect.flakes.tracks import Tracks

_LATE = 0.4
"""Last part of an ignition in which flakes light up that were born before the fire."""

_PUFF = 0.1, 0.35
"""Part of an extinction, from and to, in which as many flakes again are born: what burns collapses
and throws sparks."""

_END = 0.25
"""Last part of an extinction in which what still glows goes out."""


def lit_flakes(tracks: Tracks, shown: NDArray[np.intp], fuel: NDArray[np.float64]) -> Tracks:
    """Return the flakes of a fire that is lit, of those of its loop: as many are born as ``fuel``
    (n,) says, 0..1; all that fly in the loop's frame after the last of ``shown`` (n,) fly in that.
    """
    count, chance = len(shown), _chance(tracks)

    def opacity(
        frame: NDArray[np.intp], born: NDArray[np.intp], flight: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        late = smooth_step((frame + 1 - (1 - _LATE) * count) / (_LATE * count))
        is_shed = (born >= 0) & (chance[flight] < fuel[np.maximum(born, 0)])
        return np.where(is_shed, 1.0, late)

    return played_together([Replayed.of(tracks, shown, opacity)], tracks)


def dying_flakes(tracks: Tracks, shown: NDArray[np.intp], fuel: NDArray[np.float64]) -> Tracks:
    """Return the flakes of a fire that is put out, of those of its loop.

    Those that fly in the loop's frame before the first of ``shown`` (n,) fly on; new ones are born
    as ``fuel`` (n,) says, 0..1, and once a puff of others; all have gone out by the last frame.
    """
    count = len(shown)
    first, last = (part * count for part in _PUFF)
    of_loop = Replayed.of(tracks, shown, _shed_by(tracks, fuel))

    def puffed(
        frame: NDArray[np.intp], born: NDArray[np.intp], flight: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        return ((first <= born) & (born < last)) * _glowing(frame, count)

    half_a_loop = len(tracks.frames) // 2
    puff = Replayed.of(tracks, (shown + half_a_loop) % len(tracks.frames), puffed)
    return played_together([of_loop, puff], tracks)


def passing_flakes(
    tracks: Tracks,
    shown: NDArray[np.intp],
    fuel: NDArray[np.float64],
    dying: Tracks,
    share: NDArray[np.float64],
) -> Tracks:
    """Return the flakes of a fire that is put out at another frame of its loop, while those of
    ``shown`` (n,) pass into those of ``dying``, from its first frame on, by ``share`` (n,)."""
    shed = _shed_by(tracks, fuel)
    count = len(shown)

    def leaving(
        frame: NDArray[np.intp], born: NDArray[np.intp], flight: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        return shed(frame, born, flight) * (1 - share[frame])

    left = Replayed.of(tracks, shown, leaving)
    entered = Replayed.of(dying, np.arange(count), lambda frame, _born, _flight: share[frame])
    return played_together([left, entered], tracks)


def _shed_by(tracks: Tracks, fuel: NDArray[np.float64]) -> Opacity:
    """Return the opacity of flakes that are born as ``fuel`` (n,) says, or flew before."""
    chance = _chance(tracks)

    def opacity(
        frame: NDArray[np.intp], born: NDArray[np.intp], flight: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        is_shed = (born < 0) | (chance[flight] < fuel[np.maximum(born, 0)])
        return is_shed * _glowing(frame, len(fuel))

    return opacity


def _glowing(frame: NDArray[np.intp], count: int) -> NDArray[np.float64]:
    """Return how much glows of what is alive in each ``frame``, 0 in the last one of ``count``."""
    spent = smooth_step((frame + 1.0 - (1 - _END) * count) / (_END * count))
    return np.asarray(1 - spent, np.float64)


def _chance(tracks: Tracks) -> NDArray[np.float64]:
    """Return a number for each flight, 0..1, that says how much fuel it takes to shed it."""
    flights = max((int(rows.max(initial=0)) for rows in tracks.flights), default=0)
    return generator(tracks.seed, RandomStream.PHASES).random(flights + 1)
