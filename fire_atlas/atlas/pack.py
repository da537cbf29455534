"""Pack the frames of animations onto pages: choose the page of each, and its place there.

Which animations share a page, and the places there, do not depend on the order in which they come.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from fire_atlas.atlas.assignment import Assignment, Frames, assign
from fire_atlas.atlas.page_rules import PageRules, Size, effective_area
from fire_atlas.atlas.search import FilledPage
from fire_atlas.atlas.sequence import TRIES_OF_FULL, filled_page, filled_pages


class PagePlacement(NamedTuple):
    """Where a rectangle lies: index of the page, and its top-left corner there, px.

    If ``rotated``, it is turned by 90°: its height lies along x and its width along y.
    """

    page: int
    x: int
    y: int
    rotated: bool = False


@dataclass(frozen=True, slots=True)
class Packing:
    """Sizes of the pages, and the placement of each frame, one animation after the other."""

    pages: tuple[Size, ...]
    places: tuple[PagePlacement, ...]


QUICK, THOROUGH = 288, 1152
"""Number of pages to try. Thorough takes four times as long, for about 1 % less to store."""

_FIRST_TRIES = 16
"""Number of pages to try first if much of the page will be empty."""

_LOOSE, _NEARLY_FULL = 0.8, 0.9
"""Parts of a page's area: with at most the first much is left empty, with the second little."""

_STEP = 1.05
"""Factor between the sides of pages that are tried when one is sought that is large enough."""


def pack(
    sizes: Sequence[Size],
    animations: Sequence[Sequence[int]],
    rules: PageRules,
    tries: int = QUICK,
) -> Packing:
    """Place the frames of all animations on as few and as small pages as possible.

    An animation goes on one page if a page can hold it. If none can, each page holds successive
    frames of it, unless that takes an extra page.

    Args:
        sizes: Width and height of each rectangle, none too large for a page.
        animations: Of each animation, the index in ``sizes`` of each frame. Frames with the same
            one share a place, on every page that needs it.
        rules: Limits on pages.
        tries: Number of pages to try for each page that is written.
    """
    padded = [(width + rules.padding, height + rules.padding) for width, height in sizes]
    room, everything = _PackedRoom(padded, rules, tries), range(len(sizes))
    if room.area(everything) <= room.capacity:
        page = filled_page(padded, everything, rules, tries)
        if not page.unplaced_area:
            on_one = tuple(dict.fromkeys(frames, 0) for frames in animations)
            return _packing([page], Assignment((frozenset(everything),), on_one), animations)
    assignment = assign(animations, room)
    return _packing([room.page(frames) for frames in assignment.pages], assignment, animations)


def fits_pages(
    sizes: Sequence[Size], animations: Sequence[Sequence[int]], rules: PageRules, pages: int
) -> bool:
    """Return whether ``pack`` surely needs no more than so many ``pages``.

    Only what their area does not tell is packed.
    """
    padded = [(width + rules.padding, height + rules.padding) for width, height in sizes]
    room = _PackedRoom(padded, rules, QUICK)
    shown = frozenset(frame for frames in animations for frame in frames)
    if room.area(shown) > pages * room.capacity:
        return False
    if len(kinds := {padded[frame] for frame in shown}) == 1:
        ((width, height),) = kinds
        side = rules.room(rules.largest)
        return len(shown) <= pages * (side // width) * (side // height)
    if pages == 1:
        return room.holds(shown)
    return len(assign(animations, room).pages) <= pages


def _packing(
    pages: Sequence[FilledPage], assignment: Assignment, animations: Sequence[Sequence[int]]
) -> Packing:
    placed = [{placement.number: placement for placement in page.placements} for page in pages]
    places = tuple(
        PagePlacement(page_of[i], *placed[page_of[i]][i][1:])
        for frames, page_of in zip(animations, assignment.page_of, strict=True)
        for i in frames
    )
    return Packing(tuple(page.size for page in pages), places)


class _PackedRoom:
    """The room on a page for tightly packed rectangles: whether some fit, a trial tells."""

    def __init__(self, padded: Sequence[Size], rules: PageRules, tries: int) -> None:
        self.capacity = rules.room(rules.largest) ** 2
        self._padded, self._rules, self._tries = padded, rules, tries
        self._areas = [width * height for width, height in padded]
        self._trials: dict[frozenset[int], FilledPage] = {}
        self._finished: dict[frozenset[int], FilledPage] = {}

    def area(self, frames: Collection[int]) -> int:
        """Return the area that rectangles take with their padding."""
        return sum(self._areas[i] for i in frames)

    def size(self, frame: int) -> Size:
        """Return the size of a rectangle with its padding."""
        return self._padded[frame]

    def holds(self, frames: frozenset[int]) -> bool:
        """Whether a page was found that holds all these rectangles."""
        if self.area(frames) > self.capacity:
            return False
        if frames not in self._trials:
            self._trials[frames] = self._trial(frames)
        return not self._trials[frames].unplaced_area

    def divided(self, frames: Frames) -> list[Frames]:
        """Return the rectangles of each page if only these are packed."""
        numbers = frozenset(frames)
        if self.holds(numbers):
            return [frames]
        parts = []
        for page in filled_pages(self._padded, frames, self._rules, self._tries):
            placed = frozenset(placement.number for placement in page.placements)
            self._trials[placed] = self._finished[placed] = page._replace(unplaced_area=0)
            parts.append(tuple(i for i in frames if i in placed))
        return parts

    def page(self, frames: frozenset[int]) -> FilledPage:
        """Return the smallest page found for rectangles that a page holds."""
        if frames in self._finished:
            return self._finished[frames]
        trial = self._trials[frames]
        if self.area(frames) >= _NEARLY_FULL * self.capacity:
            return trial
        page = filled_page(self._padded, sorted(frames), self._rules, self._tries)
        return min(trial, page, key=lambda page: (page.unplaced_area, effective_area(page.size)))

    def _trial(self, frames: frozenset[int]) -> FilledPage:
        numbers = sorted(frames)
        if self.area(frames) <= _LOOSE * self.capacity:
            page = filled_page(self._padded, numbers, self._rules, _FIRST_TRIES)
            if not page.unplaced_area:
                return page
        return filled_page(self._padded, numbers, self._rules, TRIES_OF_FULL)
