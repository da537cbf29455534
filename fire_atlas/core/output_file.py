"""What a writer hands over: a file that is not on the disk yet, and what it is for."""

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


MANIFEST_ENDING = ".manifest.json"
"""Of the names of manifests, which say what belongs to a build."""


def is_reserved(name: str) -> bool:
    """Return whether a file name is one that builds keep for themselves, on any file system."""
    return name.startswith(".") or name.casefold().endswith(MANIFEST_ENDING)


def plain_name(name: str) -> str:
    """Return ``name``, which has to be that of a file without a folder, on any system.

    ``a/b``, ``a\\b``, ``C:b`` and ``..`` are none, whatever system wrote them.

    Raises:
        ValueError: It may lead elsewhere.
    """
    if PureWindowsPath(name).name != name or not name.strip("."):
        raise ValueError(f"{name!r} is no plain file name")
    return name
