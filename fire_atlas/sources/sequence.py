"""The frame numbers in the names of a sequence of images: order, patterns, and what is missing."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import gcd
from pathlib import Path

from fire_atlas.core.files import natural_key

_NUMBERED = re.compile(r"(?P<head>.*?)(?P<minus>-?)(?P<digits>[0-9]+)(?P<tail>[^0-9]*)", re.DOTALL)
"""The stem of a file with a frame number, the last one in it."""

_SEPARATORS = ("", ".", "_")
"""What stands before a minus that cannot be a hyphen: ``fire.-3``, but not ``fire-3``."""

_PATTERN = re.compile(r"%(?P<printf>0?[0-9]*)d|(?P<hashes>#+)|\$F(?P<houdini>[0-9]*)")
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
        signed: Whether a hyphen stands right before the number.
        certain: Whether that hyphen cannot be meant as one.
        digits: The number.
    """

    path: Path
    name: tuple[Path, str, str]
    signed: bool
    certain: bool
    digits: int

    @classmethod
    def of(cls, path: Path) -> "_Numbered | None":
        """Read the name of a file; None if it has no number."""
        found = _NUMBERED.fullmatch(path.stem)
        if found is None:
            return None
        head, tail = found["head"].casefold(), found["tail"].casefold()
        signed = bool(found["minus"])
        certain = signed and head[-1:] in _SEPARATORS
        return cls(path, (path.parent, head, tail), signed, certain, int(found["digits"]))


def in_playing_order(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return images in natural order, those with negative frame numbers before zero.

    A hyphen is a minus where it cannot separate a name from a number, or where the same name also
    occurs without it: ``fire-1``, ``fire0``, ``fire1``.
    """
    paths = list(paths)
    negative = {each.path for each in _numbered(paths) if each.digits < 0}

    def key(path: Path) -> tuple[object, ...]:
        if path not in negative:
            return natural_key(path)
        head, _, digits = path.stem.rpartition("-")
        return natural_key(path.with_name(head + digits + path.suffix), negative=True)

    return tuple(sorted(paths, key=key))


def _numbered(paths: Iterable[Path]) -> list[_Numbered]:
    """Return those of ``paths`` that have frame numbers; ``digits`` get their sign."""
    found = [each for each in map(_Numbered.of, paths) if each is not None]
    plain = {each.name for each in found if not each.signed}
    return [
        _Numbered(each.path, each.name, True, True, -each.digits)
        if each.signed and (each.certain or each.name in plain)
        else each
        for each in found
    ]


def sequence_notes(paths: Sequence[Path]) -> tuple[str, ...]:
    """Return which frame numbers of a sequence are missing, or doubled; nothing if the images are
    not all numbered alike."""
    frames = _numbered(paths)
    if len(frames) < max(2, len(paths)) or len({each.name for each in frames}) > 1:
        return ()
    notes, known = list[str](), dict[int, Path]()
    doubled = [
        (known[each.digits].name, each.path.name)
        for each in frames
        if known.setdefault(each.digits, each.path) != each.path
    ]
    if doubled:
        one, other = doubled[0]
        more = f", and {len(doubled) - 1} more like them" if len(doubled) > 1 else ""
        notes.append(f"{one} and {other} have one frame number{more}: both are used")
    gaps = [
        str(first) if first == last else f"{first} to {last}"
        for first, last in _missing(sorted(known))
    ]
    if gaps:
        named = ", ".join(gaps[:_MOST_NAMED]) + (", ..." if len(gaps) > _MOST_NAMED else "")
        what = f"frames {named} are" if len(gaps) > 1 or " " in named else f"frame {named} is"
        notes.append(
            f"{what} missing between {paths[0].name} and {paths[-1].name}: the clip closes over "
            f"the gap"
        )
    return tuple(notes)


def _missing(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield first and last of each gap in ascending numbers; all steps may be longer than 1, as in
    drawings on twos."""
    pairs = list(pairwise(numbers))
    step = gcd(*(later - earlier for earlier, later in pairs))
    for earlier, later in pairs:
        if later - earlier > step:
            yield earlier + step, later - step


def is_pattern(name: str) -> bool:
    """Return whether a file name has a place for frame numbers, such as ``fire.####.exr``."""
    return _PATTERN.search(name) is not None


def pattern_of(name: str) -> re.Pattern[str]:
    """Return what matches the names that ``name`` stands for.

    ``%04d``, ``####`` and ``$F4`` stand for numbers of at least four digits, a minus counting as
    one; ``%d``, ``#`` and ``$F`` for any. ``*`` and ``?`` stay wildcards; brackets are themselves.
    """
    parts, at = [], 0
    for found in _PATTERN.finditer(name):
        digits = found["printf"] or found["houdini"]
        width = len(found["hashes"]) if found["hashes"] else int(digits or 1)
        parts += [_wildcards(name[at : found.start()])]
        parts += [rf"(?:[0-9]{{{max(width, 1)},}}|-[0-9]{{{max(width - 1, 1)},}})"]
        at = found.end()
    return re.compile("".join([*parts, _wildcards(name[at:])]), re.DOTALL)


def _wildcards(text: str) -> str:
    return "".join({"*": ".*", "?": "."}.get(character, re.escape(character)) for character in text)
