"""Figures of a build's files and animations, in the statistics of its manifest."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import TypeAdapter, ValidationError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Figures = TypeVar("Figures", bound="DataclassInstance")

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


def figures_entry(key: str, figures: Mapping[str, "DataclassInstance"]) -> dict[str, Any]:
    """Return what a manifest states under ``key``: figures by name; nothing if there are none."""
    return {key: {name: asdict(figure) for name, figure in figures.items()}} if figures else {}


def read_figures(statistics: dict[str, Any], key: str, kind: type[Figures]) -> dict[str, Figures]:
    """Return what the statistics of a manifest state under ``key``, by name.

    Raises:
        ValueError: They are not figures of that kind.
    """
    try:
        return TypeAdapter(dict[str, kind]).validate_python(statistics.get(key, {}))  # type: ignore[valid-type]
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in (key, *first["loc"]))
        raise ValueError(f"{place}: {first['msg']}") from None
