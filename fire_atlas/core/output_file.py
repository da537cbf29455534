"""Output files in memory, before they are written, and checks of their names."""

import re
import unicodedata
from dataclasses import dataclass
from pathlib import PureWindowsPath
from typing import Literal, TypeAlias

Role: TypeAlias = Literal[
    "page",
    "map",
    "texture",
    "ramp",
    "atlas",
    "tracks",
    "light",
    "movie",
    "template",
    "engine",
    "scene",
    "script",
    "import",
    "manifest",
]
"""Purpose of an output, as in the manifest.

``page``, ``map`` and ``ramp`` are images, ``texture`` is one of these compressed for GPUs;
``atlas``, ``tracks`` and ``light`` describe them for any client;
``movie`` plays without one; ``template`` comes from a template of the user; ``engine``, ``scene``
and ``script`` are for one engine. ``import`` is a file with an engine's import settings for another
output. The engine and the user change it too, so a change of it does not make the build stale. It
is removed along with the file it belongs to.
"""


@dataclass(frozen=True, slots=True)
class OutputFile:
    """A finished output that is not on the disk yet.

    Attributes:
        name: File name; with folders of the output folder before it, if it was moved there.
        role: Its purpose.
        data: Its content.
    """

    name: str
    role: Role
    data: bytes


_DEVICES = {"con", "prn", "aux", "nul", "conin$", "conout$"} | {
    f"{port}{number}" for port in ("com", "lpt") for number in "123456789¹²³"
}
_FORBIDDEN = frozenset('<>:"/\\|?*')
_MAX_NAME_BYTES = 255
"""Maximum length of a file name, in UTF-8, that every file system allows."""


def is_device(name: str) -> bool:
    """Return whether ``name`` means a device on Windows, such as ``con.png``."""
    return name.partition(".")[0].rstrip().casefold() in _DEVICES


def is_portable(name: str) -> bool:
    """Return whether every system allows a file called ``name``; Windows is the strictest."""
    return (
        name.isprintable()
        and _FORBIDDEN.isdisjoint(name)
        and not name.endswith((".", " "))
        and not is_device(name)
        and 0 < len(name.encode()) <= _MAX_NAME_BYTES
    )


def as_file_name(name: str) -> str:
    """Return what ``name`` and all names have in common that are one file on Windows or macOS: they
    ignore case and the Unicode form of accents."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def is_named_after(name: str, file: str) -> bool:
    """Return whether ``file`` begins as the files of the build ``name`` do: with its name, then a
    scale, a page's number, an animation or an ending."""
    return re.match(rf"{re.escape(name)}[.@_-]", file) is not None


MANIFEST_ENDING = ".manifest.json"
"""Ending of the file names of manifests. A manifest lists the files of a build."""


def is_reserved(name: str) -> bool:
    """Return whether a file name is reserved for the tool's own files, on any file system."""
    return name.startswith(".") or name.casefold().endswith(MANIFEST_ENDING)


_UNPRINTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]")


def plain_name(name: str) -> str:
    """Return ``name`` if it is a plain file name, which leads into no other folder on any system.

    Raises:
        ValueError: It leads elsewhere (``a/b``, ``a\\b``, ``C:b``, ``..``), or holds control
            characters or lone surrogates.
    """
    is_elsewhere = PureWindowsPath(name).name != name or not name.strip(".")
    if is_elsewhere or _UNPRINTABLE.search(name):
        raise ValueError(f"{name!a} is not a plain file name")
    return name


def name_below(name: str) -> str:
    """Return ``name`` if it is a plain file name, or one after the names of folders, with ``/``
    between: it leads to a file below the folder that it begins at.

    Raises:
        ValueError: It leads elsewhere, or into a hidden folder or to a hidden file in one.
    """
    parts = [plain_name(part) for part in name.split("/")]
    if len(parts) > 1 and any(part.startswith(".") for part in parts):
        raise ValueError(f"{name!a} leads to hidden files")
    return name
