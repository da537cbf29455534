"""Recipe blocks of what is written: atlas, maps, exports, tracks."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import AfterValidator, Discriminator, Field, model_validator

from fire_atlas.recipe.base import (
    BLOCK,
    GODOT,
    LIST,
    OFF,
    PAIR,
    TEMPLATE,
    UNDECIDED,
    UNITY,
    WORD,
    Settings,
    either,
)
from fire_atlas.recipe.problem import ContradictionError, KeyPath, Problem

ExportName = Literal[
    "json", "json-array", "phaser", "aseprite", "css", "tpsheet", "godot", "unity"
]  # fmt: skip
FlakeTrackName = Literal["json", "csv", "pcache", "hjson"]
TrackName = Literal[FlakeTrackName, "light"]

Engine = Literal["unity", "unreal", "godot"]
Layer = Literal["flame", "flakes"]

PivotName = Literal["base", "bottom", "center", "top"]

Pivot = Annotated[
    Annotated[PivotName, WORD]
    | Annotated[
        tuple[Annotated[float, Field(ge=-10, le=10)], Annotated[float, Field(ge=-10, le=10)]],
        LIST,
        PAIR,
    ],
    either("`base`, `bottom`, `center`, `top` or two numbers: [x, y]"),
]

GODOT_BLEED = 4
"""Default of ``atlas.bleed`` for straight pages with ``exports: [godot]``, px."""

_SMALLER = (0.5, 0.25, 0.125)


def _valid_scales(scales: tuple[float, ...]) -> tuple[float, ...]:
    """Validate ``scales``: 1 and halves of it, each once; largest first."""
    if 1 not in scales:
        raise ValueError("must hold 1: the pages at full size are always written")
    for scale in scales:
        if scale != 1 and scale not in _SMALLER:
            raise ValueError(
                f"must be of 1, 0.5, 0.25, 0.125, so that the same layout fits exactly; got "
                f"{scale:g}"
            )
    if len(set(scales)) < len(scales):
        raise ValueError("holds a scale twice")
    return tuple(sorted(scales, reverse=True))


class Atlas(Settings):
    """Pages: how frames are packed on them, and how their pixels are stored."""

    layout: Literal["packed", "grid"] = "packed"
    """``packed``: tight; ``grid``: uniform cells in playing order, row by row, that divide the
    page evenly, for engines and shaders that count cells."""
    max_size: int = Field(default=4096, ge=16, le=16384)
    """Largest side of a page, px."""
    pot: bool = False
    """Sides of pages are powers of two. In a grid, those of cells are too."""
    square: bool = False
    """Pages are as wide as high."""
    multiple_of: Literal[1, 2, 4] = 1
    """Sides of pages are multiples of this, px: 4 for block-compressed textures."""
    padding: int = Field(default=2, ge=0, le=64)
    """Empty px between neighbours. In a grid, the gutter: half of it on each side of a cell."""
    border: int = Field(default=0, ge=0, le=64)
    """Empty px along the edges of a page. None in a grid, whose cells divide the page evenly."""
    extrude: int = Field(default=0, ge=0, le=16)
    """Repeat the outermost px of every frame this often around it, so that a client which filters
    finds the same colour beyond its edge. For tiles and opaque frames."""
    bleed: int = Field(default=0, ge=0, le=64)
    """Give transparent px up to this far from a visible one its colour, so that filters and mips
    mix no black in. Alpha stays as it is. Only ``alpha: straight`` needs it. With
    ``exports: [godot]`` the default for straight pages is 4."""
    rotate: bool = False
    """Frames may be rotated by 90° on a page. Not every client can show them."""
    trim: Annotated[Literal["frame", "animation", "none"], OFF] = "frame"
    """Cut empty borders: of each ``frame``, by one box for the ``animation``, or not at all.
    Cells of a grid all show the same part, so that there ``frame`` means ``animation``."""
    trim_threshold: int = Field(default=0, ge=0, le=254)
    """Borders where alpha (or light, on pages that add it) is at most this, of 255, count as
    empty."""
    dedupe: bool = True
    """Frames with the same pixels share one place. Not in a grid, nor with ``maps``."""
    pivot: Pivot = "base"
    """The point of the frame that a client puts where the effect is: the foot of the flame
    (``base``), the ``bottom``, ``center`` or ``top`` of the frame, or [x, y] in frame widths and
    heights from its top-left corner."""
    scales: Annotated[
        tuple[Annotated[float, Field(gt=0, le=1)], ...],
        LIST,
        Field(min_length=1, max_length=4),
        AfterValidator(_valid_scales),
    ] = (1.0,)
    """Sizes to write everything in: 1 and any of 0.5, 0.25, 0.125. All share one layout; smaller
    ones are filtered in linear light and called ``name@0.5x``."""
    members: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], LIST] = ()
    """Other recipes whose effects go onto these pages too, relative to the recipe file. Of their
    ``atlas``, ``maps``, ``exports`` and ``tracks``, only this recipe's count."""
    format: Literal["png", "webp"] = "png"
    """Files of the pages; ``webp`` is lossless."""
    compression: Literal["fast", "small"] = "fast"
    """Pages and their files: ``fast`` to make, or as ``small`` as possible (PNG needs the extra
    ``small``)."""
    alpha: Literal["straight", "premultiplied", "additive"] = "straight"
    """How coverage is stored. ``additive``: light on black with alpha 0."""
    blend_space: Literal["srgb", "linear"] = "srgb"
    """Where the client blends: ``srgb`` (Godot 2D, Pixi, Phaser, canvas, Unity gamma) or
    ``linear`` (Unity linear)."""

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if problems := (*_grid_contradictions(self), *_pixel_contradictions(self)):
            raise ContradictionError(*problems)
        return self


