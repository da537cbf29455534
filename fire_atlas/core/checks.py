"""Check values in files of this tool when they are read back.

The files may have been edited, truncated or forged, so every value is checked as it is read.
"""

from collections.abc import Sequence
from typing import Any, TypeVar

MAX_PIXELS = 1 << 15
"""Maximum length or coordinate accepted, px: twice the maximum side of a page."""

MAX_MILLISECONDS = 600_000.0
"""Maximum duration of a frame accepted."""

Choice = TypeVar("Choice", bound=str)


def whole(value: Any, low: int = 0, high: int = MAX_PIXELS) -> int:
    """Return ``value`` if it is a whole number from ``low`` to ``high``.

    Raises:
        ValueError: It is not.
    """
    if not isinstance(value, int):
        raise _out_of_range(value, low, high)
    number(value, low, high)
    return value


def number(value: Any, low: float, high: float) -> float:
    """Return ``value`` if it is a number from ``low`` to ``high``.

    Raises:
        ValueError: It is not.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        raise _out_of_range(value, low, high)
    return float(value)


def text(value: Any) -> str:
    """Return ``value`` if it is text that UTF-8 can encode.

    Raises:
        ValueError: It is not.
    """
    if not isinstance(value, str):
        raise ValueError(f"{_shown(value)} is not text")
    value.encode()
    return value


def one_of(value: Any, choices: Sequence[Choice]) -> Choice:
    """Return ``value`` if it is one of ``choices``.

    Raises:
        ValueError: It is not.
    """
    for choice in choices:
        if value == choice:
            return choice
    raise ValueError(f"{_shown(value)} is not one of {', '.join(choices)}")


def _out_of_range(value: Any, low: float, high: float) -> ValueError:
    return ValueError(f"{_shown(value)} is not a number from {low:g} to {high:g}")


def _shown(value: Any) -> str:
    shown = ascii(value)
    return shown if len(shown) <= 40 else f"{shown[:37]}..."
