"""Made frames are remembered, as far as there is room: each is asked for several times."""

from collections.abc import Callable, Container

from fire_atlas.core.picture import Picture

ROOM = 64 * 1024 * 1024
"""Bytes of made frames kept. A constant: memory must not grow with the length of a clip."""


def remembering(
    picture: Callable[[int], Picture], made: Container[int]
) -> Callable[[int], Picture]:
    """Return a clip's ``picture`` with those of the frames ``made`` that were asked for first kept.

    What is given out is always fresh. Threads that ask at once may each make the same frame.
    """
    kept: dict[int, Picture] = {}
    room = [ROOM]

    def remembered(i: int) -> Picture:
        known = kept.get(i)
        if known is not None:
            return known.copy()
        frame = picture(i)
        if i in made and frame.nbytes <= room[0]:
            room[0] -= frame.nbytes
            kept[i] = frame.copy()
        return frame

    return remembered