class Maps(Settings):
    """Further images in the layout of the pages, each called after its page."""

    motion: Annotated[Literal["unity", "unreal", "godot", "none"], OFF] = "none"
    """Motion vectors of the flame, ``name.motion.png``, as this engine's shaders read them: they
    move each frame into the next, so that a flipbook plays smoothly however slowly. ``unity`` and
    ``unreal`` count in cells and need ``atlas.layout: grid``; so does the shader for ``godot``."""
    flame: bool = False
    """The flame without flakes, ``name.flame.png``."""
    flakes: bool = False
    """The flakes alone, ``name.flakes.png``."""

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The layers that are switched on."""
        switches: dict[Layer, bool] = {"flame": self.flame, "flakes": self.flakes}
        return tuple(layer for layer, wanted in switches.items() if wanted)


class TemplateExport(Settings):
    """A file of your own form, from a Jinja2 template."""

    template: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """The template, relative to the recipe file. ``fire-atlas inspect --context`` shows what it
    sees."""
    to: str = Field(min_length=1, max_length=200)
    """Name of the file it becomes, a template too: ``{{ name }}.ext``."""


class GodotOptions(Settings):
    """Options of the files for Godot."""

    version: Literal[4, 3] = 4
    """Major version of the engine; each reads its own text alone."""


class GodotExport(Settings):
    """The export ``godot`` with options."""

    godot: GodotOptions
    """Options of the files for Godot."""


DEFAULT_NAMESPACE = "FireAtlas"

_KEYWORDS = """
abstract as base bool break byte case catch char checked class const continue decimal default
delegate do double else enum event explicit extern false finally fixed float for foreach goto if
implicit in int interface internal is lock long namespace new null object operator out override
params private protected public readonly ref return sbyte sealed short sizeof stackalloc static
string struct switch this throw true try typeof uint ulong unchecked unsafe ushort using virtual
void volatile while
"""
"""Keywords of C#, which cannot be names."""

_FOREIGN = ("System", "UnityEngine", "UnityEditor")
"""Namespaces of .NET and Unity: one of the same name would hide them from scripts inside it."""


def _usable_namespace(namespace: str) -> str:
    """Validate a namespace, whose form is sound."""
    for word in namespace.split("."):
        if word in _KEYWORDS.split():
            raise ValueError(f"{word} is a keyword of C#; choose another name")
        if word in _FOREIGN:
            raise ValueError(f"{word} is a namespace of .NET or Unity; choose a name of your own")
    return namespace


NAMESPACE_PATTERN = r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$"


