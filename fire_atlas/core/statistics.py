"""Find the figures of each animation in the statistics of a manifest."""

from collections.abc import Iterator
from typing import Any

_NESTED = "animations", "members", "motions"
"""Keys under which figures are nested, by the names of animations or recipes."""


def by_animation(statistics: Any, name: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield figures with the name of the animation or recipe they belong to.

    The names of an animation and of its recipe are joined by "/". A single animation has the name
    "". Figures of a whole recipe come before those of its animations.

    Raises:
        ValueError: The statistics are not in that form.
    """
    if not isinstance(statistics, dict):
        raise ValueError(f"{statistics!r} are no statistics")
    yield name, statistics
    for several in _NESTED:
        inner = statistics.get(several)
        if isinstance(inner, dict):
            for key, figures in inner.items():
                yield from by_animation(figures, f"{name}/{key}" if name else key)
