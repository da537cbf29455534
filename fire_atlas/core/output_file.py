"""What a writer hands over: a file that is not on the disk yet, and what it is for."""

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

``page`` and ``map`` are images; ``atlas``, ``tracks`` and ``light`` describe them to any client,
``template`` to that of the user's own template; ``engine``, ``scene`` and ``script`` are one
engine's. ``import`` says how an engine imports another file: the engine and people go on writing
in it, so other bytes there are no reason to build again, and it goes with the file it is about.
"""


@dataclass(frozen=True, slots=True)
class OutputFile:
    """A finished file.

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
_LONGEST = 255
"""Bytes in UTF-8."""


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
        and 0 < len(name.encode()) <= _LONGEST
    )


MANIFEST_ENDING = ".manifest.json"
"""Of the names of manifests, which say what belongs to a build."""


def is_reserved(name: str) -> bool:
    """Return whether a file name is one that builds keep for themselves, on any file system."""
    return name.startswith(".") or name.casefold().endswith(MANIFEST_ENDING)


_UNPRINTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]")


def plain_name(name: str) -> str:
    """Return ``name``, which has to be that of a file without a folder, on any system.

    ``a/b``, ``a\\b``, ``C:b`` and ``..`` are none, whatever system wrote them; nor is what holds
    control characters, or is no text.

    Raises:
        ValueError: It may lead elsewhere.
    """
    is_elsewhere = PureWindowsPath(name).name != name or not name.strip(".")
    if is_elsewhere or _UNPRINTABLE.search(name):
        raise ValueError(f"{name!a} is no plain file name")
    return name
