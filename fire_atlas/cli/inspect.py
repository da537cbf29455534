"""``fire-atlas inspect``."""

import json
from argparse import Namespace
from pathlib import Path

from rich.table import Table

from fire_atlas.channels.cross_validation import ValidationReport, read_reports
from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.cli.console import PlainConsole
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.effect.flakes.statistics import ember_figures
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.formats.templates.context import context_of
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.outputs.manifest import decode_manifest, manifest_name
from fire_atlas.preview.figures import page_use, safe_mip, span, told, wanted
from fire_atlas.preview.loops import loops_of


def run(args: Namespace) -> int:
    """Print tables about a built atlas, or what templates see of it."""
    atlas = read_atlas(args.atlas)
    if args.context:
        print(json.dumps(context_of(atlas.sheet), indent=2))
        return 0
    tracks = read_all_tracks(atlas)
    console = PlainConsole()
    console.print(_pages(atlas))
    console.print(_frames(atlas))
    if (loops := _loops(atlas)) is not None:
        console.print(loops)
    if atlas.sheet.maps:
        console.print(_maps(atlas))
        for animation, report in _reports(args.atlas.parent, atlas.sheet.title).items():
            console.print(_motion_vectors(animation, report))
    for name, flown in tracks.items():
        console.print(_flakes(flown, "flakes" if len(tracks) == 1 else f"flakes of {name}"))
    return 0


def _pages(atlas: AtlasFile) -> Table:
    heads = ("page", "size", "frames", "places", "occupancy", "safe mip level")
    table = Table(*heads, title="pages", caption=_grid(atlas))
    for i, page in enumerate(atlas.sheet.pages):
        use = page_use(atlas, i)
        table.add_row(
            page.file,
            f"{page.width} x {page.height}",
            str(use.frames),
            str(use.places),
            f"{100 * use.occupancy:.1f} %",
            safe_mip(page),
        )
    return table


def _grid(atlas: AtlasFile) -> str | None:
    grid = atlas.sheet.grid
    if grid is None:
        return None
    cell = f"{grid.cell_width} x {grid.cell_height}"
    return f"{grid.columns} columns x {grid.rows} rows of cells of {cell} px, gutter included"


def _frames(atlas: AtlasFile) -> Table:
    heads = ("animation", "frames", "duration", "fps", "plays", "full size", "trimmed", "pivot")
    table = Table(*heads, title="frames")
    regions = {region.name: region for region in atlas.frames}
    for animation in atlas.sheet.animations:
        frames = [regions[frame] for frame in animation.frames]
        seconds = sum(frame.duration for frame in frames) / 1000
        trimmed = [frame for frame in frames if frame.trimmed]
        x, y = frames[0].anchor
        table.add_row(
            animation.name,
            str(len(frames)),
            f"{seconds:.2f} s",
            f"{len(frames) / seconds:.4g}" if seconds else "-",
            "in a loop" if animation.loop else "once",
            f"{span([f.frame_width for f in frames])} x "
            f"{span([f.frame_height for f in frames])}",
            f"{len(trimmed)}, to {span([f.width for f in frames])} x "
            f"{span([f.height for f in frames])}" if trimmed else "none",
            f"{x:.3g}, {y:.3g}",
        )  # fmt: skip
    return table


def _loops(atlas: AtlasFile) -> Table | None:
    """Return how well the looping animations go round; None if there are none to measure."""
    loops = loops_of(atlas)
    if not loops:
        return None
    heads = [figure.name for figure in next(iter(loops.values()))]
    caption = (
        "steps against the median step (at the seam, 0.8 to 1.25 is not seen); flow and change of "
        "light at the seam against the 95th percentile; least detail against the median"
    )
    table = Table("loop", *heads, title="loops", caption=caption)
    for name, figures in loops.items():
        table.add_row(name, *(f"{figure.value:.2f}" for figure in figures))
    return table


def _maps(atlas: AtlasFile) -> Table:
    table = Table("map", "files", "for", "strength", title="maps")
    for each in atlas.sheet.maps:
        engine, strength = "", ""
        if each.motion is not None:
            engine, (x, y) = each.motion.engine, each.motion.pixels
            unit = "of a cell" if motion_encoding(engine).unit == "cell" else "px"
            strength = f"{each.motion.scale:g} {unit} a frame ({x:.3g} x {y:.3g} px)"
        table.add_row(each.kind, ", ".join(each.files), engine, strength)
    return table


def _reports(folder: Path, title: str) -> dict[str, ValidationReport | None]:
    """Return what the manifest of the build ``title`` says of its motion vectors, by animation.

    Nothing where there is no manifest: an atlas may be looked at without it.

    Raises:
        SourceError: It is broken.
    """
    path = folder / manifest_name(title)
    if not path.exists():
        return {}
    try:
        return read_reports(decode_manifest(read_file(path, MAX_JSON_BYTES)).statistics)
    except (OSError, ValueError) as error:
        raise SourceError(
            f"{path}: is no manifest that fire-atlas wrote ({type(error).__name__}: {error}); "
            f"build the recipe again"
        ) from error


def _motion_vectors(animation: str, report: ValidationReport | None) -> str:
    """Say how much motion vectors help; the name is empty where there is one animation."""
    vectors = f"motion vectors of {animation}" if animation else "motion vectors"
    if report is None:
        return f"{vectors}: none, the animation is too short to test them"
    if not report.helps:
        return f"{vectors}: none, plain blending is as close to frames that were held out"
    gain, *wrong = report.gains
    sign = "right" if report.sign_right else "WRONG"
    others = ", ".join(f"{100 * each:+.0f} %" for each in wrong)
    gained = f"{100 * gain:.0f} % closer than plain blending"
    return f"{vectors}: {gained}; sign {sign} (others {others})"


def _flakes(tracks: Tracks, title: str) -> Table:
    table = Table("flakes", "", "should be", "", title=title)
    for figure in ember_figures(tracks):
        table.add_row(
            figure.name,
            told(figure),
            wanted(figure),
            "" if figure.is_in_range else "out of range",
        )
    return table
