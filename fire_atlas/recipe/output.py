"""Recipe blocks of the outputs: atlas, maps, exports, tracks, movies."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, model_validator

from fire_atlas.recipe.base import (
    AUTO,
    BLOCK,
    CSS,
    DIFFERENT,
    LIST,
    NUMBER,
    OFF,
    PAIR,
    TEMPLATE,
    UNDECIDED,
    UNITY,
    WORD,
    Off,
    Settings,
    different,
    either,
)
from fire_atlas.recipe.gpu import GpuFormat, GpuQuality, Mips, Supercompression
from fire_atlas.recipe.pivot import PivotPoint
from fire_atlas.recipe.problem import ContradictionError, KeyPath, Problem

ExportName = Literal[
    "json", "json-array", "phaser", "aseprite", "css", "tpsheet", "godot", "unity"
]  # fmt: skip
"""Export formats by name; ``godot`` and ``unity`` write a project's files for that engine."""

FlakeTrackName = Literal["json", "csv", "pcache", "hjson"]
TrackName = Literal[FlakeTrackName, "light"]
MovieName = Literal["webm", "webp", "apng", "gif", "mp4"]
Engine = Literal["unity", "unreal", "godot"]
"""Engines with a convention of their own for motion vectors."""

PivotName = Literal["base", "bottom", "center", "top"]

Pivot = Annotated[
    Annotated[PivotName, WORD] | Annotated[PivotPoint, PAIR],
    either("`base`, `bottom`, `center`, `top` or two numbers: [x, y]"),
]

MAX_PAGE_SIDE = 16384
"""Largest ``atlas.max_size``, px."""

_MAX_WEBP_SIDE = 16383
"""Maximum side of a WebP, px: its header stores it in 14 bits."""

GODOT_BLEED = 4
"""Default of ``atlas.bleed`` for straight pages with ``exports: [godot]``, px."""

Quality = Annotated[
    Annotated[Literal["lossless"], WORD] | Annotated[int, Field(ge=1, le=100), NUMBER],
    either("`lossless` or a whole number from 1 to 100"),
]


TrimMargin = Annotated[
    Annotated[Literal["auto"], AUTO] | Annotated[int, Field(ge=0, le=16), NUMBER],
    either("`auto` or a whole number from 0 to 16"),
]


_RampName = Annotated[str, Field(min_length=1, pattern=r"^[^\x00]+$")]

Ramp = Annotated[
    Annotated[_RampName, WORD]
    | Annotated[
        tuple[_RampName, ...],
        LIST,
        Field(min_length=1, max_length=64),
        DIFFERENT,
        PAIR,
    ],
    either("the name of a ramp, the path of an image, or a list of these"),
]

_SMALLER = (0.5, 0.25, 0.125)


def _valid_scales(scales: tuple[float, ...]) -> tuple[float, ...]:
    """Return ``scales``, largest first; refuse them without 1, and unknown or double ones."""
    if 1 not in scales:
        raise ValueError("must hold 1: the pages at full size are always written")
    for scale in scales:
        if scale != 1 and scale not in _SMALLER:
            raise ValueError(
                f"must be of 1, 0.5, 0.25, 0.125, so that the same layout fits exactly; got "
                f"{scale:g}"
            )
    return tuple(sorted(different(scales), reverse=True))


class MeshSettings(Settings):
    """Tight meshes: frames are drawn as polygons, so that less is drawn that shows nothing."""

    vertices: int = Field(default=8, ge=4, le=32)
    """Maximum number of vertices of a frame's mesh. Of the samples, 8 cover at most 1.08 of the
    convex hull of what is visible, and 16 mostly less than the hull: they follow hollows."""


MeshOrNone = Annotated[
    Off | Annotated[MeshSettings, BLOCK], either("`none` or a block of settings"), OFF
]


class PageGrid(Settings):
    """The cells of every page of a grid."""

    columns: int = Field(ge=1, le=512)
    """Cells per row."""
    rows: int = Field(ge=1, le=512)
    """Rows of cells."""


