"""Takes: stretches of a clip that are shown one after the other, each passing into the next."""

from dataclasses import dataclass
from typing import NamedTuple


class Join(NamedTuple):
    """Where a take passes into the next, over the frames of the overlap.

    Attributes:
        ending: First frame of the overlap in the take that ends.
        beginning: First frame of the overlap in the take that begins.
    """

    ending: int
    beginning: int


@dataclass(frozen=True, slots=True)
class Edit:
    """How a clip is cut, as an editor would write it down.

    Attributes:
        shown: For each frame of the result the frame of the clip that it shows, or a join and how
            many frames of its overlap are over.
        overlap: Frames of each join.
        loop: Whether the first frame follows the last.
    """

    shown: tuple["int | tuple[Join, int]", ...]
    overlap: int
    loop: bool

    @property
    def joins(self) -> tuple[Join, ...]:
        """Every join once, in the order in which it is shown."""
        return tuple(dict.fromkeys(part[0] for part in self.shown if not isinstance(part, int)))


def edit_of_loop(joins: list[Join], overlap: int, count: int) -> Edit:
    """Return the loop that goes from join to join, the last of which leads back to its start.

    Frames are numbered round and round where a clip of ``count`` frames closes by itself.
    """
    shown: list[int | tuple[Join, int]] = []
    at = joins[-1].beginning + overlap
    for join in joins:
        shown += stretch(at, join.ending, count)
        shown += [(join, k) for k in range(overlap)]
        at = join.beginning + overlap
    return Edit(tuple(shown), overlap, loop=True)


def started_at(joins: list[Join], last: Join) -> list[Join]:
    """Return the joins of a loop from the one after ``last`` on."""
    after = joins.index(last) + 1
    return joins[after:] + joins[:after]


def stretch(first: int, end: int, count: int) -> list[int]:
    """Frames from ``first`` until ``end``, round the end of a clip of ``count`` if that is less."""
    return [n % count for n in range(first, end if end >= first else end + count)]


def edit_played_once(joins: list[Join], overlap: int, frames: int) -> Edit:
    """Return ``frames`` from the first frame of the clip on, from join to join."""
    shown: list[int | tuple[Join, int]] = []
    at = 0
    for join in joins:
        shown += range(at, join.ending)
        shown += [(join, k) for k in range(overlap)]
        at = join.beginning + overlap
    shown += range(at, at + frames - len(shown))
    return Edit(tuple(shown), overlap, loop=False)
