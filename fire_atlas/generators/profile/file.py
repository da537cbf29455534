"""Write and read profile files: JSON that holds everything learnt from a clip of fire.

Of each side, values that people read or edit come first: the colour table (edited ``colours``
recolour the generated fire), statistics, feature points, leaning sets. The detail follows as base64
grey PNGs.
"""

import base64
import binascii
import io
import json
from typing import Annotated, Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes, hex_to_srgb, srgb_to_hex
from fire_atlas.core.version import __version__
from fire_atlas.generators.profile.model import (
    FLOW_CELL,
    FLOW_UNIT,
    MAX_FRAMES,
    MIN_FRAMES,
    NODES,
    SHADE_LEVELS,
    ClipStatistics,
    ColourTable,
    DetailGrid,
    DetailModel,
    FeaturePoints,
    LeaningSet,
    Origin,
    Percentiles,
    Period,
    PoseCurves,
    Profile,
    Side,
)
from fire_atlas.recipe.base import COLOR_PATTERN

_FORMAT: Literal["fire-atlas/profile"] = "fire-atlas/profile"
_VERSION: Literal[3] = 3

_Share = Annotated[float, Field(ge=0, le=1)]
_Size = Annotated[float, Field(gt=0, le=1e5)]
_Point = tuple[float, float]
_Points = Annotated[tuple[_Point, ...], Field(min_length=6, max_length=6)]
_Curve = Annotated[tuple[float, ...], Field(min_length=NODES, max_length=NODES)]
_Curves = Annotated[tuple[_Curve, ...], Field(min_length=1, max_length=MAX_FRAMES)]