class Atlas(Settings):
    """The pages: how frames are packed on them, and how their pixels are stored."""

    layout: Literal["packed", "grid"] = "packed"
    """``packed``: tightly packed. ``grid``: uniform cells in playing order, row by row, that
    divide the page evenly, for engines and shaders that count cells."""
    grid: PageGrid | None = None
    """Of ``layout: grid``, the number of cells of every page, for clients with a fixed one; cells
    that no frame fills stay empty. Default: as many as there are frames, on the smallest page."""
    max_size: int = Field(default=4096, ge=16, le=MAX_PAGE_SIDE)
    """Maximum width and height of a page, px."""
    max_pages: Annotated[
        Off | Annotated[int, Field(ge=1, le=1024), NUMBER],
        either("`none` or a whole number from 1 to 1024"),
        OFF,
    ] = "none"
    """A build that needs more pages than this fails and says what would be enough. ``none``: any
    number, with a note if it is more than one."""
    pot: bool = False
    """Width and height of pages are powers of two. In a grid, so are those of cells."""
    square: bool = False
    """Pages are square."""
    multiple_of: Literal[1, 2, 4] = 1
    """Width and height of pages are multiples of this, px; 4 for block-compressed textures."""
    padding: int = Field(default=2, ge=0, le=64)
    """Empty px between neighbours. In a grid, the gutter: half of it on each side of a cell."""
    border: int = Field(default=0, ge=0, le=64)
    """Empty px along the edges of a page. None in a grid, whose cells divide the page evenly."""
    extrude: int = Field(default=0, ge=0, le=16)
    """Repeat the outermost px of every frame this many times around it, so that texture filtering
    finds the same colour beyond the edge. For tiles and opaque frames."""
    bleed: int = Field(default=0, ge=0, le=64)
    """Give transparent px the colour of a visible one at most this many px away, so that filters
    and mips mix no black in. Alpha does not change. Only ``alpha: straight`` needs it; its default
    is 4 with ``exports: [godot]``."""
    rotate: bool = False
    """Frames may be rotated by 90° on a page. Not every client supports that."""
    trim: Annotated[Literal["frame", "animation", "none"], OFF] = "frame"
    """Cut off empty borders: of each ``frame``, of the whole ``animation`` by one box, or ``none``.
    All cells of a grid show the same part, so there ``frame`` means ``animation``."""
    trim_threshold: int = Field(default=0, ge=0, le=254)
    """Borders count as empty where alpha (for ``alpha: additive``, light) is at most this, of
    255."""
    trim_margin: TrimMargin = "auto"
    """Transparent px of a frame (at full size) that trimming keeps around what is visible, so that
    hard edges stay smooth where a client turns them or shows them between pixels. ``auto``: 1 of
    sprites, of flat and pixel art and with ``mesh``, else 0. A frame that is visible up to its own
    border has none there."""
    mesh: MeshOrNone = "none"
    """Tight polygons around what is visible of each frame (above ``trim_threshold``), drawn instead
    of rectangles by Godot 4 and Unity, and listed in all JSON. ``fire-atlas inspect`` prints how
    much less is drawn."""
    dedupe: bool = True
    """Frames with equal pixels are stored once. Not in a grid, nor with ``maps``."""
    pivot: Pivot = "base"
    """The point of the frame that a client places at the position of the effect: the foot of the
    flame or the middle of a sprite (``base``), the ``bottom``, ``center`` or ``top`` of the frame,
    or [x, y] in frame widths and heights (not px) from its top-left corner, each from -2 to 3."""
    scales: Annotated[
        tuple[Annotated[float, Field(gt=0, le=1)], ...],
        LIST,
        Field(min_length=1, max_length=4),
        AfterValidator(_valid_scales),
    ] = (1.0,)
    """Sizes to write everything in: 1 and any of 0.5, 0.25, 0.125. All have the same layout.
    Smaller ones are filtered in linear light and called ``name@0.5x``."""
    members: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], LIST] = ()
    """Other recipes, relative to the recipe file, whose effects share these pages. This recipe's
    ``atlas``, ``maps``, ``exports``, ``tracks`` and ``movies`` replace theirs."""
    format: Literal["png", "webp"] = "png"
    """File format of the pages. ``webp`` is lossless unless ``quality`` is a number."""
    bits: Literal[8, 16] = 8
    """Bits a channel of the pages and their layers. 16 keeps smooth gradients where a client grades
    or brightens them; only ``format: png`` has them. Maps of vectors keep 8."""
    quality: Quality = "lossless"
    """Of ``format: webp``: ``lossless``, or 1 to 100, which makes files much smaller by changing
    colours. Alpha stays exact, and so do motion vectors; the build states how far colours are off.
    80 suits filmed and rendered fire; pixel art loses its edges, and may be smaller lossless."""
    compression: Literal["fast", "small"] = "fast"
    """Write pages ``fast``, or pack and compress them as ``small`` as possible (PNG then needs
    ``fire-atlas[small]`` installed, and has a palette where at most 256 colours with alpha allow
    it)."""
    gpu: Annotated[tuple[GpuFormat, ...], LIST, DIFFERENT] = ()
    """Also write each image as compressed textures, which stay small in a GPU's memory, with mip
    levels: ``bc7.dds``, ``astc-6x6.ktx2``, ... (``fire-atlas[gpu]`` must be installed). Cells then
    lie on whole blocks, and far enough apart for these mips. Motion vectors take BC5 instead of
    other BC formats, heat BC4; EAC RG11 and R11 instead of ETC2. Colours keep most with ``alpha:
    premultiplied``; straight ones lose up to 8 dB of it."""
    mips: Mips = "auto"
    """Number of mip levels in the files of ``gpu``, the page itself included; ``auto`` is 3. The
    layout keeps frames apart at up to 5 of them. Levels beyond these are written, for clients that
    need all levels down to 1 px, but mix frames."""
    supercompression: Annotated[Supercompression, OFF] = "none"
    """Compress the KTX2 files of ``gpu`` once more, for smaller downloads. ``zstd``: by Zstandard,
    which clients unpack as they load; a GPU's memory stays the same."""
    gpu_quality: GpuQuality = "final"
    """How well ``gpu`` is encoded. ``draft``: in a fraction of the time, with larger errors, to
    look at; ``watch`` and ``preview`` take it unless the recipe says otherwise."""
    pixels: Literal["color", "heat", "heat4"] = "color"
    """What pages store. ``color``: red, green, blue and alpha. ``heat``: one value a pixel, from
    which a shader looks the colour up in ``name.ramp.png``: a quarter of the memory, cross-fades
    that keep to the fire's hues, and colours that a game exchanges. ``heat4``: the same for clients
    without textures of one channel, four consecutive frames in R, G, B and A of one cell."""
    ramp: Ramp = "learnt"
    """Of ``pixels: heat`` and ``heat4``, the colours by heat: ``learnt`` (those of the clip),
    ``campfire``, ``gas``, ``copper``, ``poison``, ``soul``, ``frost``, ``blackbody``, or an image,
    of which the row in the middle is read from left to right; several in a list: the rows of
    ``name.ramp.png``."""
    alpha: Literal["straight", "premultiplied", "additive"] = "straight"
    """How alpha is stored. ``straight``, the default, is what most clients expect.
    ``premultiplied``: light and what it hides are stored apart, so that thin fire does not darken
    what is behind it; the default of fire for Godot and Unity alone, whose files bring the
    material, and with ``pixels: heat``. ``additive``: light on black, alpha 0. Ramps are
    ``premultiplied`` or ``additive``."""
    cover: Literal["auto", "full"] = "auto"
    """What light hides of what is behind it, with ``alpha: premultiplied``. ``auto``: less where
    the fire is thin, so that it does not darken a bright background; smoke, wood and drawn art hide
    as they are. ``full``: as much as it is bright, as straight pages do."""
    blend_space: Literal["srgb", "linear"] = "srgb"
    """Encoding in which the client blends: ``srgb`` (Godot 2D, Pixi, Phaser, canvas, Unity gamma)
    or ``linear`` (Unity linear)."""

    @property
    def thins(self) -> bool:
        """Whether thin light hides less than it shines."""
        return self.alpha == "premultiplied" and self.cover == "auto"

    @property
    def largest_size(self) -> int:
        """The largest ``max_size`` that files of this format can have, px."""
        return _MAX_WEBP_SIDE if self.format == "webp" else MAX_PAGE_SIDE

    @property
    def ramps(self) -> tuple[str, ...]:
        """The ramps, one for each row of the file."""
        return (self.ramp,) if isinstance(self.ramp, str) else self.ramp

    @model_validator(mode="before")
    @classmethod
    def _premultiply_ramps(cls, given: Any) -> Any:
        """Give ``alpha`` its default for ramps, whose neighbours a filter mixes."""
        if isinstance(given, dict) and given.get("pixels") in ("heat", "heat4"):
            return {"alpha": "premultiplied", **given}
        return given

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        groups = _grid_contradictions, _pixel_contradictions, _heat_contradictions
        if problems := tuple(problem for group in groups for problem in group(self)):
            raise ContradictionError(*problems)
        return self


