"""Describe a finished atlas in tables and sentences, for ``fire-atlas inspect``."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from rich.table import Table

from fire_atlas.core.statistics import by_animation, read_figures
from fire_atlas.effect.flakes.statistics import flake_figures
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.heat.encode import HeatError
from fire_atlas.maps.vectors.cross_validation import ValidationReport, read_reports
from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.preview.figures import page_use, range_text, safe_mip, span, value_text
from fire_atlas.preview.loops import figures_of_loops
from fire_atlas.preview.memory import ImageErrors, memory_table
from fire_atlas.preview.overdraw import Overdraw, overdraw_of

_VISIBLE_HUE = 6.0
"""Hues further than this, ΔE, outside of the clip's own are noticed."""


@dataclass(frozen=True, slots=True)
class BuildSentences:
    """What the statistics in a manifest say of a build.

    Attributes:
        pages: Of the colours of lossy pages and of heat; they follow the table of pages.
        blends: Of frames of cross-fades; they follow the table of loops.
        motion: Of motion vectors; they follow the table of maps.
        flakes: Of flakes; they follow it too.
        images: How far lossy pages and compressed textures are from what was drawn.
    """

    pages: tuple[str, ...] = ()
    blends: tuple[str, ...] = ()
    motion: tuple[str, ...] = ()
    flakes: tuple[str, ...] = ()
    images: ImageErrors = field(default_factory=lambda: ImageErrors({}, {}))

    @classmethod
    def of(cls, statistics: dict[str, Any]) -> Self:
        """Return the sentences on all animations.

        Raises:
            ValueError: The statistics are invalid.
        """
        motion = (_motion_sentence(*report) for report in read_reports(statistics).items())
        images = ImageErrors.of(statistics)
        heat = read_figures(statistics, "heat_error", HeatError)
        return cls(
            pages=(
                *(f"{file}: {error.sentence()}" for file, error in images.pages.items()),
                *(f"{name}: {error.sentence()}" for name, error in heat.items()),
            ),
            blends=tuple(_blend_sentences(statistics)),
            motion=tuple(motion),
            flakes=tuple(_flake_sentences(statistics)),
            images=images,
        )


def tables_of(
    atlas: AtlasFile, tracks: Mapping[str, Tracks], sentences: BuildSentences
) -> Iterator[Table | str]:
    """Yield tables of pages, their memory, frames, overdraw, loops, maps and flakes.

    Args:
        atlas: The atlas to describe.
        tracks: Flakes of each animation that has any, by its name.
        sentences: What the manifest says.

    Raises:
        SourceError: A page file or a texture is missing, or is not as the atlas states.
    """
    yield _pages(atlas)
    yield from sentences.pages
    yield memory_table(atlas, sentences.images)
    yield _frames(atlas)
    yield _overdraw(atlas)
    if (loops := _loops(atlas)) is not None:
        yield loops
    yield from sentences.blends
    if atlas.sheet.maps:
        yield _maps(atlas)
        yield from sentences.motion
    yield from sentences.flakes
    if sentences.flakes and not tracks:
        yield "flakes: their tracks are not beside the atlas; tracks: [json] has them measured here"
    for name, recorded in tracks.items():
        title = "flakes" if len(tracks) == 1 else f"flakes of {name}"
        yield _flakes(recorded, title)


def _flake_sentences(statistics: dict[str, Any]) -> Iterator[str]:
    """Yield a sentence on the flakes of each animation."""
    for animation, figures in by_animation(statistics):
        match figures:
            case {"flakes": {"born": int(born), "alive_mean": float() | int() as alive} as flakes}:
                of = f" of {animation}" if animation else ""
                kind = f"; class: {flakes['class']}" if "class" in flakes else ""
                yield f"flakes{of}: {born} in all, {alive:.3g} at a time{kind}"


def _blend_sentences(statistics: dict[str, Any]) -> Iterator[str]:
    """Yield a sentence on the hues of each animation with cross-fades."""
    for animation, figures in by_animation(statistics):
        if "blended" in figures:
            yield _blend_sentence(animation, figures["blended"])


def _blend_sentence(animation: str, figures: Any) -> str:
    match figures:
        case {"hue_error": float(error) | int(error)}:
            frames = (
                f"frames of cross-fades in {animation}" if animation else "frames of cross-fades"
            )
            limit = "unseen" if error <= _VISIBLE_HUE else "TO BE SEEN"
            return f"{frames}: hues at most ΔE {error:.1f} outside of the clip's own, {limit}"
    raise ValueError(f"{figures!r} are no figures of cross-fades")


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


