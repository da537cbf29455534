"""Find the files of a clip, in playing order.

Up-to-date builds import this module too, so it must not import cv2, numpy or Pillow.
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
from fire_atlas.core.workload import MAX_FRAMES
from fire_atlas.recipe.yaml_graph import BACKSLASHES
from fire_atlas.sources.sequence import (
    in_playing_order,
    is_pattern,
    pattern_of,
    sequence_notes,
    with_any_padding,
)

STILLS = (".png", ".tga", ".bmp", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".exr", ".gif")
"""Endings of the files in a folder that count as frames."""

_ENDINGS = ", ".join(STILLS)

VIDEOS = (
    ".mp4", ".m4v", ".mov", ".webm", ".mkv", ".avi", ".mpg", ".mpeg", ".ogv", ".wmv", ".flv",
    ".ts", ".mts", ".m2ts", ".y4m",
)  # fmt: skip
"""Endings of videos; those of most kinds are known by their first bytes too."""

_SAMPLES, _SAMPLED_FRAMES = 5, 1500
"""Number of frames by which a matte is chosen, and among how many of a clip's first ones they are
spread: a minute of film at most has to be decoded for them."""

MAX_ENTRIES = 200_000
"""Limit on the directory entries read in one search, so that a pattern such as ``/**/*.png`` does
not read a whole disk. With ``**`` each entry counts twice."""

_MAX_HINTS = 10_000
"""At most so many names of a folder are compared with a misspelt one to suggest a correction."""


class FrameRange(Protocol):
    """The frame range of a recipe (``start``, ``count``); any settings with these two will do."""

    @property
    def start(self) -> int:
        """First frame, counted from 0."""

    @property
    def count(self) -> int | None:
        """Number of frames; None for all from ``start`` on."""


@dataclass(frozen=True, slots=True)
class FixedRange:
    """A frame range without a recipe.

    Attributes:
        start: First frame, counted from 0.
        count: Number of frames; None for all from ``start`` on.
    """

    start: int = 0
    count: int | None = None


ALL_FRAMES = FixedRange()


@dataclass(frozen=True, slots=True)
class Located:
    """The files at the path of a recipe.

    Attributes:
        files: In playing order.
        single: True if the path is one file, which may hold many frames (sheet, GIF, video).
    """

    files: tuple[Path, ...]
    single: bool

    def notes(self, used: FrameRange) -> tuple[str, ...]:
        """Return which frame numbers of the range are missing or doubled, for the user."""
        stop = None if used.count is None else used.start + used.count
        return sequence_notes(self.files, slice(used.start, stop))


def list_inputs(settings: FrameRange, path: Path, *, is_clip: bool = True) -> list[Path]:
    """Return the files from which the clip of ``settings`` is read, in playing order.

    With the JSON of an atlas come its images; a JSON that ``is_clip`` does not say is one, but a
    profile that was learnt, is read alone.

    Raises:
        SourceError: There are no frames at ``path``, or ``start`` or ``count`` exceed them; or an
            atlas lacks an image.
    """
    located = locate(path)
    if located.single:
        from fire_atlas.sources.json_atlas import atlas_files, is_atlas

        (file,) = located.files
        return list(atlas_files(file)) if is_clip and is_atlas(file) else [file]
    chosen = frame_range(settings, len(located.files), path)
    return [located.files[i] for i in with_samples(chosen, len(located.files))]


@dataclass(frozen=True, slots=True)
class LocatedSprites:
    """The pictures at a path of a recipe, which names sprites.

    Attributes:
        base: The folder from which their names begin.
        files: Theirs, in alphabetical order.
    """

    base: Path
    files: tuple[Path, ...]


def locate_sprites(path: Path) -> LocatedSprites:
    """Find the image, the images in the folder and its subfolders, or the matches of the glob at
    ``path``; a folder that matches stands for all that is in it.

    Raises:
        SourceError: There is none, or a folder cannot be read.
    """
    try:
        return _locate_sprites(path)
    except OSError as error:
        where = error.filename or path
        raise SourceError(f"{where}: cannot be read ({error.strerror})") from error


def _locate_sprites(path: Path) -> LocatedSprites:
    if path.is_dir():
        return LocatedSprites(path, _some_stills(_files_below(_Walk(path, path), path), path))
    if path.exists():
        return LocatedSprites(path.parent, (path,))
    if not glob.has_magic(str(path)):
        raise SourceError(_missing(path))
    base, rest = _split_glob(path)
    walk, found = _Walk(path, base), dict[Path, None]()
    for match in walk.matches(base, rest):
        found |= dict.fromkeys(_files_below(walk, match) if _is_folder(match) else [match])
    return LocatedSprites(base, _some_stills(found, path))


def _files_below(walk: "_Walk", top: Path) -> list[Path]:
    """Return the files in a folder and in all below it, but for hidden ones."""
    return [
        folder / entry.name
        for folder in walk.folders(top)
        for entry in walk.entries(folder)
        if not entry.name.startswith(".") and not _is_folder(entry)
    ]


def _some_stills(paths: Iterable[Path], where: Path) -> tuple[Path, ...]:
    """Return the images among ``paths``, of which there must be one."""
    paths = list(paths)
    files = tuple(sorted(path for path in paths if path.suffix.lower() in STILLS))
    _refuse_too_many(files)
    if not files:
        holds = f"{_some([path.name for path in paths])}, but no image" if paths else "nothing"
        raise SourceError(f"{where}: holds {holds}; sprites end in {_ENDINGS}")
    return files


def list_sprites(paths: Iterable[Path]) -> list[Path]:
    """Return the files of the sprites at all paths of a recipe, each once.

    Raises:
        SourceError: As for ``locate_sprites``; or there are too many together.
    """
    files = list(dict.fromkeys(file for path in paths for file in locate_sprites(path).files))
    _refuse_too_many(files)
    return files


def folders_of_sprites(path: Path) -> list[Path]:
    """Return the folders in which a new image would be a new sprite, as far as they exist."""
    if path.is_file():
        return []
    base, rest = _split_glob(path)
    if not rest or glob.has_magic(rest[0]):
        with suppress(SourceError):  # too many to search: the build says so
            return list(_Walk(path, base).folders(base))
    return [base]


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
    if is_pattern(path.name) and (numbered := _matches_of_pattern(path)):
        return Located(numbered, single=False)
    if glob.has_magic(str(path)):
        files = _matches(path)
        return Located(files, single=len(files) == 1)
    raise SourceError(_missing(path))


def frame_range(settings: FrameRange, available: int, path: Path) -> range:
    """Return the numbers of the frames in a range; refuse one beyond the ``available`` frames."""
    frames = "1 frame" if available == 1 else f"{available} frames"
    if settings.start >= available:
        raise SourceError(
            f"is {settings.start}, but {path} has only {frames}, counted from 0: the last possible "
            f"start is {available - 1}",
            key=("source", "start"),
        )
    stop = available if settings.count is None else settings.start + settings.count
    if stop > available:
        raise SourceError(
            f"{settings.count} from start {settings.start} on run past the end: {path} has only "
            f"{frames}; count can be at most {available - settings.start}, or leave it out",
            key=("source", "count"),
        )
    return range(settings.start, stop)


def sample_numbers(available: int) -> list[int]:
    """Return the numbers of the frames by which the matte of ``available`` frames is chosen.

    They are spread over all, whichever of them a recipe uses: all cuts of one clip get one matte.
    """
    last = min(available, _SAMPLED_FRAMES) - 1
    return sorted({round(i * last / (_SAMPLES - 1)) for i in range(_SAMPLES)})


def with_samples(chosen: range, available: int) -> list[int]:
    """Return the numbers of the frames that are read: the chosen ones and the samples."""
    return sorted({*chosen, *sample_numbers(available)})


def _images_of_folder(folder: Path) -> tuple[Path, ...]:
    names = [entry.name for entry in _Walk(folder, folder).entries(folder)]
    if not names:
        raise SourceError(f"{folder}: the folder is empty; put the frames there, one image each")
    files = _stills(folder / name for name in names if not name.startswith("."))
    if not files:
        raise SourceError(
            f"{folder}: no images in this folder (it holds {_some(names)}); frames end in "
            f"{_ENDINGS}; to use a video or an animation, give that file as path, and to pack all "
            f"images in folders below this one, kind: sprites"
        )
    return files


def _matches_of_pattern(pattern: Path) -> tuple[Path, ...]:
    """Return the images whose names fit one with a place for frame numbers; none if its folder does
    not exist."""
    folder, name = pattern.parent, pattern_of(pattern.name)
    if not folder.is_dir():
        return ()
    names = [entry.name for entry in _Walk(pattern, folder).entries(folder)]
    return _stills(
        folder / file_name
        for file_name in names
        if name.fullmatch(file_name) and file_name[0] != "."
    )


def _matches(pattern: Path) -> tuple[Path, ...]:
    """Return the files that match a glob; names of existing folders are taken literally."""
    base, rest = _split_glob(pattern)
    found = list(dict.fromkeys(_Walk(pattern, base).matches(base, rest)))
    if not found:
        raise SourceError(f"{pattern}: no file matches; {base} holds {_some(_names(base))}")
    if len(found) == 1 and found[0].is_file():
        return (found[0],)
    files = _stills(found)
    if not files:
        raise SourceError(
            f"{pattern}: matches no images, only {_some([p.name for p in found])}; "
            f"frames end in {_ENDINGS}"
        )
    return files


def _split_glob(pattern: Path) -> tuple[Path, list[str]]:
    """Return the existing folder with which a glob begins, and what follows it."""
    base = Path(pattern.anchor)
    rest = list(pattern.parts[1:] if pattern.anchor else pattern.parts)
    while rest and (base / rest[0]).is_dir():
        base /= rest.pop(0)
    return base, rest


@dataclass(slots=True)
class _Walk:
    """A search through folders that reads at most ``MAX_ENTRIES`` names.

    Attributes:
        path: The folder or glob in the recipe.
        base: The folder in which the search begins.
        count: Number of names read so far.
    """

    path: Path
    base: Path
    count: int = 0

    def matches(self, folder: Path, segments: Sequence[str]) -> Iterator[Path]:
        """Yield the paths in ``folder`` that match a glob, split at its slashes into ``segments``.

        ``**`` stands for any number of folders. Only a segment that begins with a dot matches
        hidden files. A path may be yielded more than once.
        """
        segment, *rest = segments
        if segment == "**":
            for folder_below in self.folders(folder):
                yield from self.matches(folder_below, rest or ["*"])
            return
        for path in self._fitting(folder, segment):
            if not rest:
                yield path
            elif _is_folder(path):
                yield from self.matches(path, rest)

    def entries(self, folder: Path) -> Iterator[os.DirEntry[str]]:
        """Yield the entries of a folder.

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
        """Return the paths directly in ``folder`` that match one segment of the glob."""
        if not glob.has_magic(segment):
            path = folder / segment
            return [path] if os.path.lexists(path) else []
        shows_hidden = segment.startswith(".")
        return [
            folder / entry.name
            for entry in self._readable(folder)
            if (shows_hidden or not entry.name.startswith(".")) and fnmatch(entry.name, segment)
        ]

    def folders(self, top: Path) -> Iterator[Path]:
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
        """Return the entries of a folder; none if it cannot be read."""
        with suppress(OSError):
            return list(self.entries(folder))
        return []


