"""Recipe block ``source``: where the fire comes from."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import (
    AS_SOURCE,
    BY_KIND,
    DIFFERENT,
    FLUID,
    FRAMES,
    LIST,
    NUMBER,
    OFF,
    PAIR,
    PROFILE,
    SILK,
    SPRITES,
    WORD,
    Auto,
    Off,
    Settings,
    either,
)
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.frame_size import FrameSize
from fire_atlas.recipe.pivot import PivotPoint
from fire_atlas.recipe.problem import ContradictionError, Problem
from fire_atlas.recipe.silk import SilkSource

_Place = Annotated[int, Field(ge=0, le=16384)]
_Length = Annotated[int, Field(ge=1, le=16384)]

Crop = Annotated[
    Off | Auto | Annotated[tuple[_Place, _Place, _Length, _Length], LIST, PAIR],
    either("`none`, `auto` or four whole numbers: [x, y, width, height]"),
    OFF,
]
Black = Annotated[
    Auto | Annotated[float, Field(ge=0, lt=255), NUMBER],
    either("`auto` or a number from 0 up to 255"),
]
FrameHeight = Annotated[
    Auto | Annotated[Literal["source"], AS_SOURCE] | Annotated[_Length, NUMBER],
    either("`auto`, `source` or a whole number"),
]


class Grid(Settings):
    """The cells of a sprite sheet: how many there are, or how large each is."""

    columns: int | None = Field(default=None, ge=1, le=1024)
    """Cells per row. Their size follows from the image, and need not be whole pixels."""
    rows: int | None = Field(default=None, ge=1, le=1024)
    """Rows of cells."""
    cell: Annotated[tuple[_Length, _Length], LIST] | None = None
    """Width and height of a cell, px, instead of ``columns`` and ``rows``, which follow from the
    image: what is left of it beyond the last whole cell is not used."""
    margin: int = Field(default=0, ge=0, le=16384)
    """Width of the border around all cells, px."""
    spacing: int = Field(default=0, ge=0, le=16384)
    """Distance between neighbouring cells, px."""

    @model_validator(mode="after")
    def _states_cells_once(self) -> Self:
        if problems := tuple(self._unclear_cells()):
            raise ContradictionError(*problems)
        return self

    def _unclear_cells(self) -> Iterator[Problem]:
        counts = {"columns": self.columns, "rows": self.rows}
        given = [key for key, count in counts.items() if count is not None]
        if self.cell is not None and given:
            yield Problem(
                ("cell",),
                f"gives the size of cells, from which {' and '.join(given)} would follow; remove "
                f"cell, or {' and '.join(given)}",
            )
        elif self.cell is None and not given:
            yield Problem(
                (), "needs either columns and rows, or the size of a cell: cell: [64, 64]"
            )
        elif self.cell is None and len(given) == 1:
            other = "rows" if given == ["columns"] else "columns"
            yield Problem((other,), f"is missing beside {given[0]}; a single one is {other}: 1")


class ClipInput(Settings):
    """The files of a clip, and which of its frames to use."""

    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """A folder of images, a glob (``fire_*.png``), one image, a sprite sheet (with ``grid``), the
    JSON of an atlas (TexturePacker, Aseprite, PixiJS, Phaser or this tool), a GIF, APNG or animated
    WebP, or a video. Relative to the recipe file."""
    grid: Grid | None = None
    """Cut ``path`` (one image) into cells, left to right, top to bottom."""
    layer: str | None = Field(default=None, min_length=1)
    """Layer, or part, of EXR files to read, such as ``ViewLayer.Combined``. Default: R, G and B
    without a layer; else the only layer with colours; else the only one whose name ends as that of
    a finished picture does (``Combined``, ``rgba``, ``rgb``, ``C``, ``beauty``, ``color``)."""
    fps: float | None = Field(default=None, ge=0.01, le=240)
    """Frames per second. Default: as the file states; 24 for folders and sheets. Drawings with
    uneven delays get the lowest rate, up to 60, at which each begins within half a frame of its
    time; at a stated rate, each frame shows the drawing of its middle."""
    start: int = Field(default=0, ge=0)
    """First frame to use, counted from 0."""
    count: int | None = Field(default=None, ge=1)
    """Number of frames to use. Default: all from ``start`` on."""
    matte: Annotated[Literal["auto", "alpha", "luminance", "none"], OFF] = "auto"
    """Source of the frames' transparency: their own ``alpha``, their ``luminance`` (fire on black:
    light becomes alpha, colour is un-multiplied), or ``none`` (an opaque scene). ``auto`` chooses
    by a few frames of the whole clip, ``start`` and ``count`` aside, and reports why."""
    black: Black = "auto"
    """Level of the footage's black for ``matte: luminance``, 0-255. It is taken off, and what is
    above stretched, so that white stays white. ``auto``: found in the same few frames, for each
    channel, with its noise; 0 if nothing dark is flat enough to be a background. Of a dark room it
    also takes off the veil of the wall, and what stands in it stays opaque."""


class FramesSource(ClipInput):
    """Frames that were drawn, filmed or rendered."""

    kind: Literal["frames"] = "frames"
    """Frames that exist already: one clip."""
    animation: str | None = Field(default=None, min_length=1)
    """Which animation, or tag, of an atlas to use, if ``path`` is its JSON. Default: the only one;
    all frames if the JSON names none."""
    crop: Crop = "none"
    """Use only a part of the frames: ``[x, y, width, height]``, px of the file, from the top-left
    corner. ``auto``: the box around all that is ever flame, with a margin; it looks at every frame,
    so a video is decoded twice. With ``matte: luminance`` no edge is seen: the box grows by glow
    that ends nearby, and light that reaches a side all the same, or leaves the footage there,
    fades out."""
    height: FrameHeight = "auto"
    """Resize frames to this height, px, in proportion. ``source``: no resizing. ``auto``: images,
    sheets and animations keep their size; a video taller than 512 px is reduced to 512, and
    further until its frames fit one page of ``atlas.max_size``, but never below 256."""
    sampling: Literal["smooth", "nearest"] = "smooth"
    """Filter for resizing: ``smooth``, or ``nearest`` for pixel art."""


PROFILE_SUFFIX = ".json"
"""File extension of profiles, whose source takes no other JSON."""


class ProfileSource(ClipInput):
    """New fire, generated from what is learnt from a short clip."""

    kind: Literal["profile"] = "profile"
    """Fire learnt from a clip (or a profile file), of any length, in any wind, from any side."""
    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """The clip to learn from, 8-60 frames of one fire, in any form that source ``frames`` reads but
    the JSON of an atlas; or a profile written by ``fire-atlas learn`` (``candle.profile.json``):
    here a ``.json`` is always that. Relative to the recipe file."""
    side_path: str | None = Field(default=None, min_length=1, pattern=r"^[^\x00]+$")
    """A clip of the same fire seen from its right, at a right angle to ``path``. ``grid``,
    ``layer``, ``fps``, ``start``, ``count``, ``matte`` and ``black`` apply to both. Default: all
    sides look like ``path``."""
    threshold: float | None = Field(default=None, gt=0, lt=255)
    """Pixels of the clip that are brighter than this, 0-255, are flame. Default: found from the
    clip."""
    cells: int = Field(default=5, ge=2, le=32)
    """Rows, and columns, of the colour table that is learnt."""
    slices: int = Field(default=12, ge=1, le=64)
    """Number of vertical slices of fire around the axis."""
    particles: int = Field(default=100, ge=4, le=2000)
    """Number of particles alive in each slice."""
    detail: float = Field(default=1.0, ge=0, le=1)
    """Share of the clip's own detail in the picture. 0: the particles alone, soft and in the
    colours of the table, as in the paper. 1: all of the clip's detail, which the same six points
    move and whose moments the particles mix."""
    size: FrameSize | None = None
    """Length of the frames' longer side: ``draft`` 192 px, ``game`` 384 px, ``hero`` 512 px. The
    other is as long as the fire needs. Default: as ``height`` says, which is refused beside it."""
    height: int | None = Field(default=None, ge=16, le=4096)
    """Height of the frames, px. Default: the fire is as large as in the clip; a video taller than
    512 px counts as one of 512 px."""

    @model_validator(mode="after")
    def _states_its_frame_once(self) -> Self:
        if self.size is not None and self.height is not None:
            raise ContradictionError(
                Problem(("size",), "says how large frames are, as height does; remove one of them")
            )
        return self

    def keys_of_learning(self) -> list[str]:
        """Return the keys given that say how to learn from a clip, if ``path`` is no clip but a
        profile, which has been learnt already."""
        learning = {*ClipInput.model_fields, "threshold", "cells"} - {"path"}
        if not self.path.lower().endswith(PROFILE_SUFFIX):
            return []
        return sorted(learning & self.model_fields_set)

    def keys_of_generating(self) -> list[str]:
        """Return the keys given that say how fire is generated, which ``learn`` does not do."""
        return sorted({"slices", "particles", "detail", "size", "height"} & self.model_fields_set)


_Path = Annotated[str, Field(min_length=1, pattern=r"^[^\x00]+$")]
_SpritePaths = Annotated[
    Annotated[_Path, WORD]
    | Annotated[tuple[_Path, ...], LIST, Field(min_length=1), DIFFERENT, PAIR],
    either("a path, or a list of paths"),
]
_BorderWidth = Annotated[int, Field(ge=0, le=16384)]


class SpritesSource(Settings):
    """Pictures of any sizes, which are packed as they are, under their own names."""

    kind: Literal["sprites"] = "sprites"
    """Icons, buttons and other sprites, for packing alone: no matte, no loop search, no flakes."""
    path: _SpritePaths
    """A folder with all its subfolders, a glob (``ui/**/*.png``), an image, or a list of these.
    Relative to the recipe file."""
    names: Literal["path", "stem", "file"] = "path"
    """What sprites are called. ``path``: the way to the file from the folder that ``path`` names,
    without its ending: ``hud/close``. ``stem``: the file's name alone, ``close``. ``file``: the
    way with its ending, ``hud/close.png``. Two of one name are refused."""
    animations: Annotated[Literal["auto", "none"], OFF] = "auto"
    """``auto``: two sprites and more whose names differ in consecutive numbers from 0 or 1 are an
    animation too: ``coin_01`` and ``coin_02`` are ``coin``. ``none``: all are single sprites."""
    rates: dict[str, Annotated[float, Field(ge=0.01, le=240)]] = Field(default={})
    """Frames per second of animations by their names: ``{coin: 12}``. Default: 24."""
    pivots: dict[str, PivotPoint] = Field(default={})
    """Pivots of sprites by their names, or for all frames of an animation by its name: [x, y] in
    widths and heights of the sprite, from its top-left corner: ``{hud/close: [0.5, 1]}``. Default:
    ``atlas.pivot``, whose ``base`` is the middle of a sprite."""
    borders: dict[
        str, Annotated[tuple[_BorderWidth, _BorderWidth, _BorderWidth, _BorderWidth], LIST]
    ] = Field(default={})
    """Borders of nine-patches, which keep their size where the middle is stretched, by name, or for
    all frames of an animation by its name: [left, top, right, bottom], px. A picture called
    ``panel.9.png`` is the sprite ``panel`` and has them in the black lines of its outermost px.
    Sprites with a border are not trimmed."""

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths, of which there may be one."""
        return (self.path,) if isinstance(self.path, str) else self.path

    @model_validator(mode="after")
    def _rates_of_animations(self) -> Self:
        if self.rates and self.animations == "none":
            raise ContradictionError(
                Problem(("rates",), "are of animations, and animations is none; remove one of them")
            )
        return self


Source = Annotated[
    Annotated[FramesSource, FRAMES]
    | Annotated[ProfileSource, PROFILE]
    | Annotated[SilkSource, SILK]
    | Annotated[FluidSource, FLUID]
    | Annotated[SpritesSource, SPRITES],
    BY_KIND,
]
"""A source of any kind; the key ``kind`` picks the model."""


class Views(Settings):
    """Cameras on a 3D fire, spread evenly around its vertical axis."""

    count: int = Field(default=1, ge=1, le=64)
    """Number of views. The camera of view k is at 360°·k/count, counter-clockwise seen from above.
    If there are several, frames are called ``name/view_0/0000``."""
    elevation: float = Field(default=0.0, ge=-90, le=90)
    """Elevation of the cameras above the horizon, degrees."""
    distance: float | None = Field(default=None, ge=1, le=1000)
    """Distance of the cameras from the fire, heights: what is nearer appears larger. Sizes are
    exact in the middle of the fire. Default: infinitely far, all lines of sight are parallel. Only
    for ``kind: silk`` and ``fluid``."""