class Maps(Settings):
    """Further images with the layout of the pages, each named after its page."""

    motion: Annotated[Literal["unity", "unreal", "godot", "none"], OFF] = "none"
    """Motion vectors of the flame, ``name.motion.png``, encoded for the shaders of this engine.
    Shaders warp each frame into the next by them, so that a flipbook plays smoothly at any speed.
    ``unity``, ``unreal`` and the scene for ``godot`` need ``atlas.layout: grid``."""
    flame: bool = False
    """The flame without flakes, ``name.flame.png``."""
    flakes: bool = False
    """The flakes alone, ``name.flakes.png``."""
    haze: bool = False
    """The refraction of the hot air in the flame and above it, ``name.haze.png``: how far it shifts
    what is seen through it, as vectors for a distortion shader. The frames on the pages get larger
    by the hot air above the flame."""
    emission: Annotated[Literal["exr", "none"], OFF] = "none"
    """Light brighter than white, for engines that render in HDR: ``exr`` writes what the pages show
    as linear light before the shoulder of their exposure, ``name.emission.exr``, premultiplied, as
    half floats. Needs ``fire-atlas[exr]`` installed."""
    smoke: bool = False
    """The smoke as a layer under the fire, ``name.smoke.png``: grey, with the share of the light
    behind it that it keeps back as alpha. The pages then hold the fire without it. For clips with
    alpha of their own. For ``source.kind: silk`` it is the soot in the flame, black: no smoke rises
    over it."""
    normals: bool = False
    """The direction that the front of the fire faces, ``name.normals.png``, for lights: red is
    right, green up, blue towards the viewer. For ``source.kind: silk`` and ``profile``."""
    depth: bool = False
    """How far the front of the fire is before the plane through its foot, ``name.depth.png``, for
    soft particles; the JSON states the range. For ``source.kind: silk`` and ``profile``."""


