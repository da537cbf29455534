"""The frame numbers in the names of a sequence of images: order, patterns, and what is missing."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile
from math import gcd
from pathlib import Path

from fire_atlas.core.files import natural_key

_NUMBERED = re.compile(r"(?P<head>.*?)(?P<minus>-?)(?P<digits>[0-9]+)(?P<tail>[^0-9]*)", re.DOTALL)
"""The stem of a file with a frame number, the last one in it but for what all stems end with."""

_SEPARATORS = ("", ".", "_")
"""What stands before a minus that cannot be a hyphen: ``fire.-3``, but not ``fire-3``."""

_PLACE = re.compile(r"%(?P<printf>[0-9]{0,3})d|(?P<hashes>#+)|\$F(?P<houdini>[0-9]{0,3})")
"""Where frame numbers go in names as Blender and Nuke (``%04d``, ``####``) or Houdini (``$F4``)
write them."""

_MOST_NAMED = 5
"""Gaps that a note names at most."""


@dataclass(frozen=True, slots=True)
class _Numbered:
    """A file with a frame number.

    Attributes:
        path: The file.
        name: What it has in common with the other frames of its sequence.
        number: The frame number, without a sign.
        hyphen: Where in the stem a hyphen stands right before the number; None if none does.
        is_negative: Whether that hyphen is a minus.
    """

    path: Path
    name: tuple[Path, str, str]
    number: int
    hyphen: int | None
    is_negative: bool

    @classmethod
    def of(cls, path: Path, ending: str) -> "_Numbered | None":
        """Read the name of a file whose stem has its frame number before ``ending``; None if it has
        none.

        A hyphen counts as a minus only if it cannot be meant as a hyphen.
        """
        found = _NUMBERED.fullmatch(path.stem.removesuffix(ending))
        if found is None:
            return None
        head, tail = found["head"].casefold(), (found["tail"] + ending).casefold()
        hyphen = found.start("minus") if found["minus"] else None
        is_negative = hyphen is not None and head[-1:] in _SEPARATORS
        return cls(path, (path.parent, head, tail), int(found["digits"]), hyphen, is_negative)

    @property
    def frame(self) -> int:
        """The frame number, with its sign."""
        return -self.number if self.is_negative else self.number


def in_playing_order(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return images in natural order, those with negative frame numbers before zero.

    A hyphen is a minus where it cannot separate a name from a number, or where the same name also
    occurs without it: ``fire-1``, ``fire0``, ``fire1``.
    """
    paths = list(paths)
    minus = {image.path: image.hyphen for image in _numbered(paths) if image.is_negative}
    return tuple(sorted(paths, key=lambda path: natural_key(path, minus=minus.get(path))))


def _numbered(paths: Sequence[Path]) -> list[_Numbered]:
    """Return those of ``paths`` that have frame numbers, with their signs."""
    ending = _common_ending({path.stem for path in paths})
    found = [image for path in paths if (image := _Numbered.of(path, ending)) is not None]
    plain = {image.name for image in found if image.hyphen is None}
    return [
        replace(image, is_negative=True)
        if image.hyphen is not None and image.name in plain
        else image
        for image in found
    ]


def _common_ending(stems: Set[str]) -> str:
    """Return what all stems have after their frame numbers, which may be numbers too: the ``_v2``
    of ``fire_01_v2`` and ``fire_02_v2``."""
    if len(stems) < 2:
        return ""
    from_the_end = zip(*(reversed(stem) for stem in stems), strict=False)
    shared = takewhile(lambda characters: len(set(characters)) == 1, from_the_end)
    return "".join(character for character, *_ in shared)[::-1].lstrip("0123456789")


def sequence_notes(paths: Sequence[Path], used: slice) -> tuple[str, ...]:
    """Return which frame numbers are missing, or doubled, among the ``used`` images of a sequence;
    or that ``paths``, all of its images in playing order, are several sequences by their names."""
    numbered = _numbered(paths)
    frames = numbered[used]
    counts = Counter(image.name for image in numbered)
    several = [name for name, count in counts.items() if count > 1]
    if len(several) > 1:
        firsts = [next(image.path.name for image in numbered if image.name == name)
                  for name in several[:2]]  # fmt: skip
        return (
            f"{' and '.join(firsts)} begin sequences of different names, which play as one clip: "
            f"kind: sprites would pack each as an animation",
        )
    if len(numbered) < len(paths) or len(counts) != 1 or len(frames) < 2:
        return ()
    notes, known = list[str](), dict[int, Path]()
    doubled = [
        (known[image.frame].name, image.path.name)
        for image in frames
        if known.setdefault(image.frame, image.path) != image.path
    ]
    if doubled:
        one, other = doubled[0]
        more = f", and {len(doubled) - 1} more like them" if len(doubled) > 1 else ""
        notes.append(f"{one} and {other} have one frame number{more}: both are used")
    gaps = list(_missing(sorted(known), _step({image.frame for image in numbered})))
    if gaps:
        shown = [str(a) if a == b else f"{a} to {b}" for a, b in gaps[:_MOST_NAMED]]
        named = ", ".join(shown) + (", ..." if len(gaps) > _MOST_NAMED else "")
        is_one = len(gaps) == 1 and len(set(gaps[0])) == 1
        what = f"frame {named} is" if is_one else f"frames {named} are"
        notes.append(
            f"{what} missing between {frames[0].path.name} and {frames[-1].path.name}: the clip "
            f"closes over the gap"
        )
    return tuple(notes)


def _step(numbers: Set[int]) -> int:
    """Return how far frame numbers are apart if none is missing: 2 for drawings on twos."""
    return gcd(*(later - earlier for earlier, later in pairwise(sorted(numbers))))


def _missing(numbers: Sequence[int], step: int) -> Iterator[tuple[int, int]]:
    """Yield first and last of each gap in ascending numbers that are ``step`` apart."""
    for earlier, later in pairwise(numbers):
        if later - earlier > step:
            yield earlier + step, later - step


def is_pattern(name: str) -> bool:
    """Return whether a file name has a place for frame numbers, such as ``fire.####.exr``."""
    return _PLACE.search(name) is not None


def with_any_padding(name: str) -> str:
    """Return a pattern with ``#`` in place of what it says about the length of its numbers."""
    head, _, tail = _parts(name)
    return f"{head}#{tail}"


def pattern_of(name: str) -> re.Pattern[str]:
    """Return what matches the names that the pattern ``name`` stands for.

    ``%04d``, ``####`` and ``$F4`` stand for numbers of at least four digits, a minus counting as
    one; ``%d``, ``#`` and ``$F`` for any. ``*`` and ``?`` stay wildcards; brackets are themselves.
    """
    head, digits, tail = _parts(name)
    number = rf"(?:[0-9]{{{digits},}}|-[0-9]{{{max(digits - 1, 1)},}})"
    return re.compile(_wildcards(head) + number + _wildcards(tail), re.DOTALL)


def _parts(pattern: str) -> tuple[str, int, str]:
    """Return what stands before the frame numbers, how many digits these have at least, and what
    stands behind them; the last place for numbers is theirs."""
    *_, place = _PLACE.finditer(pattern)
    hashes = len(place["hashes"] or "")
    digits = hashes or int(place["printf"] or place["houdini"] or 1)
    return pattern[: place.start()], max(digits, 1), pattern[place.end() :]


def _wildcards(text: str) -> str:
    """Return a regular expression for a text with ``*`` and ``?``.

    All ``*`` but the last stand for as little as they can and are not tried again, which finds the
    same names, and takes no longer for many of them.
    """
    first, *others = [
        "".join("." if character == "?" else re.escape(character) for character in part)
        for part in re.split(r"\*+", text)
    ]
    if not others:
        return first
    *between, last = others
    return first + "".join(f"(?>.*?{part})" for part in between) + f".*{last}"
