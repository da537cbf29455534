"""What an exporter hands over: a file that is not written yet."""

from dataclasses import dataclass


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