def _is_folder(path: "Path | os.DirEntry[str]") -> bool:
    """Return whether a path is a folder or a link to one; False if the file system cannot tell."""
    with suppress(OSError):
        return path.is_dir()
    return False


def _stills(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the images in natural order; other files, such as Godot's .import, are ignored."""
    files = in_playing_order(path for path in paths if path.suffix.lower() in STILLS)
    _refuse_too_many(files)
    return files


def _refuse_too_many(files: Sequence[Path]) -> None:
    if len(files) > MAX_FRAMES:
        raise SourceError(
            f"{files[0].parent}: {len(files)} images; at most {MAX_FRAMES} frames are allowed"
        )


def _missing(path: Path) -> str:
    """Return a message: which part of ``path`` is missing, and what was probably meant."""
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
    elif name == path.name and is_pattern(name):
        padded_otherwise = parent / with_any_padding(name)
        if found := _matches_of_pattern(padded_otherwise):
            hint = f"did you mean '{padded_otherwise.name}', as of '{found[0].name}'?"
        return f"{path}: no file matches; {hint}"
    if any(char < " " for char in str(path)):
        hint = BACKSLASHES
    what = (
        f"{path}: does not exist" if name == path.name else f"{path}: there is no folder '{name}'"
    )
    return f"{what}; {hint}"


def _names(folder: Path) -> list[str]:
    """Return names in a folder, without hidden ones, for a hint."""
    with suppress(OSError), os.scandir(folder) as entries:
        return sorted(e.name for e in islice(entries, _MAX_HINTS) if not e.name.startswith("."))
    return []


def _some(names: list[str]) -> str:
    names = sorted(names)
    if not names:
        return "nothing"
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(f"'{n}'" for n in names[:3]) + more
