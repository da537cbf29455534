"""What an exporter hands over: a file that is not written yet."""

from dataclasses import dataclass
from pathlib import PureWindowsPath


@dataclass(frozen=True, slots=True)
class OutputFile:
    """A finished file.

    Attributes:
        name: File name, without a folder.
        role: What it is to the manifest, e.g. ``atlas`` or ``tracks``; ``import`` for files
            that their engine and people go on writing in.
        data: Its content.
    """

    name: str
    role: str
    data: bytes


def plain_name(name: str) -> str:
    """Return ``name``, which has to be that of a file without a folder, on any system.

    Raises:
        ValueError: It may lead elsewhere.
    """
    if PureWindowsPath(name).name != name or not name.strip("."):
        raise ValueError(f"{name!r} is no plain file name")
    return name
