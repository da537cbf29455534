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
        entry: Frame of the loop in the new wind that follows them.
    """

    clip: Clip
    entry: int


@dataclass(frozen=True, slots=True)
class FireInWind:
    """One fire in several steady winds.

    Attributes:
        loops: A loop in each wind, from one seed: all have the same size, length and frame rate,
            and show the fire at about the same moments.
        change: ``change(before, after, start, count)`` returns the ``count`` frames in which the
            wind changes from that of loop ``before`` to that of ``after``, from the frame that
            would follow frame ``start`` of ``before``.
    """

    loops: tuple[Clip, ...]
    change: Callable[[int, int, int, int], WindChange]


def change_shares(count: int) -> NDArray[np.float64]:
    """Return the share (count,) of the new wind in each frame of a change, between 0 and 1."""
    return smooth_step(np.arange(1, count + 1) / (count + 1))
