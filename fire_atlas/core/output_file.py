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