class TemplateExport(Settings):
    """A file in your own format, written by a Jinja2 template."""

    template: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """The template, relative to the recipe file. ``fire-atlas inspect --context`` shows its
    variables."""
    to: str = Field(min_length=1, max_length=200)
    """Name of the file to write, itself a template: ``{{ name }}.ext``."""


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
"""Namespaces of .NET and Unity. Scripts in a namespace of the same name could not use them."""


def _usable_namespace(namespace: str) -> str:
    """Refuse a namespace with a keyword of C# or a name of .NET or Unity."""
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
    """Pixels of the full-size frame per unit of the scene."""
    flakes: bool = True
    """Write the flakes' tracks, and a component that plays them."""
    namespace: Annotated[
        str,
        Field(max_length=100, pattern=NAMESPACE_PATTERN),
        AfterValidator(_usable_namespace),
    ] = DEFAULT_NAMESPACE
    """C# namespace of the component; also part of GUIDs and shader names. Two recipes with the same
    name in one Unity project need different namespaces."""
    assembly: bool = False
    """Write an assembly definition for the output folder, named like the namespace. Unity allows
    one per folder, and scripts in subfolders belong to it too."""

    player: Literal["own", "package"] = "own"
    """Scripts and shaders of the prefab. ``own``: written beside it, for this fire alone.
    ``package``: those of the package that ``fire-atlas plugin unity`` copies into a project, for
    all fires; the prefab then has the component ``FireAtlasPlayer`` and, with ``light`` among the
    ``tracks``, a lamp."""

    @model_validator(mode="after")
    def _name_the_assembly(self) -> Self:
        if self.assembly and self.player == "package":
            problem = Problem(
                ("assembly",),
                "has no scripts to hold with player: package; remove it",
            )
            raise ContradictionError(problem)
        if self.assembly and self.namespace == DEFAULT_NAMESPACE:
            problem = Problem(
                ("assembly",),
                "needs a `namespace` of your own, a different one for each folder: names of "
                "assemblies must be unique in a Unity project",
            )
            raise ContradictionError(problem)
        return self


class UnityExport(Settings):
    """The export ``unity`` with options."""

    unity: UnityOptions
    """Options of the files for Unity."""


class CssOptions(Settings):
    """Options of the style sheet."""

    density: float = Field(default=1.0, ge=0.25, le=8)
    """Px of the page for each px of CSS, in width and height: 2 shows the page at half its size, as
    sharp as a screen with twice as many pixels can."""


class CssExport(Settings):
    """The export ``css`` with options."""

    css: CssOptions
    """Options of the style sheet."""


