"""Recipe blocks of the asset half: atlas, exports, tracks."""

from collections.abc import Sequence
from importlib.util import find_spec
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
from fire_atlas.recipe.godot import GodotOptions
from fire_atlas.recipe.unity import UnityOptions

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

UPRIGHT_ONLY: frozenset[ExportName] = frozenset(
    {"phaser", "aseprite", "css", "tpsheet", "godot", "unity"}
)
"""Exports whose clients cannot show a frame that lies turned on its page."""

_WEBP_SIDE = 16383
_SMALLER = (0.5, 0.25, 0.125)


def _all_sizes(scales: tuple[float, ...]) -> tuple[float, ...]:
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
    """The pages."""

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
    mix no black in. Alpha stays as it is. Only ``alpha: straight`` needs it."""
    rotate: bool = False
    """Frames may lie turned by 90° on a page. Not every client can show them."""
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
        AfterValidator(_all_sizes),
    ] = (1.0,)
    """Sizes to write everything in: 1 and any of 0.5, 0.25, 0.125. All share one layout; smaller
    ones are filtered in linear light and called ``name@0.5x``."""
    members: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], LIST] = ()
    """Other recipes whose effects go onto these pages too, relative to the recipe file. Of their
    ``atlas``, ``maps``, ``exports`` and ``tracks``, only this recipe's count."""
    format: Literal["png", "webp"] = "png"
    """Files of the pages; ``webp`` is lossless."""
    compression: Literal["fast", "small"] = "fast"
    """Pages and their files: ``fast`` to make, or as ``small`` as can be had (PNG needs the extra
    ``small``)."""
    alpha: Literal["straight", "premultiplied", "additive"] = "straight"
    """How coverage is stored. ``additive``: light on black with alpha 0."""
    blend_space: Literal["srgb", "linear"] = "srgb"
    """Where the client blends: ``srgb`` (Godot 2D, Pixi, Phaser, canvas, Unity gamma) or
    ``linear`` (Unity linear)."""

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if problem := _grid_problem(self) or _pixel_problem(self):
            raise ValueError(problem)
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
        """The layers that are asked for."""
        asked: dict[Layer, bool] = {"flame": self.flame, "flakes": self.flakes}
        return tuple(layer for layer, wanted in asked.items() if wanted)


class TemplateExport(Settings):
    """A file of your own form, from a Jinja2 template."""

    template: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """The template, relative to the recipe file. ``fire-atlas inspect --context`` shows what it
    sees."""
    to: str = Field(min_length=1, max_length=200)
    """Name of the file it becomes, a template too: ``{{ name }}.ext``."""


class GodotExport(Settings):
    """The export ``godot`` with options."""

    godot: GodotOptions
    """What Godot is to be given."""


class UnityExport(Settings):
    """The export ``unity`` with options."""

    unity: UnityOptions
    """What Unity is to be given."""


EngineExport: TypeAlias = GodotExport | UnityExport
"""An engine's files, with options: a mapping whose only key names the engine."""

_TELLING = {
    "godot": GODOT.tag,
    "unity": UNITY.tag,
    "template": TEMPLATE.tag,
    "to": TEMPLATE.tag,
}
"""Branch of an export that is a mapping, by the key that tells it."""


def _mapping(export: Any) -> str | None:
    keys = export if isinstance(export, dict) else type(export).model_fields
    return next((branch for key, branch in _TELLING.items() if key in keys), None)


_EXPORTS = "the name of a format, {godot: ...}, {unity: ...}, or {template: ..., to: ...}"

Export = Annotated[
    Annotated[ExportName, WORD]
    | Annotated[
        Annotated[
            Annotated[TemplateExport, TEMPLATE]
            | Annotated[GodotExport, GODOT]
            | Annotated[UnityExport, UNITY],
            Discriminator(
                _mapping, custom_error_type=UNDECIDED, custom_error_message=f"must be {_EXPORTS}"
            ),
        ],
        BLOCK,
    ],
    either(_EXPORTS),
]


def export_name(export: Export) -> str:
    """Return what a recipe calls an export: a word, or the first key of a mapping."""
    return export if isinstance(export, str) else next(iter(type(export).model_fields))