class _Block(BaseModel):
    """An object of the file; unknown keys, NaN and infinity are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _ColoursBlock(_Block):
    cells: int = Field(ge=2, le=32)
    rows: tuple[tuple[Annotated[str, Field(pattern=COLOR_PATTERN)], ...], ...]
    coverage: tuple[tuple[_Share, ...], ...]

    @classmethod
    def of(cls, table: ColourTable) -> "_ColoursBlock":
        rows = tuple(tuple(map(srgb_to_hex, row)) for row in table.colours)
        coverage = tuple(tuple(round(float(c), 3) for c in row) for row in table.coverage)
        return cls(cells=len(rows), rows=rows, coverage=coverage)

    def table(self) -> ColourTable:
        """Return the colour table; raise ``ValueError`` if it is not square."""
        size = self.cells
        if [len(row) for row in (*self.rows, *self.coverage)] != [size] * 2 * size:
            raise ValueError(f"a colour table of {size} cells needs {size} rows of {size}")
        colours = np.stack([hex_to_srgb(row) for row in self.rows])
        return ColourTable(colours, np.array(self.coverage, np.float32))


class _GridBlock(_Block):
    up: int = Field(ge=4, le=1024)
    down: int = Field(ge=1, le=512)
    side: int = Field(ge=2, le=2048)
    per_height: float = Field(ge=8, le=1024)
    per_half: float = Field(ge=0.1, le=2048)


class _StatisticsBlock(_Block):
    height: tuple[_Size, _Size, _Size]
    width: tuple[_Size, _Size, _Size]
    lean: tuple[float, float, float]
    brightness: tuple[float, float, float]
    step: float = Field(ge=0)


class _SetBlock(_Block):
    low: float
    high: float
    period: Period
    origin: Origin
    shear: float = Field(ge=-90, le=90)
    frames: Annotated[tuple[int, ...], Field(min_length=1)]


class _SideBlock(_Block):
    frames: int = Field(ge=MIN_FRAMES, le=MAX_FRAMES)
    fps: float = Field(gt=0, le=1000)
    closed: bool
    threshold: float = Field(ge=0, le=255)
    colours: _ColoursBlock
    colours_as_learnt: _ColoursBlock
    statistics: _StatisticsBlock
    sets: Annotated[tuple[_SetBlock, ...], Field(min_length=12, max_length=12)]
    points: tuple[_Points, ...]
    points_as_learnt: tuple[_Points, ...]
    leans: tuple[Annotated[float, Field(ge=-90, le=90)], ...]
    half: float = Field(gt=0, le=100)
    autocorrelation: _Share
    correlation_length: float = Field(ge=0, le=4096)
    offset: _Curves
    ratio: _Curves
    scores: str
    shades: str
    flow: str


class _ProfileBlock(_Block):
    format: Literal["fire-atlas/profile"]
    version: Literal[3]
    tool: str
    rise: float = Field(ge=0.01, le=100)
    grid: _GridBlock
    sides: Annotated[tuple[_SideBlock, ...], Field(min_length=1, max_length=2)]


def write_profile(profile: Profile) -> bytes:
    """Return the content of a profile file."""
    grid = profile.grid
    file = _ProfileBlock(
        format=_FORMAT,
        version=_VERSION,
        tool=f"fire-atlas {__version__}",
        rise=profile.rise_speed,
        grid=_GridBlock(
            up=grid.rows_above, down=grid.rows_below, side=grid.half_columns,
            per_height=grid.cells_per_height, per_half=grid.cells_per_half,
        ),
        sides=tuple(_side_block(side) for side in profile.sides),
    )  # fmt: skip
    return (_text(file.model_dump(mode="json")) + "\n").encode()


def read_profile(data: bytes, name: str) -> Profile:
    """Read a profile from the bytes of a file; messages call the file ``name``.

    Raises:
        SourceError: The file is damaged, not a profile, or of another version.
    """
    again = "learn it again with: fire-atlas learn CLIP -o NAME.profile.json"
    try:
        values = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{name}: is damaged or not a fire profile ({error}); {again}") from None
    if not isinstance(values, dict) or values.get("format") != _FORMAT:
        raise SourceError(f"{name}: is not a fire profile; {again}")
    version = values.get("version")
    if isinstance(version, int) and version > _VERSION:
        raise SourceError(
            f"{name}: is a profile of version {version}, but this fire-atlas reads "
            f"only up to {_VERSION}; update fire-atlas, or {again}"
        )
    if isinstance(version, int) and version < _VERSION:
        raise SourceError(
            f"{name}: is a profile of version {version}, which has the colours of one side alone; "
            f"{again}"
        )
    try:
        file = _ProfileBlock.model_validate(values)
        block = file.grid
        grid = DetailGrid(block.up, block.down, block.side, block.per_height, block.per_half)
        sides = [_side(side, grid) for side in file.sides]
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise SourceError(f"{name}: is damaged at {where}: {first['msg']}; {again}") from None
    except ValueError as error:
        raise SourceError(f"{name}: is damaged: {error}; {again}") from None
    side = sides[1] if len(sides) > 1 else None
    return Profile(grid, file.rise, sides[0], side)


def _side_block(side: Side) -> _SideBlock:
    detail, statistics = side.detail, side.statistics
    return _SideBlock(
        frames=detail.count,
        fps=side.fps,
        closed=side.closed,
        threshold=side.threshold,
        colours=_ColoursBlock.of(side.colours),
        colours_as_learnt=_ColoursBlock.of(side.learnt_colours),
        statistics=_StatisticsBlock(
            height=statistics.height,
            width=statistics.width,
            lean=statistics.lean,
            brightness=statistics.brightness,
            step=statistics.step,
        ),
        sets=tuple(
            _SetBlock(
                low=s.low,
                high=s.high,
                period=s.period,
                origin=s.origin,
                shear=s.shear,
                frames=s.frames,
            )
            for s in side.sets
        ),
        points=side.points,
        points_as_learnt=side.learnt_points,
        leans=side.leans,
        half=side.half_width,
        autocorrelation=detail.autocorrelation,
        correlation_length=detail.correlation_length,
        offset=tuple(map(tuple, side.pose.offset.tolist())),
        ratio=tuple(map(tuple, side.pose.width_ratio.tolist())),
        scores=_packed(detail.scores),
        shades=_packed(np.moveaxis(detail.shades, 3, 1)),
        flow=_packed((np.moveaxis(detail.flow, 3, 1) / FLOW_UNIT + 128).astype(np.uint8)),
    )


def _side(block: _SideBlock, grid: DetailGrid) -> Side:
    """Return the side in a block; raise ``ValueError`` where its parts contradict each other."""
    count, statistics = block.frames, block.statistics
    for name in ("points", "points_as_learnt", "leans", "offset", "ratio"):
        if (items := len(getattr(block, name))) != count:
            raise ValueError(f"{name}: has {items} items for {count} frames")
    learnt = block.colours_as_learnt.table()
    colours = learnt if block.colours == block.colours_as_learnt else block.colours.table()
    if colours.colours.shape != learnt.colours.shape:
        raise ValueError("colours: must have as many cells as colours_as_learnt")
    if not all(0 <= frame < count for leaning_set in block.sets for frame in leaning_set.frames):
        raise ValueError(f"sets: there are only frames 0 to {count - 1}")
    learnt_points = tuple(FeaturePoints(*places) for places in block.points_as_learnt)
    points = tuple(FeaturePoints(*places) for places in block.points)
    return Side(
        fps=block.fps,
        closed=block.closed,
        threshold=block.threshold,
        points=learnt_points if points == learnt_points else points,
        learnt_points=learnt_points,
        leans=block.leans,
        statistics=ClipStatistics(
            Percentiles(*statistics.height), Percentiles(*statistics.width),
            Percentiles(*statistics.lean), Percentiles(*statistics.brightness), statistics.step,
        ),
        sets=tuple(
            LeaningSet(s.low, s.high, s.period, s.origin, s.shear, s.frames) for s in block.sets
        ),
        colours=colours,
        learnt_colours=learnt,
        half_width=block.half,
        pose=PoseCurves(
            np.clip(np.array(block.offset), -2, 2), np.clip(np.array(block.ratio), 0.5, 2)
        ),
        detail=_detail(block, grid),
    )  # fmt: skip


def _detail(block: _SideBlock, grid: DetailGrid) -> DetailModel:
    count, (rows, columns) = block.frames, grid.shape
    levels = min(SHADE_LEVELS, count)
    coarse = -(-rows // FLOW_CELL), -(-columns // FLOW_CELL)
    flow = _unpacked("flow", block.flow, (count, 2, *coarse)).astype(np.float32)
    shades = _unpacked("shades", block.shades, (levels, 4, rows, columns))
    return DetailModel(
        scores=_unpacked("scores", block.scores, (count, rows, columns)),
        shades=np.ascontiguousarray(np.moveaxis(shades, 1, 3)),
        flow=np.moveaxis((flow - 128) * np.float32(FLOW_UNIT), 1, 3),
        autocorrelation=block.autocorrelation,
        correlation_length=block.correlation_length,
    )


def _packed(array: Bytes) -> str:
    """Encode an array as a grey PNG in base64; its pictures are stacked vertically."""
    done, data = cv2.imencode(".png", np.ascontiguousarray(array).reshape(-1, array.shape[-1]))
    assert done, "a grey picture can always be encoded"
    return base64.b64encode(data.tobytes()).decode()


def _unpacked(name: str, text: str, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Decode an array of ``shape`` from ``text``; raise ``ValueError`` if it holds none."""
    try:
        data = base64.b64decode(text, validate=True)
        with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            # Check the size before decoding: a few bytes can expand to a huge picture.
            if image.mode != "L" or image.size != (shape[-1], int(np.prod(shape[:-1]))):
                raise ValueError(f"{name}: the picture's size is not {'x'.join(map(str, shape))}")
            return np.asarray(image).reshape(shape).copy()
    except (binascii.Error, UnidentifiedImageError, OSError, SyntaxError) as error:
        raise ValueError(f"{name}: the picture cannot be read ({error})") from None


def _text(value: Any, indent: str = "") -> str:
    """Format a value as JSON with one line per key and lists of plain values on one line."""
    inner = indent + " "
    if isinstance(value, dict):
        lines = [f"{inner}{json.dumps(key)}: {_text(item, inner)}" for key, item in value.items()]
    elif isinstance(value, list) and value and isinstance(value[0], dict | list):
        lines = [f"{inner}{_text(item, inner)}" for item in value]
        if isinstance(value[0], list):
            lines = [f"{inner}{json.dumps(item)}" for item in value]
    else:
        return json.dumps(value)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}\n" + ",\n".join(lines) + f"\n{indent}{closing}"
