"""Profile files: everything learnt of a fire, to read, to keep, and to recolour.

JSON, its numbers for people first: the colour table (``colours`` may be edited; the fire then
burns in those colours), statistics, feature points, leaning sets. The detail follows as grey PNGs.
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

from fire_atlas import __version__
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes, hex_to_srgb, srgb_to_hex
from fire_atlas.generators.profile.colours import ColourTable
from fire_atlas.generators.profile.contour import Points
from fire_atlas.generators.profile.face import DRIFT_CELL, DRIFT_UNIT, LEVELS, Face
from fire_atlas.generators.profile.grid import Grid
from fire_atlas.generators.profile.measure import LEAST_FRAMES, MOST_FRAMES
from fire_atlas.generators.profile.model import Profile, Side, Spread, Statistics
from fire_atlas.generators.profile.pose import NODES, Pose
from fire_atlas.generators.profile.states import LeaningSet, Origin, Period
from fire_atlas.recipe.base import COLOR_PATTERN

FORMAT: Literal["fire-atlas/profile"] = "fire-atlas/profile"
VERSION: Literal[1] = 1

SUFFIX = ".json"
"""How the names of profile files end; those of clips never do."""

Share = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[float, Field(gt=0, le=1e5)]
Place = tuple[float, float]
Curve = Annotated[tuple[float, ...], Field(min_length=NODES, max_length=NODES)]
Curves = Annotated[tuple[Curve, ...], Field(min_length=1, max_length=MOST_FRAMES)]


class _Block(BaseModel):
    """A part of the file: unknown keys, NaN and infinities refused; lists stand for tuples."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _Colours(_Block):
    cells: int = Field(ge=2, le=32)
    rows: tuple[tuple[Annotated[str, Field(pattern=COLOR_PATTERN)], ...], ...]
    coverage: tuple[tuple[Share, ...], ...]

    @classmethod
    def of(cls, table: ColourTable) -> "_Colours":
        rows = tuple(tuple(map(srgb_to_hex, row)) for row in table.colours)
        coverage = tuple(tuple(round(float(c), 3) for c in row) for row in table.coverage)
        return cls(cells=len(rows), rows=rows, coverage=coverage)

    def table(self) -> ColourTable:
        """Raise ``ValueError`` if it is not square."""
        size = self.cells
        if [len(row) for row in (*self.rows, *self.coverage)] != [size] * 2 * size:
            raise ValueError(f"a colour table of {size} cells has {size} rows of {size}")
        colours = np.stack([hex_to_srgb(row) for row in self.rows])
        return ColourTable(colours, np.array(self.coverage, np.float32))


class _Grid(_Block):
    up: int = Field(ge=4, le=1024)
    down: int = Field(ge=1, le=512)
    side: int = Field(ge=2, le=2048)
    per_height: float = Field(ge=8, le=1024)
    per_half: float = Field(ge=0.1, le=2048)


class _Statistics(_Block):
    height: tuple[Size, Size, Size]
    width: tuple[Size, Size, Size]
    lean: tuple[float, float, float]
    brightness: tuple[float, float, float]
    step: float = Field(ge=0)


class _Set(_Block):
    low: float
    high: float
    period: Period
    origin: Origin
    frames: Annotated[tuple[int, ...], Field(min_length=1)]


class _Side(_Block):
    frames: int = Field(ge=LEAST_FRAMES, le=MOST_FRAMES)
    fps: float = Field(gt=0, le=1000)
    closed: bool
    threshold: float = Field(ge=0, le=255)
    statistics: _Statistics
    sets: Annotated[tuple[_Set, ...], Field(min_length=12, max_length=12)]
    points: tuple[Annotated[tuple[Place, ...], Field(min_length=6, max_length=6)], ...]
    half: float = Field(gt=0, le=100)
    kinship: Share
    breadth: float = Field(ge=0, le=4096)
    is_even: bool
    offset: Curves
    ratio: Curves
    heat: str
    shades: str
    drift: str


class _File(_Block):
    format: Literal["fire-atlas/profile"]
    version: Literal[1]
    tool: str
    colours: _Colours
    colours_as_learnt: _Colours
    rise: float = Field(ge=0.01, le=100)
    pace: float = Field(ge=0.1, le=10)
    grid: _Grid
    sides: Annotated[tuple[_Side, ...], Field(min_length=1, max_length=2)]


def write_profile(profile: Profile) -> bytes:
    """Return the file of a profile."""
    grid = profile.grid
    told = _File(
        format=FORMAT,
        version=VERSION,
        tool=f"fire-atlas {__version__}",
        colours=_Colours.of(profile.colours),
        colours_as_learnt=_Colours.of(profile.learnt),
        rise=profile.rise,
        pace=profile.pace,
        grid=_Grid(
            up=grid.up, down=grid.down, side=grid.side, per_height=grid.per_height,
            per_half=grid.per_half,
        ),
        sides=tuple(_told(side) for side in profile.sides),
    )  # fmt: skip
    return (_text(told.model_dump(mode="json")) + "\n").encode()


