"""``fire-atlas inspect``."""

from argparse import Namespace

from rich.console import Console
from rich.table import Table

from fire_atlas.flakes.statistics import Figure, ember_figures
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.preview.atlas_file import AtlasFile, read_atlas
from fire_atlas.preview.tracks_file import read_tracks


def run(args: Namespace) -> int:
    """Print tables about a built atlas."""
    atlas, tracks = read_atlas(args.atlas), read_tracks(args.atlas)
    console = Console()
    console.print(_pages(atlas))
    console.print(_frames(atlas))
    if tracks is not None:
        console.print(_flakes(tracks))
    return 0


def _pages(atlas: AtlasFile) -> Table:
    table = Table("page", "size", "frames", "occupancy", title="pages")
    for i, page in enumerate(atlas.pages):
        frames = [frame for frame in atlas.frames if frame.page == i]
        # Equal frames may share their pixels.
        places = {(frame.x, frame.y, frame.width, frame.height) for frame in frames}
        covered = sum(width * height for _, _, width, height in places)
        occupancy = f"{100 * covered / (page.width * page.height):.1f} %"
        size = f"{page.width} x {page.height}"
        table.add_row(page.image.name, size, str(len(frames)), occupancy)
    return table


def _frames(atlas: AtlasFile) -> Table:
    table = Table("animation", "frames", "duration", "fps", "full size", "trimmed", title="frames")
    for name, frames in atlas.animations.items():
        seconds = sum(frame.duration for frame in frames) / 1000
        sizes = sorted({(frame.full_width, frame.full_height) for frame in frames})
        trimmed = [frame for frame in frames if frame.is_trimmed]
        table.add_row(
            name,
            str(len(frames)),
            f"{seconds:.2f} s",
            f"{len(frames) / seconds:.4g}" if seconds else "-",
            ", ".join(f"{width} x {height}" for width, height in sizes),
            f"{len(trimmed)}, to {_range([f.width for f in frames])} x "
            f"{_range([f.height for f in frames])}" if trimmed else "none",
        )  # fmt: skip
    return table


def _range(values: list[int]) -> str:
    low, high = min(values), max(values)
    return str(low) if low == high else f"{low}..{high}"


def _flakes(tracks: Tracks) -> Table:
    table = Table("flakes", "", "should be", "", title="flakes")
    for figure in ember_figures(tracks):
        table.add_row(
            figure.name,
            f"{figure.value:.3g} {figure.unit}".strip(),
            _wanted(figure),
            "" if figure.is_in_range else "out of range",
        )
    return table


def _wanted(figure: Figure) -> str:
    match figure.low, figure.high:
        case None, None:
            return ""
        case low, None:
            return f"at least {low:g}"
        case None, high:
            return f"at most {high:g}"
        case low, high:
            return f"{low:g} to {high:g}"
