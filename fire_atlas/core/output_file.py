"""Output files before they are written: content, role, and which names are safe everywhere."""

import re
from dataclasses import dataclass
from pathlib import PureWindowsPath
from typing import Literal, TypeAlias

Role: TypeAlias = Literal[
    "page",
    "map",
    "atlas",
    "tracks",
    "light",
    "template",
    "engine",
    "scene",
    "script",
    "import",
    "manifest",
]
"""What an output is for, as the manifest states it.

``page`` and ``map`` are images; ``atlas``, ``tracks`` and ``light`` describe them to any client;
``template`` is what a user's own template made; ``engine``, ``scene`` and ``script`` are for one
engine. ``import`` holds the settings with which an engine imports another file. The engine and the
user write into it as well, so that a change there does not make a build stale; it is removed along
with the file it belongs to.
"""


@dataclass(frozen=True, slots=True)
class OutputFile:
    """A finished file that is not on the disk yet.

    Attributes:
        name: File name, without a folder.
        role: What it is for.
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
"""Longest file name, in UTF-8, that every file system has."""


def is_device(name: str) -> bool:
    """Return whether Windows takes a file called ``name`` for a device, whatever its ending."""
    return name.partition(".")[0].rstrip().casefold() in _DEVICES


def is_portable(name: str) -> bool:
    """Return whether every system can have a file called ``name``; Windows forbids the most."""
    return (
        name.isprintable()
        and _FORBIDDEN.isdisjoint(name)
        and not name.endswith((".", " "))
        and not is_device(name)
        and 0 < len(name.encode()) <= _MAX_NAME_BYTES
    )


MANIFEST_ENDING = ".manifest.json"
"""Ending of the names of manifests, which list the files of a build."""


def is_reserved(name: str) -> bool:
    """Return whether a file name is reserved for builds' own files, on any file system."""
    return name.startswith(".") or name.casefold().endswith(MANIFEST_ENDING)


_UNPRINTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]")


def plain_name(name: str) -> str:
    """Return ``name`` if it is a plain file name, without a folder on any system.

    ``a/b``, ``a\\b``, ``C:b`` and ``..`` are not, whatever system wrote them; nor are names with
    control characters or lone surrogates.

    Raises:
        ValueError: It is not, and might lead to another folder.
    """
    is_elsewhere = PureWindowsPath(name).name != name or not name.strip(".")
    if is_elsewhere or _UNPRINTABLE.search(name):
        raise ValueError(f"{name!a} is not a plain file name")
    return name