class UnityOptions(Settings):
    """Options of the files for Unity."""

    pixels_per_unit: float = Field(default=100.0, ge=0.01, le=100000)
    """Pixels of the full-size frame that are one unit long in the scene."""
    flakes: bool = True
    """Write the flakes' tracks, and a component that plays them."""
    namespace: Annotated[
        str,
        Field(max_length=100, pattern=NAMESPACE_PATTERN),
        AfterValidator(_usable_namespace),
    ] = DEFAULT_NAMESPACE
    """C# namespace of the component; GUIDs and the names of shaders are made from it too. Two
    recipes of one name in one Unity project need two."""
    assembly: bool = False
    """Write an assembly definition for the output folder, called as the namespace. Unity allows
    one a folder, and scripts in folders below belong to it too."""

    @model_validator(mode="after")
    def _name_the_assembly(self) -> Self:
        if self.assembly and self.namespace == DEFAULT_NAMESPACE:
            problem = Problem(
                ("assembly",),
                "needs a `namespace` of your own, another for each folder: Unity allows an "
                "assembly's name once in a project",
            )
            raise ContradictionError(problem)
        return self


class UnityExport(Settings):
    """The export ``unity`` with options."""

    unity: UnityOptions
    """Options of the files for Unity."""


EngineExport: TypeAlias = GodotExport | UnityExport
"""An engine's files, with options: a mapping whose only key names the engine."""

_BRANCHES = {
    "godot": GODOT.tag,
    "unity": UNITY.tag,
    "template": TEMPLATE.tag,
    "to": TEMPLATE.tag,
}
"""Branch of an export that is a mapping, by a key that only it has."""


def _mapping_branch(export: Any) -> str | None:
    keys = export if isinstance(export, dict) else type(export).model_fields
    return next((branch for key, branch in _BRANCHES.items() if key in keys), None)


_EXPORTS = "the name of a format, {godot: ...}, {unity: ...}, or {template: ..., to: ...}"

Export = Annotated[
    Annotated[ExportName, WORD]
    | Annotated[
        Annotated[
            Annotated[TemplateExport, TEMPLATE]
            | Annotated[GodotExport, GODOT]
            | Annotated[UnityExport, UNITY],
            Discriminator(
                _mapping_branch,
                custom_error_type=UNDECIDED,
                custom_error_message=f"must be {_EXPORTS}",
            ),
        ],
        BLOCK,
    ],
    either(_EXPORTS),
]


def export_name(export: Export) -> str:
    """Return what a recipe calls an export: a word, or the first key of a mapping."""
    return export if isinstance(export, str) else next(iter(type(export).model_fields))


def exports_called(
    exports: Sequence[Export], *names: ExportName
) -> Iterator[tuple[KeyPath, Export]]:
    """Yield the exports that have one of ``names``, each with its key path in the recipe."""
    for i, export in enumerate(exports):
        if export_name(export) in names:
            yield ("exports", i), export


def _grid_contradictions(atlas: Atlas) -> Iterator[Problem]:
    if atlas.layout != "grid":
        return
    if atlas.rotate:
        yield Problem(
            ("rotate",), "a grid shows every frame upright; use layout packed, or leave rotate out"
        )
    if atlas.border:
        yield Problem(
            ("border",), "the cells of a grid divide the page evenly; padding is their gutter"
        )
    if atlas.dedupe and "dedupe" in atlas.model_fields_set:
        yield Problem(
            ("dedupe",), "a grid has one cell for every frame; use layout packed, or leave it out"
        )


def _pixel_contradictions(atlas: Atlas) -> Iterator[Problem]:
    if 2 * atlas.border >= atlas.max_size:
        yield Problem(
            ("border",), f"two of {atlas.border} px leave nothing of max_size {atlas.max_size}"
        )
    if atlas.bleed and atlas.alpha != "straight":
        yield Problem(
            ("bleed",),
            f"alpha {atlas.alpha} needs none; colour under transparent pixels would be added to "
            f"the picture",
        )
    if atlas.trim_threshold and atlas.trim == "none":
        yield Problem(("trim_threshold",), "nothing is cut with trim none; leave one of them out")
