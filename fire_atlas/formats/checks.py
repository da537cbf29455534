"""Values of files that are read back, held to what their writers write.

A file may have been edited, cut short, or written by somebody who wishes ill: each value that is
reckoned with is checked where it enters.
"""

from collections.abc import Sequence
from typing import Any, TypeVar

MOST_PIXELS = 1 << 15
"""Largest length or place that is read, px: images have at most half of that."""

MOST_MILLISECONDS = 600_000.0
"""Longest time a frame is shown: more is not said in a GIF."""

Choice = TypeVar("Choice", bound=str)


def whole(value: Any, low: int = 0, high: int = MOST_PIXELS) -> int:
    """Return ``value``, which has to be a whole number in ``low`` to ``high``.

    Raises:
        ValueError: It is not.
    """
    if not isinstance(value, int):
        raise _out_of_range(value, low, high)
    number(value, low, high)
    return value


def number(value: Any, low: float, high: float) -> float:
    """Return ``value``, which has to be a number in ``low`` to ``high``.

    Raises:
        ValueError: It is not.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        raise _out_of_range(value, low, high)
    return float(value)


def text(value: Any) -> str:
    """Return ``value``, which has to be text that can be written in UTF-8.

    Raises:
        ValueError: It is not.
    """
    if not isinstance(value, str):
        raise ValueError(f"{_shown(value)} is no text")
    value.encode()
    return value


def one_of(value: Any, choices: Sequence[Choice]) -> Choice:
    """Return ``value``, which has to be one of ``choices``.

    Raises:
        ValueError: It is not.
    """
    for choice in choices:
        if value == choice:
            return choice
    raise ValueError(f"{_shown(value)} is none of {', '.join(choices)}")


def _out_of_range(value: Any, low: float, high: float) -> ValueError:
    return ValueError(f"{_shown(value)} is no number from {low:g} to {high:g}")


def _shown(value: Any) -> str:
    shown = ascii(value)
    return shown if len(shown) <= 40 else f"{shown[:37]}..."
