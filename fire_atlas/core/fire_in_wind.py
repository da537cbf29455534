"""One fire in several winds, and the frames in which it changes from one to another."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step


@dataclass(frozen=True, slots=True)
class WindChange:
    """Frames of a fire while its wind changes from one level to another.

    Attributes:
        clip: The frames. They play once.
        shares: (frames,) share of the new wind in each frame, between 0 and 1.
        entry: Frame of the loop in the new wind that follows them.
    """

    clip: Clip
    shares: NDArray[np.float64]
    entry: int


@dataclass(frozen=True, slots=True)
class FireInWind:
    """One fire in several steady winds.

    Attributes:
        loops: A loop in each wind, from one seed: all have the same size, length and frame rate,
            and show the fire at about the same moments.
        change: ``change(before, after, start, progress)`` returns the frames in which the wind
            changes from that of loop ``before`` to that of ``after``, from the frame that would
            follow frame ``start`` of ``before``. ``progress`` (frames,) ascends: the part of the
            change, between 0 and 1, that has passed in each frame.
    """

    loops: tuple[Clip, ...]
    change: Callable[[int, int, int, NDArray[np.float64]], WindChange]


def even_progress(count: int) -> NDArray[np.float64]:
    """Return the progress (count,) of a change that passes at one speed."""
    return np.arange(1, count + 1) / (count + 1)


def change_shares(progress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of the new wind, 0..1, at each ``progress`` of a change."""
    return smooth_step(progress)