_BRANCHES = {
    "css": CSS.tag,
    "unity": UNITY.tag,
    "template": TEMPLATE.tag,
    "to": TEMPLATE.tag,
}
"""Tag of an export that is a mapping, by a key that only this export has."""


def _mapping_branch(export: Any) -> str | None:
    keys = export if isinstance(export, dict) else type(export).model_fields
    return next((branch for key, branch in _BRANCHES.items() if key in keys), None)


def _without_options_of_godot(export: Any) -> Any:
    """Refuse ``{godot: ...}``, in which older recipes state the version of Godot."""
    if not isinstance(export, dict) or export.keys() != {"godot"}:
        return export
    options = export["godot"]
    if isinstance(options, dict) and options.get("version") == 3:
        problem = Problem(
            ("godot", "version"),
            "Godot 3 is not supported any more; write `godot` alone for Godot 4, or use the export "
            "json",
        )
    else:
        problem = Problem(
            ("godot",),
            "has no options, as Godot 4 is the only version; leave them out and write `godot`",
        )
    raise ContradictionError(problem)


_EXPORTS = "the name of a format, {unity: ...}, {css: ...}, or {template: ..., to: ...}"

Export = Annotated[
    Annotated[ExportName, WORD]
    | Annotated[
        Annotated[
            Annotated[TemplateExport, TEMPLATE]
            | Annotated[UnityExport, UNITY]
            | Annotated[CssExport, CSS],
            Discriminator(
                _mapping_branch,
                custom_error_type=UNDECIDED,
                custom_error_message=f"must be {_EXPORTS}",
            ),
        ],
        BLOCK,
    ],
    either(_EXPORTS),
    BeforeValidator(_without_options_of_godot),
]


def export_name(export: Export) -> str:
    """Return the name of an export: the word itself, or the first key of a mapping."""
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
        if atlas.grid is not None:
            yield Problem(("grid",), "has cells only with layout: grid; set that, or remove grid")
        return
    if atlas.grid is not None and atlas.pot:
        for key, count in atlas.grid:
            if count & (count - 1):
                yield Problem(
                    ("grid", key),
                    f"must be a power of two with pot, which makes pages and cells such; use "
                    f"{1 << count.bit_length() - 1} or {1 << count.bit_length()}, or remove pot",
                )
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
    if atlas.cover == "full" and atlas.alpha != "premultiplied":
        yield Problem(
            ("cover",),
            f"is of premultiplied pages, where it can be chosen; set alpha: premultiplied, or "
            f"leave it out: pages with alpha {atlas.alpha} cover "
            f"{'as much as they shine' if atlas.alpha == 'straight' else 'nothing'}",
        )
    if atlas.mips != "auto" and not atlas.gpu:
        yield Problem(
            ("mips",), "are the levels of compressed textures; list some in gpu, or leave it out"
        )
    if atlas.gpu_quality == "draft" and not atlas.gpu:
        yield Problem(
            ("gpu_quality",), "is of compressed textures; list some in gpu, or leave it out"
        )
    if atlas.supercompression != "none" and not any(
        format_.endswith(".ktx2") for format_ in atlas.gpu
    ):
        yield Problem(
            ("supercompression",),
            "is of KTX2 files; list some in gpu, like bc7.ktx2, or leave it out",
        )
    if atlas.trim_threshold and atlas.trim == "none":
        yield Problem(("trim_threshold",), "nothing is cut with trim none; leave one of them out")
    if atlas.trim_margin != "auto" and atlas.trim == "none":
        yield Problem(("trim_margin",), "nothing is cut with trim none; leave one of them out")


def _heat_contradictions(atlas: Atlas) -> Iterator[Problem]:
    """Yield what pages of heat cannot have, and ramps for pages without heat."""
    if atlas.pixels == "color":
        if atlas.ramps != ("learnt",):
            yield Problem(("ramp",), "gives heat its colours; set pixels to heat or heat4")
        return
    if atlas.alpha == "straight":
        yield Problem(
            ("alpha",), "the colours of ramps are premultiplied or additive; leave alpha out"
        )
    if atlas.bits == 16:
        yield Problem(("bits",), "heat has 8 bits, one value for each colour; leave it out")
    if atlas.pixels == "heat4" and atlas.mesh != "none":
        yield Problem(
            ("mesh",), "four frames lie in one cell, whose shapes differ; use heat, or leave it out"
        )
