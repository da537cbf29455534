"""Which files a clip is made of, and in what order; imports nothing heavy.

An up-to-date build asks only this, so neither cv2 nor numpy nor Pillow may be imported here.
"""

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import islice
from pathlib import Path
from typing import Protocol

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import natural_key

STILLS = (".png", ".tga", ".bmp", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".exr", ".gif")
"""Endings of the files that count as frames of a folder."""

MAX_PIXELS = 8192 * 8192
"""Most pixels of a picture, unless the command line says: a frame takes some 50 bytes for each."""

MAX_FRAMES = 10_000
"""More frames than this are refused: no atlas can hold them."""

MAX_ENTRIES = 200_000
"""Most names that are read of the folders in which frames are looked for; ``**`` reads each twice.
It keeps a pattern such as ``/**/*.png`` from reading a whole disk."""

_MAX_HINTS = 10_000
"""Most names of a folder among which a misspelt one is looked for."""


class Cut(Protocol):
    """Which of the frames that are there a recipe uses: the part of its settings asked for here."""

    @property
    def start(self) -> int:
        """First frame, counted from 0."""

    @property
    def count(self) -> int | None:
        """How many frames; None is all that follow."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A cut by numbers.

    Attributes:
        start: First frame, counted from 0.
        count: How many frames; None is all that follow.
    """

    start: int = 0
    count: int | None = None


WHOLE = Chosen()
"""All frames."""


@dataclass(frozen=True, slots=True)
class Located:
    """The files that a recipe's path stands for.

    Attributes:
        files: In the order of play.
        single: True if the path is one file, which may hold many frames (sheet, GIF, video).
    """

    files: tuple[Path, ...]
    single: bool


def list_inputs(settings: Cut, path: Path) -> list[Path]:
    """Return the files the clip of ``settings`` is read from, in order of play.

    Raises:
        SourceError: Nothing usable lies at ``path``, or ``start``/``count`` run past the end.
    """
    located = locate(path)
    if located.single:
        return list(located.files)
    return [located.files[i] for i in cut(settings, len(located.files), path)]


def locate(path: Path) -> Located:
    """Find the file, the images of the folder, or the matches of the glob at ``path``."""
    try:
        return _locate(path)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error


def _locate(path: Path) -> Located:
    if path.is_dir():
        return Located(_images_of_folder(path), single=False)
    if path.exists():
        return Located((path,), single=True)
    if glob.has_magic(str(path)):
        files = _matches(path)
        return Located(files, single=len(files) == 1)
    raise SourceError(_missing(path))


def cut(settings: Cut, available: int, path: Path) -> range:
    """Return the numbers of the frames that ``start`` and ``count`` choose of ``available``."""
    frames = "1 frame" if available == 1 else f"{available} frames"
    if settings.start >= available:
        raise SourceError(
            f"{path}: start is {settings.start}, but there are only {frames}, "
            f"counted from 0: the last possible start is {available - 1}"
        )
    stop = available if settings.count is None else settings.start + settings.count
    if stop > available:
        raise SourceError(
            f"{path}: start {settings.start} and count {settings.count} run past the end: there "
            f"are only {frames}; count can be at most {available - settings.start}, or leave it out"
        )
    return range(settings.start, stop)


def _images_of_folder(folder: Path) -> tuple[Path, ...]:
    names = [entry.name for entry in _Walk(folder, folder).entries(folder)]
    if not names:
        raise SourceError(f"{folder}: the folder is empty; put the frames there, one image each")
    files = _stills(folder / name for name in names if not name.startswith("."))
    if not files:
        raise SourceError(
            f"{folder}: no images in this folder (it holds {_some(names)}); frames end in "
            f"{', '.join(STILLS)}; a video or an animation is named itself as path"
        )
    return files


def _matches(pattern: Path) -> tuple[Path, ...]:
    """Return what ``pattern`` matches; folders that exist as spelt are never patterns."""
    base = Path(pattern.anchor)
    rest = list(pattern.parts[1:] if pattern.anchor else pattern.parts)
    while rest and (base / rest[0]).is_dir():
        base /= rest.pop(0)
    found = list(dict.fromkeys(_Walk(pattern, base).matches(base, rest)))
    if not found:
        raise SourceError(f"{pattern}: no file matches; {base} holds {_some(_names(base))}")
    if len(found) == 1 and found[0].is_file():
        return (found[0],)
    files = _stills(found)
    if not files:
        raise SourceError(
            f"{pattern}: matches no images, only {_some([p.name for p in found])}; "
            f"frames end in {', '.join(STILLS)}"
        )
    return files


