"""Text that comes from others, made fit to be printed.

Names of files, metadata of images and text in recipes may hold what a terminal obeys: escape
sequences, line breaks, marks that reverse what follows. All that is printed passes through here,
but for JSON, which escapes these by itself.
"""

_SPACES = frozenset("\u00a0\u202f\u3000")
"""Spaces of other scripts. Python counts them as not printable; they do no harm."""


def printable(text: str) -> str:
    """Return one line of text in which whatever is no visible character is spelled as in Python.

    An escape becomes ``\\x1b``, a byte of a file name that is no UTF-8 ``\\udcff``.
    """
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() or char in _SPACES else repr(char)[1:-1] for char in text
    )
