"""Assign animations to pages: each to one page, if a page can hold it, and all to few pages.

A bin packing by first-fit decreasing, in which pages tell whether they can hold some frames.
Which of several equal animations comes first decides about nothing else.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

Frames = tuple[int, ...]
"""Numbers of frames in playing order. Animations that show the same frame share its number."""

_LIKELY = 0.9
"""A page probably holds frames that take at most this part of its area."""

_MAX_MISSES = 4
"""Number of runs tried in vain after which a page counts as full."""


class Room(Protocol):
    """The room on a page, which is the same on all pages."""

    @property
    def capacity(self) -> int:
        """Return its area: frames that take more do not fit."""

    def area(self, frames: Collection[int]) -> int:
        """Return the area that frames take."""

    def size(self, frame: int) -> tuple[int, int]:
        """Return the width and height that a frame takes."""

    def holds(self, frames: frozenset[int]) -> bool:
        """Whether a page can hold all these frames."""

    def divided(self, frames: Frames) -> list[Frames]:
        """Return the frames of each page if only these are packed, on as few pages as possible."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """The page of each frame.

    Attributes:
        pages: Numbers of the frames that each page stores.
        page_of: Of each animation, the page on which it finds each of its frames.
    """

    pages: tuple[frozenset[int], ...]
    page_of: tuple[dict[int, int], ...]


class _Run(NamedTuple):
    """Frames of an animation that lie on one page: all of them if a page can hold it."""

    animation: int
    frames: Frames


_Page = list[_Run]

_SINGLE = -1
"""In place of the index of an animation, in runs of frames that are an animation each."""


def assign(animations: Sequence[Sequence[int]], room: Room) -> Assignment:
    """Assign the frames of ``animations``, given by their numbers, to pages.

    An animation that no page can hold is divided as if it were packed alone. Its last part, which
    does not fill a page, is divided again over the gaps on other pages if that saves a page.
    """
    groups = _groups(animations, room)
    divided = {animation: room.divided(frames) for animation, frames in groups.items()}
    if len(groups) == 1:
        pages = [[_Run(animation, part)] for animation, parts in divided.items() for part in parts]
    else:
        pages = sorted(_assigned(divided, room), key=min)
    page_of = {
        (run.animation, frame): i
        for i, page in enumerate(pages)
        for run in page
        for frame in run.frames
    }
    return Assignment(
        tuple(_frames_on(page) for page in pages),
        tuple(
            {frame: page_of[i if i in groups else _SINGLE, frame] for frame in frames}
            for i, frames in enumerate(animations)
        ),
    )


def _groups(animations: Sequence[Sequence[int]], room: Room) -> dict[int, Frames]:
    """Return what is to be kept together: the different frames of each animation, by its index.

    Animations of a single frame, of which a folder of sprites may have thousands, are one group,
    whose order does not matter: it is by size.
    """
    different = [tuple(dict.fromkeys(frames)) for frames in animations]
    groups = {i: frames for i, frames in enumerate(different) if len(frames) > 1}
    single = dict.fromkeys(frames[0] for frames in different if len(frames) == 1)
    by_size = tuple(sorted(single, key=room.size, reverse=True))
    return groups | ({_SINGLE: by_size} if single else {})


def _assigned(divided: dict[int, list[Frames]], room: Room) -> list[_Page]:
    whole, rests = list[_Run](), list[_Run]()
    for animation, parts in divided.items():
        runs = [_Run(animation, part) for part in parts]
        stays = animation != _SINGLE and len(runs) == 1
        whole += runs if stays else runs[:-1]
        rests += [] if stays else runs[-1:]
    pages = _first_fit(_largest_first(whole, room), room)
    for rest in _largest_first(rests, room):
        _add_rest(pages, rest, room)
    return pages


def _largest_first(runs: Iterable[_Run], room: Room) -> list[_Run]:
    """Return runs by their areas; of those of one area, the sizes of their frames decide, not the
    order in which they come."""

    def size(run: _Run) -> tuple[int, list[tuple[int, int]]]:
        return room.area(run.frames), sorted(map(room.size, run.frames))

    return sorted(runs, key=size, reverse=True)


def _frames_on(page: Iterable[_Run]) -> frozenset[int]:
    return frozenset(frame for run in page for frame in run.frames)


def _first_fit(runs: Sequence[_Run], room: Room) -> list[_Page]:
    """Put each run on the first page that can hold it beside those before it."""
    pages, left = list[_Page](), list(runs)
    while left:
        page = _filled(left, room)
        pages.append(page)
        left = [run for run in left if run not in page]
    return pages


def _filled(runs: Sequence[_Run], room: Room) -> _Page:
    """Return the first run, and of the others all that its page can hold beside those before."""
    page, left = [runs[0]], list(runs[1:])
    for _ in range(_MAX_MISSES):
        frames = _frames_on(page)
        gap = room.capacity - room.area(frames)
        left = [run for run in left if room.area(set(run.frames) - frames) <= gap]
        if not left:
            break
        count = _leading(frames, [run.frames for run in left], room)
        page += left[:count]
        left = left[count + 1 :]
    return page


def _leading(frames: frozenset[int], more: Sequence[Frames], room: Room) -> int:
    """Return how many of ``more``, from the first on, a page can hold beside ``frames``."""
    unions = list(_unions(frames, more, room))
    likely = sum(room.area(union) <= _LIKELY * room.capacity for union in unions[1:])
    fits, most = 0, len(unions) - 1
    count = min(max(likely, 1), most)
    while fits < most:
        if room.holds(unions[count]):
            fits = count
        else:
            most = count - 1
        count = (fits + most + 1) // 2
    return fits


def _unions(frames: frozenset[int], more: Sequence[Frames], room: Room) -> Iterator[frozenset[int]]:
    """Yield ``frames``, then these with the first of ``more``, and so on while the area allows."""
    yield frames
    for following in more:
        frames = frames.union(following)
        if room.area(frames) > room.capacity:
            return
        yield frames


def _add_rest(pages: list[_Page], rest: _Run, room: Room) -> None:
    """Divide a run over the gaps on ``pages``, largest first; if they do not do, add a page."""
    gaps = [room.capacity - room.area(_frames_on(page)) for page in pages]
    left, parts = rest.frames, list[tuple[_Page, _Run]]()
    for _, i in sorted((-gap, i) for i, gap in enumerate(gaps)):
        if not left or sum(gaps) < room.area(rest.frames):
            break
        count = _leading(_frames_on(pages[i]), [(frame,) for frame in left], room)
        if count:
            parts.append((pages[i], _Run(rest.animation, left[:count])))
        left = left[count:]
    if left:
        pages.append([rest])
        return
    for page, part in parts:
        page.append(part)