@dataclass(slots=True)
class _Walk:
    """A search through folders that reads at most ``MAX_ENTRIES`` names.

    Attributes:
        path: What the recipe states, a folder or a pattern.
        base: The folder in which the search begins.
        count: How many names were read.
    """

    path: Path
    base: Path
    count: int = 0

    def matches(self, folder: Path, segments: Sequence[str]) -> Iterator[Path]:
        """Yield the paths in ``folder`` that fit a pattern, given as names between slashes.

        ``**`` stands for any number of folders. Only a name with a dot in front fits hidden files.
        A path may be yielded more than once.
        """
        segment, *rest = segments
        if segment == "**":
            for each in self._folders(folder):
                yield from self.matches(each, rest or ["*"])
            return
        for path in self._fitting(folder, segment):
            if not rest:
                yield path
            elif _is_folder(path):
                yield from self.matches(path, rest)

    def entries(self, folder: Path) -> Iterator[os.DirEntry[str]]:
        """Yield what lies in a folder.

        Raises:
            OSError: The folder cannot be read.
            SourceError: The whole search has read too many names.
        """
        with os.scandir(folder) as entries:
            for entry in entries:
                self.count += 1
                if self.count > MAX_ENTRIES:
                    raise SourceError(
                        f"{self.path}: too many files to search: {self.base} and the folders in "
                        f"it hold more than {MAX_ENTRIES}; name a folder that holds little else "
                        f"than the frames"
                    )
                yield entry

    def _fitting(self, folder: Path, segment: str) -> list[Path]:
        """Return what lies in ``folder`` and fits one name of the pattern."""
        if not glob.has_magic(segment):
            path = folder / segment
            return [path] if os.path.lexists(path) else []
        shows_hidden = segment.startswith(".")
        return [
            folder / entry.name
            for entry in self._readable(folder)
            if (shows_hidden or not entry.name.startswith(".")) and fnmatch(entry.name, segment)
        ]

    def _folders(self, top: Path) -> Iterator[Path]:
        """Yield ``top`` and all folders below it except hidden ones.

        Links to folders are followed, unless they lead back to a folder that holds the link.
        """
        waiting: list[tuple[Path, frozenset[Path]]] = [(top, frozenset())]
        while waiting:
            folder, above = waiting.pop()
            resolved = folder.resolve()
            if resolved in above:
                continue
            yield folder
            waiting += [
                (folder / entry.name, above | {resolved})
                for entry in self._readable(folder)
                if not entry.name.startswith(".") and _is_folder(entry)
            ]

    def _readable(self, folder: Path) -> list[os.DirEntry[str]]:
        """Return what lies in a folder: nothing in one that cannot be read."""
        with suppress(OSError):
            return list(self.entries(folder))
        return []


def _is_folder(path: "Path | os.DirEntry[str]") -> bool:
    """Return whether a folder lies there, or a link to one; not where that cannot be found out."""
    with suppress(OSError):
        return path.is_dir()
    return False


def _stills(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the images among ``paths`` in natural order; sidecars such as .import are left."""
    files = sorted((p for p in paths if p.suffix.lower() in STILLS), key=natural_key)
    if len(files) > MAX_FRAMES:
        raise SourceError(
            f"{files[0].parent}: {len(files)} images; at most {MAX_FRAMES} frames are taken"
        )
    return tuple(files)


def _missing(path: Path) -> str:
    """Say which part of ``path`` is missing and what was probably meant."""
    import difflib

    parent, name = path.parent, path.name
    while not parent.exists() and parent != parent.parent:
        parent, name = parent.parent, parent.name
    names = _names(parent)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    meant = " or ".join(f"'{n}'" for n in close)
    hint = f"did you mean {meant}?" if close else f"{parent} holds {_some(names)}"
    if not parent.is_dir():
        hint = f"{parent} is a file, not a folder"
    what = (
        f"{path}: does not exist" if name == path.name else f"{path}: there is no folder '{name}'"
    )
    return f"{what}; {hint}"


def _names(folder: Path) -> list[str]:
    """Return names that lie in a folder, hidden ones left out, for a hint."""
    with suppress(OSError), os.scandir(folder) as entries:
        return sorted(e.name for e in islice(entries, _MAX_HINTS) if not e.name.startswith("."))
    return []


def _some(names: list[str]) -> str:
    names = sorted(names)
    if not names:
        return "nothing"
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(f"'{n}'" for n in names[:3]) + more
