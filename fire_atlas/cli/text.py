"""Make text from outside safe to print.

File names, image metadata and text in recipes may contain characters that a terminal interprets:
escape sequences, line breaks, marks that reverse the direction. All printed text passes through
here, except JSON, which escapes them anyway.
"""

_SPACES = frozenset("\u00a0\u202f\u3000")
"""Spaces that are harmless, although Python does not count them as printable."""


def printable(text: str) -> str:
    """Return one line of text in which invisible characters are escaped as in Python.

    An escape becomes ``\\x1b``, a byte of a file name that is not UTF-8 ``\\udcff``.
    """
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() or char in _SPACES else repr(char)[1:-1] for char in text
    )
