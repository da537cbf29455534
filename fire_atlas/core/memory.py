"""How the C library gives memory back to the system."""

import ctypes

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h

_LARGE = 4 << 20
"""Size, bytes, from which memory is returned to the system as soon as it is freed, unless a caller
has larger pieces that it makes again and again."""

LARGEST = 32 << 20
"""The largest pieces that glibc can keep, bytes."""

_KEPT = 256 << 20
"""Maximum of smaller pieces, bytes in all, that are kept for the next ones."""


def keep_freed_memory(smaller_than: int = _LARGE) -> None:
    """Let glibc keep freed pieces of memory that are ``smaller_than`` so many bytes, at most
    ``LARGEST``, for the next ones; with another C library, do nothing.

    Arrays of a few 100 kB are made and freed thousands of times. By default their memory comes from
    the system anew each time, page by page, which takes a tenth of the time to draw many flakes.
    """
    try:  # musl and macOS lack it, and Windows has no CDLL(None)
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    set_option(_M_MMAP_THRESHOLD, smaller_than)
    set_option(_M_TRIM_THRESHOLD, _KEPT)
