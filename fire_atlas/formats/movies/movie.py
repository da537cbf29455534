"""An animation as movies show it, and when each of its frames is shown."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fire_atlas.core.pixels import Bytes


@dataclass(frozen=True, slots=True)
class Movie:
    """An animation to be written as a movie.

    Attributes:
        width, height: Size of every frame, px.
        durations: Duration of each frame, ms.
        loop: Whether the first frame follows the last one.
        frame: ``frame(i)`` returns frame i, (H, W, 4) uint8, sRGB with straight alpha, as players
            of movies blend it. It may be asked for a frame several times.
    """

    width: int
    height: int
    durations: tuple[float, ...]
    loop: bool
    frame: Callable[[int], Bytes]


def schedule(durations: Sequence[float], tick: int, minimum: int) -> list[tuple[int, int]]:
    """Return the indices of the frames to show, each with its duration.

    All times have one unit. Durations returned are multiples of ``tick`` and at least ``minimum``.
    Rounding errors do not add up: every frame ends within half a tick of its time. Frames too short
    to show are left out, and their time is added to the next one.
    """
    shown: list[tuple[int, int]] = []
    start, end = 0, 0.0
    for i, duration in enumerate(durations):
        end += duration
        length = round(end / tick) * tick - start
        if length >= minimum:
            shown.append((i, length))
            start += length
    return shown or [(0, minimum)]