def read_profile(data: bytes, name: str) -> Profile:
    """Return the profile in a file called ``name``.

    Raises:
        SourceError: It is no profile, of a later version, or damaged.
    """
    again = "learn it anew with: fire-atlas learn CLIP -o NAME.profile.json"
    try:
        values = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{name}: is damaged or no fire profile ({error}); {again}") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise SourceError(f"{name}: is no fire profile; {again}")
    version = values.get("version")
    if isinstance(version, int) and version > VERSION:
        raise SourceError(
            f"{name}: is a profile of version {version}, but this fire-atlas reads up to "
            f"{VERSION}; update fire-atlas, or {again}"
        )
    try:
        file = _File.model_validate(values)
        grid = Grid(**file.grid.model_dump())
        colours, learnt = file.colours.table(), file.colours_as_learnt.table()
        if colours.colours.shape != learnt.colours.shape:
            raise ValueError("colours: must have as many cells as colours_as_learnt")
        sides = [_side(side, grid) for side in file.sides]
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise SourceError(f"{name}: is damaged at {where}: {first['msg']}; {again}") from None
    except ValueError as error:
        raise SourceError(f"{name}: is damaged: {error}; {again}") from None
    side = sides[1] if len(sides) > 1 else None
    return Profile(grid, file.rise, file.pace, colours, learnt, sides[0], side)


def _told(side: Side) -> _Side:
    face, statistics = side.face, side.statistics
    return _Side(
        frames=face.count,
        fps=side.fps,
        closed=side.closed,
        threshold=side.threshold,
        statistics=_Statistics(
            height=statistics.height,
            width=statistics.width,
            lean=statistics.lean,
            brightness=statistics.brightness,
            step=statistics.step,
        ),
        sets=tuple(
            _Set(low=s.low, high=s.high, period=s.period, origin=s.origin, frames=s.frames)
            for s in side.sets
        ),
        points=side.points,
        half=face.half,
        kinship=face.kinship,
        breadth=face.breadth,
        is_even=face.is_even,
        offset=tuple(map(tuple, face.pose.offset.tolist())),
        ratio=tuple(map(tuple, face.pose.ratio.tolist())),
        heat=_packed(face.heat),
        shades=_packed(np.moveaxis(face.shades, 3, 1)),
        drift=_packed((np.moveaxis(face.drift, 3, 1) / DRIFT_UNIT + 128).astype(np.uint8)),
    )


def _side(told: _Side, grid: Grid) -> Side:
    count, (rows, columns) = told.frames, grid.shape
    for name, items in (("points", told.points), ("offset", told.offset), ("ratio", told.ratio)):
        if len(items) != count:
            raise ValueError(f"{name}: has {len(items)} items for {count} frames")
    for each in told.sets:
        if not all(0 <= frame < count for frame in each.frames):
            raise ValueError(f"sets: there are only frames 0 to {count - 1}")
    levels = min(LEVELS, count)
    small = -(-rows // DRIFT_CELL), -(-columns // DRIFT_CELL)
    drift = _unpacked("drift", told.drift, (count, 2, *small)).astype(np.float32)
    shades = _unpacked("shades", told.shades, (levels, 4, rows, columns))
    face = Face(
        half=told.half,
        pose=Pose(np.clip(np.array(told.offset), -2, 2), np.clip(np.array(told.ratio), 0.5, 2)),
        heat=_unpacked("heat", told.heat, (count, rows, columns)),
        shades=np.ascontiguousarray(np.moveaxis(shades, 1, 3)),
        drift=np.moveaxis((drift - 128) * np.float32(DRIFT_UNIT), 1, 3),
        kinship=told.kinship,
        breadth=told.breadth,
        is_even=told.is_even,
    )
    given = told.statistics
    return Side(
        fps=told.fps,
        closed=told.closed,
        threshold=told.threshold,
        points=tuple(Points(*each) for each in told.points),
        statistics=Statistics(
            Spread(*given.height), Spread(*given.width), Spread(*given.lean),
            Spread(*given.brightness), given.step,
        ),
        sets=tuple(LeaningSet(s.low, s.high, s.period, s.origin, s.frames) for s in told.sets),
        face=face,
    )  # fmt: skip


def _packed(array: Bytes) -> str:
    """An array of bytes as a PNG one column of pictures wide, in base64."""
    done, data = cv2.imencode(".png", np.ascontiguousarray(array).reshape(-1, array.shape[-1]))
    assert done, "a grey picture can always be encoded"
    return base64.b64encode(data.tobytes()).decode()


def _unpacked(name: str, text: str, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return the array of ``shape`` that was packed; raise ``ValueError`` if it is not there."""
    try:
        data = base64.b64decode(text, validate=True)
        with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            # Looked at before it is decoded: a few bytes can stand for very many pixels.
            if image.mode != "L" or image.size != (shape[-1], int(np.prod(shape[:-1]))):
                raise ValueError(f"{name}: the picture is not of {'x'.join(map(str, shape))}")
            return np.asarray(image).reshape(shape).copy()
    except (binascii.Error, UnidentifiedImageError, OSError, SyntaxError) as error:
        raise ValueError(f"{name}: the picture cannot be read ({error})") from None


def _text(value: Any, indent: str = "") -> str:
    """JSON with a line for each key, and lists of plain values on one line."""
    inner = indent + " "
    if isinstance(value, dict):
        lines = [f"{inner}{json.dumps(key)}: {_text(each, inner)}" for key, each in value.items()]
    elif isinstance(value, list) and value and isinstance(value[0], dict | list):
        lines = [f"{inner}{_text(each, inner)}" for each in value]
        if isinstance(value[0], list):
            lines = [f"{inner}{json.dumps(each)}" for each in value]
    else:
        return json.dumps(value)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}\n" + ",\n".join(lines) + f"\n{indent}{closing}"
