"""What an exporter hands over: a file that is not written yet."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OutputFile:
    """A finished file.

    Attributes:
        name: File name, without a folder.
        role: What it is to the manifest, e.g. ``atlas`` or ``tracks``.
        data: Its content.
    """

    name: str
    role: str
    data: bytes