def export_problem(
    atlas: Atlas, exports: Sequence[Export], tracks: Sequence[TrackName]
) -> str | None:
    """Say which export cannot describe such pages or live beside such files, and why."""
    for export in exports:
        name = export_name(export)
        if atlas.rotate and name in UPRIGHT_ONLY:
            return (
                f"exports: {name} cannot be had with atlas.rotate: its clients show frames as "
                f"they lie on the page; set atlas.rotate to false"
            )
        if name == "css" and (atlas.alpha, atlas.blend_space) != ("straight", "srgb"):
            return (
                f"exports: css cannot be had with atlas.alpha {atlas.alpha} and blend_space "
                f"{atlas.blend_space}: browsers blend images with straight alpha in sRGB"
            )
        if name == "unity" and atlas.format == "webp":
            return "exports: unity cannot be had with atlas.format webp: Unity imports PNG"
        is_godot_3 = isinstance(export, GodotExport) and export.godot.version == 3
        if is_godot_3 and (problem := _godot_3_problem(atlas, tracks)):
            return problem
    return None


def _godot_3_problem(atlas: Atlas, tracks: Sequence[TrackName]) -> str | None:
    if atlas.blend_space == "linear":
        return (
            "exports: Godot 3 draws its 2D in sRGB, so that pages cannot have atlas.blend_space "
            "linear; use srgb, or version 4 in a project with HDR 2D"
        )
    if "csv" in tracks:
        return (
            "exports: Godot 3 takes every CSV file for translations and fails to import it; leave "
            "csv out of tracks, which the scene does not need"
        )
    return None


def maps_problem(maps: Maps, atlas: Atlas, has_flakes: bool) -> str | None:
    """Say which map cannot be had with such pages, and why."""
    if maps.motion in ("unity", "unreal") and atlas.layout != "grid":
        return (
            f"maps.motion: {maps.motion} moves one cell into the next, and in a packed layout no "
            f"two are alike; set atlas.layout to grid"
        )
    if maps.motion != "none" and atlas.rotate:
        return "maps.motion: vectors cannot be read from frames that lie turned; leave out rotate"
    if (maps.flame or maps.flakes) and not has_flakes:
        layer = "flame" if maps.flame else "flakes"
        return f"maps.{layer}: with flakes none the page itself is the flame; leave it out"
    if maps != Maps() and atlas.dedupe and "dedupe" in atlas.model_fields_set:
        return (
            "maps: frames that look alike may differ in their maps, so each has a place of its "
            "own; leave out atlas.dedupe, or set it to false"
        )
    return None


def missing_extra(atlas: Atlas) -> str | None:
    """Say what has to be installed before such pages can be written, if anything."""
    if (atlas.format, atlas.compression) != ("png", "small") or find_spec("oxipng"):
        return None
    return (
        "atlas.compression: small needs oxipng for PNG pages: pip install 'fire-atlas[small]', or "
        "set atlas.compression to fast, or atlas.format to webp"
    )


def _grid_problem(atlas: Atlas) -> str | None:
    if atlas.layout != "grid":
        return None
    if atlas.rotate:
        return "rotate: a grid shows every frame upright; use layout packed, or leave rotate out"
    if atlas.border:
        return "border: the cells of a grid divide the page evenly; padding is their gutter"
    if atlas.dedupe and "dedupe" in atlas.model_fields_set:
        return "dedupe: a grid has one cell for every frame; use layout packed, or leave it out"
    return None


def _pixel_problem(atlas: Atlas) -> str | None:
    if 2 * atlas.border >= atlas.max_size:
        return f"border: two of {atlas.border} px leave nothing of max_size {atlas.max_size}"
    if atlas.bleed and atlas.alpha != "straight":
        return (
            f"bleed: alpha {atlas.alpha} needs none; colour under transparent pixels would be "
            f"added to the picture"
        )
    if atlas.trim_threshold and atlas.trim == "none":
        return "trim_threshold: nothing is cut with trim none; leave one of them out"
    if atlas.format == "webp" and atlas.max_size > _WEBP_SIDE:
        return f"max_size: a WebP has at most {_WEBP_SIDE} px a side; got {atlas.max_size}"
    return None
