"""Which kinds of maps there are, and what is known of each before its pixels.

To add a map: a key in ``Maps`` of ``recipe/output.py``, a module with its ``Maker``
(``maps/maker.py``), and a row in ``KINDS``. Kept free of heavy imports, for ``fire-atlas check``.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

from fire_atlas.recipe.gpu import Channels
from fire_atlas.recipe.output import Atlas, Maps
from fire_atlas.recipe.problem import Problem
from fire_atlas.recipe.source import FramesSource, ProfileSource, Source, SpritesSource

Contradiction: TypeAlias = Callable[[Maps, Atlas, bool], str | None]
"""Returns why pages with these settings cannot have a map, and what would let them; the last
argument says whether any effect on the pages may have flakes."""


@dataclass(frozen=True, slots=True)
class MapKind:
    """A kind of map.

    Attributes:
        name: Its key in a recipe, ``kind`` in the JSON, and the ending of its files.
        module: The module of this package that makes it, imported when a recipe asks for it.
        holds: ``colours``, which are drawn and encoded like the pages', or ``data``, which
            importers must not change.
        channels: Number of channels of 8 bits that clients read; 0 if they read floats.
        image_format: Ending of its files; None if it is that of the pages.
        is_under: Whether it is drawn under the page, of which it was a part: it covers what is
            behind it.
        is_cut: Whether only what is near the visible part of a frame is kept of it.
        contradictions: What keeps pages from having it.
        missing_in: Why a source has nothing to show in it, and what would help; None if it has.
    """

    name: str
    module: str
    holds: Literal["colours", "data"]
    channels: Channels = 4
    image_format: str | None = None
    is_under: bool = False
    is_cut: bool = False
    contradictions: tuple[Contradiction, ...] = ()
    missing_in: Callable[[Source], str | None] = lambda source: None

    def is_wanted(self, maps: Maps) -> bool:
        """Return whether a recipe asks for it."""
        return getattr(maps, self.name) not in (False, "none")

    def ending(self, page_format: str) -> str:
        """Return what ends the names of its files, beside pages of that format."""
        return f".{self.name}.{self.image_format or page_format}"


def _vectors_need_cells(maps: Maps, atlas: Atlas, _: bool) -> str | None:
    if maps.motion == "godot" or atlas.layout == "grid":
        return None
    return (
        f"{maps.motion} motion vectors need a flipbook with cells of equal size; "
        f"set atlas.layout to grid"
    )


def _vectors_stand_upright(_: Maps, atlas: Atlas, __: bool) -> str | None:
    if not atlas.rotate:
        return None
    return "vectors cannot be read from frames that lie rotated; leave out atlas.rotate"


def _form_stands_upright(_: Maps, atlas: Atlas, __: bool) -> str | None:
    if not atlas.rotate:
        return None
    return "frames that lie rotated would face other ways; leave out atlas.rotate"


def _would_be(content: str) -> Contradiction:
    """Return what refuses a map that would be of no use without flakes."""

    def contradiction(_: Maps, __: Atlas, has_flakes: bool) -> str | None:
        if has_flakes:
            return None
        return f"this effect has no flakes, so this map would be {content}; leave it out"

    return contradiction


def _smoke_of(source: Source) -> str | None:
    if not isinstance(source, ProfileSource):
        return None
    return (
        "a profile is learnt from flame alone and has no smoke; leave this map out, or use "
        "the clip itself (source.kind: frames)"
    )


def _form_of(source: Source) -> str | None:
    if not isinstance(source, FramesSource):
        return None
    return (
        "frames are flat pictures, whose form is not known; make fire with form by "
        "source.kind: silk or source.kind: profile, or leave this map out"
    )


KINDS = (
    MapKind(
        "motion", "motion", "data",
        channels=2,
        contradictions=(_vectors_need_cells, _vectors_stand_upright),
    ),
    MapKind("haze", "haze", "data", channels=2, contradictions=(_vectors_stand_upright,)),
    MapKind("flame", "layer", "colours", contradictions=(_would_be("a copy of the page"),)),
    MapKind("flakes", "layer", "colours", contradictions=(_would_be("empty"),)),
    MapKind("smoke", "layer", "colours", is_under=True, missing_in=_smoke_of),
    MapKind("emission", "emission", "data", channels=0, image_format="exr"),
    MapKind("normals", "form", "data", is_cut=True,
            contradictions=(_form_stands_upright,), missing_in=_form_of),
    MapKind("depth", "form", "data", channels=1, is_cut=True,
            contradictions=(_form_stands_upright,), missing_in=_form_of),
)  # fmt: skip
"""All kinds, in the order in which files state and builds write them."""

KIND = {kind.name: kind for kind in KINDS}
"""The same by name."""


def kinds_in(maps: Maps) -> tuple[MapKind, ...]:
    """Return the kinds that a recipe asks for."""
    return tuple(kind for kind in KINDS if kind.is_wanted(maps))


def map_problems(maps: Maps, atlas: Atlas, has_flakes: bool) -> Iterator[Problem]:
    """Yield a problem for each map that pages with these settings cannot have.

    ``has_flakes``: whether any effect on the pages may have flakes.
    """
    for kind in kinds_in(maps):
        for contradiction in kind.contradictions:
            if why := contradiction(maps, atlas, has_flakes):
                yield Problem(("maps", kind.name), why)
    if maps != Maps() and atlas.dedupe and "dedupe" in atlas.model_fields_set:
        yield Problem(
            ("maps",),
            "frames that look alike may differ in their maps, so each has a place of its own; "
            "leave out atlas.dedupe, or set it to false",
        )


def maps_without_source(maps: Maps, source: Source | None) -> Iterator[Problem]:
    """Yield a problem for each map that a source has nothing for."""
    if source is None:
        return
    if isinstance(source, SpritesSource):
        for kind in kinds_in(maps):
            yield Problem(
                ("maps", kind.name),
                "is of fire, but sprites are only packed; leave it out, or pack them on pages of "
                "their own",
            )
        return
    for kind in kinds_in(maps):
        if why := kind.missing_in(source):
            yield Problem(("maps", kind.name), why)