def _overdraw(atlas: AtlasFile) -> Table:
    """Return how much a renderer draws of each animation, and of all."""
    caption = "overdraw: area that is drawn / pixels that show something"
    if not atlas.sheet.has_meshes:
        caption += "; atlas.mesh: {vertices: 8} draws tight polygons"
    heads = ("animation", "drawn as", "overdraw", "of rectangles")
    table = Table(*heads, title="overdraw", caption=caption)
    figures = overdraw_of(atlas)
    if len(figures) > 1:
        figures["all"] = Overdraw.together(list(figures.values()))
    for name, each in figures.items():
        table.add_row(
            name,
            _drawn_as(each) if atlas.sheet.has_meshes else "rectangles",
            _ratio(each.drawn, each.visible),
            _ratio(each.rectangles, each.visible),
        )
    return table


def _drawn_as(figures: Overdraw) -> str:
    """Return how many frames have meshes, and how many keep their rectangles for what reason."""
    counts = {
        f"as meshes of up to {figures.vertices} vertices": figures.meshes,
        "as rectangles: opaque": figures.opaque,
        "as rectangles: empty": figures.empty,
        "as rectangles: filled to all corners": figures.full,
    }
    return "\n".join(f"{count} {how}" for how, count in counts.items() if count)


def _ratio(area: float, visible: int) -> str:
    return f"{area / visible:.2f}" if visible else "-"


def _loops(atlas: AtlasFile) -> Table | None:
    """Return the figures of all loops; None if none is measured."""
    loops = figures_of_loops(atlas)
    if not loops:
        return None
    heads = [figure.name for figure in next(iter(loops.values()))]
    caption = (
        "steps: change from frame to frame / its median (at the seam, 0.8 to 1.25 goes unnoticed); "
        "flow and light at the seam: change there / 95th percentile of the loop's other changes; "
        "least detail: detail of the blurriest frame / median detail"
    )
    table = Table("loop", *heads, title="loops", caption=caption)
    for name, figures in loops.items():
        table.add_row(name, *(f"{figure.value:.2f}" for figure in figures))
    return table


def _maps(atlas: AtlasFile) -> Table:
    table = Table("map", "files", "for", "strength", title="maps")
    for each in atlas.sheet.maps:
        engine, strength = "", ""
        if each.vectors is not None and each.kind == "haze":
            strength = f"{each.vectors.scale:g} px"
        elif each.vectors is not None:
            engine, (x, y) = each.vectors.engine, each.vectors.pixels
            unit = "of a cell" if motion_encoding(engine).unit == "cell" else "px"
            strength = f"{each.vectors.scale:g} {unit} a frame ({x:.3g} x {y:.3g} px)"
        table.add_row(each.kind, ", ".join(each.files), engine, strength)
    return table


_VISIBLE_GAIN = 0.01
"""Gain of motion vectors below which they make no difference to be seen."""


def _motion_sentence(animation: str, report: ValidationReport | None) -> str:
    """Return how much motion vectors improve blending; ``animation`` is empty if it is the only."""
    vectors = f"motion vectors of {animation}" if animation else "motion vectors"
    if report is None:
        return f"{vectors}: none, the animation is too short to test them"
    if report.still:
        return f"{vectors}: none, nothing moves: frames that were held out are as their neighbours"
    if not report.helps:
        return f"{vectors}: none, plain blending is as close to frames that were held out"
    if report.gain < _VISIBLE_GAIN:
        small = "less than 1 % closer than plain blending"
        return f"{vectors}: {small}; little of what changes between frames is motion"
    return f"{vectors}: {100 * report.gain:.0f} % closer than plain blending"


def _flakes(tracks: Tracks, title: str) -> Table:
    table = Table("flakes", "", "should be", "", title=title)
    rounds = f", {tracks.rounds} rounds of the loop" if tracks.rounds > 1 else ""
    table.add_row("length", f"{len(tracks.frames) / tracks.fps:.4g} s{rounds}")
    for figure in flake_figures(tracks):
        table.add_row(
            figure.name,
            value_text(figure),
            range_text(figure.low, figure.high),
            "" if figure.is_in_range else "out of range",
        )
    return table
