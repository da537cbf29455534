"""Measure a finished atlas: what ``inspect`` prints, and ``fire_atlas.inspect_atlas`` returns."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fire_atlas.atlas.sheet import CellGrid
from fire_atlas.effect.flakes.statistics import Figure, flake_figures
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.preview.budget import Budget
from fire_atlas.preview.figures import PageUse, page_use
from fire_atlas.preview.loops import figures_of_loops
from fire_atlas.preview.memory import TextureUse, texture_uses
from fire_atlas.preview.overdraw import Overdraw, overdraw_of
from fire_atlas.preview.sentences import BuildSentences


@dataclass(frozen=True, slots=True)
class PageFigures:
    """A page.

    Attributes:
        file: Its name.
        width, height: Its size, px.
        use: What is on it.
        safe_mip: The deepest mip level at which no frame mixes with a neighbour; None if not even
            filtering keeps them apart.
    """

    file: str
    width: int
    height: int
    use: PageUse
    safe_mip: int | None


@dataclass(frozen=True, slots=True)
class AnimationFigures:
    """The frames of an animation.

    Attributes:
        name: Its name.
        frames: How many it plays.
        seconds: How long it takes.
        loop: Whether it plays in a loop.
        widths, heights: (least, most) of its frames, px.
        trimmed: How many of them are trimmed.
        trimmed_widths, trimmed_heights: (least, most) of what is left of these, px; (0, 0) if none.
        pivot: [x, y] of the first frame, 0..1 of its size, y down.
    """

    name: str
    frames: int
    seconds: float
    loop: bool
    widths: tuple[int, int]
    heights: tuple[int, int]
    trimmed: int
    trimmed_widths: tuple[int, int]
    trimmed_heights: tuple[int, int]
    pivot: tuple[float, float]


@dataclass(frozen=True, slots=True)
class MapFigures:
    """A map beside the pages.

    Attributes:
        kind: What it holds: ``motion``, ``normal``, ...
        files: Its images, one for each page.
        engine: The engine that it is encoded for; empty if for none.
        strength: What its strongest value means, as text; empty if nothing.
    """

    kind: str
    files: tuple[str, ...]
    engine: str
    strength: str


@dataclass(frozen=True, slots=True)
class FlakeFigures:
    """The flakes of an animation.

    Attributes:
        seconds: Length of their tracks.
        rounds: How many rounds of the loop these last.
        figures: Statistics, with the ranges in which embers look real.
    """

    seconds: float
    rounds: int
    figures: tuple[Figure, ...]


@dataclass(frozen=True, slots=True)
class Inspection:
    """What there is to know about a finished atlas.

    Attributes:
        path: The JSON of its first page.
        pages: Its pages.
        grid: Its cells, if it is a grid.
        textures: What each image takes on a GPU, uncompressed and as each compressed texture.
        animations: Its animations.
        overdraw: What a renderer draws of each of them, by name.
        has_meshes: Whether it draws tight polygons.
        loops: Figures of the loops that were measured, by name.
        maps: Maps beside the pages.
        flakes: Flakes of the animations whose tracks are beside the atlas, by name.
        budget: What a budget was spent on, as the manifest says; None without one.
        sentences: What it says besides.
    """

    path: Path
    pages: tuple[PageFigures, ...]
    grid: CellGrid | None
    textures: tuple[TextureUse, ...]
    animations: tuple[AnimationFigures, ...]
    overdraw: Mapping[str, Overdraw]
    has_meshes: bool
    loops: Mapping[str, tuple[Figure, ...]]
    maps: tuple[MapFigures, ...]
    flakes: Mapping[str, FlakeFigures]
    budget: Budget | None
    sentences: BuildSentences

    def as_json(self) -> dict[str, Any]:
        """Return it as plain values: what ``inspect --json`` prints."""
        values = asdict(self)
        return {**values, "path": str(self.path), "sentences": list(self.sentences.all())}


def inspection_of(atlas: AtlasFile, sentences: BuildSentences) -> Inspection:
    """Measure an atlas; ``sentences`` are what its manifest says.

    Raises:
        SourceError: One of its files is missing or damaged.
    """
    sheet, grid = atlas.sheet, atlas.sheet.grid
    return Inspection(
        path=atlas.path,
        pages=tuple(
            PageFigures(page.file, page.width, page.height, page_use(atlas, i), page.safe_mip)
            for i, page in enumerate(sheet.pages)
        ),
        grid=grid,
        textures=tuple(texture_uses(atlas, sentences.images)),
        animations=tuple(_animations(atlas)),
        overdraw=overdraw_of(atlas),
        has_meshes=sheet.has_meshes,
        loops={name: tuple(figures) for name, figures in figures_of_loops(atlas).items()},
        maps=tuple(_maps(atlas)),
        flakes={name: _flakes(tracks) for name, tracks in read_all_tracks(atlas).items()},
        budget=sentences.budget,
        sentences=sentences,
    )


def _animations(atlas: AtlasFile) -> list[AnimationFigures]:
    regions = {region.name: region for region in atlas.frames}
    found = []
    for animation in atlas.sheet.animations:
        frames = [regions[name] for name in animation.frames]
        trimmed = [frame for frame in frames if frame.trimmed]
        found.append(
            AnimationFigures(
                name=animation.name,
                frames=len(frames),
                seconds=sum(frame.duration for frame in frames) / 1000,
                loop=animation.loop,
                widths=_range([frame.frame_width for frame in frames]),
                heights=_range([frame.frame_height for frame in frames]),
                trimmed=len(trimmed),
                trimmed_widths=_range([frame.width for frame in trimmed]),
                trimmed_heights=_range([frame.height for frame in trimmed]),
                pivot=frames[0].anchor,
            )
        )
    return found


def _range(values: list[int]) -> tuple[int, int]:
    return min(values, default=0), max(values, default=0)


def _maps(atlas: AtlasFile) -> list[MapFigures]:
    found = []
    for stated in atlas.sheet.maps:
        engine = strength = ""
        if stated.vectors is not None and stated.kind == "haze":
            strength = f"{stated.vectors.scale:g} px"
        elif stated.vectors is not None:
            engine, (x, y) = stated.vectors.engine, stated.vectors.pixels
            unit = "of a cell" if motion_encoding(engine).unit == "cell" else "px"
            strength = f"{stated.vectors.scale:g} {unit} a frame ({x:.3g} x {y:.3g} px)"
        found.append(MapFigures(stated.kind, tuple(stated.files), engine, strength))
    return found


def _flakes(tracks: Tracks) -> FlakeFigures:
    seconds = len(tracks.frames) / tracks.fps
    return FlakeFigures(seconds, tracks.rounds, tuple(flake_figures(tracks)))
