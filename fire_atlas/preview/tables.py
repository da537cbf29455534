"""Describe a finished atlas on one screen, or in tables of its details: ``fire-atlas inspect``."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from fire_atlas.effect.flakes.statistics import Figure
from fire_atlas.formats.textures.memory import UNCOMPRESSED
from fire_atlas.preview.figures import range_text, safe_mip, value_text
from fire_atlas.preview.inspection import AnimationFigures, Inspection, MapFigures, PageFigures
from fire_atlas.preview.overdraw import Overdraw
from fire_atlas.preview.sentences import BuildSentences

_MIB = 1 << 20

Item = TypeVar("Item")


def summary(found: Inspection) -> Iterator[str]:
    """Yield the lines of a summary: at most twenty, whatever the atlas."""
    frames = sum(animation.frames for animation in found.animations)
    seconds = sum(animation.seconds for animation in found.animations)
    yield (
        f"{found.path.name}: {_counted(frames, 'frame')}, {seconds:.2f} s, "
        f"{_counted(len(found.animations), 'animation')}, {_counted(len(found.pages), 'page')}"
    )
    lines = {
        "pages": [*_some(found.pages, _page_line, "--pages"), *_grid(found)],
        "memory": [", ".join(_memories(found))],
        "budget": [found.budget.sentence()] if found.budget else [],
        "frames": _some(found.animations, _frames_line, "--frames"),
        "overdraw": [_overdraw_line(found)],
        "loop": _some(list(found.loops.items()), lambda loop: _loop_line(*loop), "--loops"),
        "maps": _some(found.maps, _map_line, "--maps"),
        "": _first_sentences(found.sentences),
    }
    for label, texts in lines.items():
        for number, text in enumerate(texts):
            yield f"{label if number == 0 else '':8}  {text}"
    yield f"{'details':8}  {' '.join(f'--{name}' for name in DETAILS)}"


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _some(items: Sequence[Item], line: Callable[[Item], str], option: str) -> list[str]:
    """Return a line for each of two items; of more, for the first, and how many an option shows."""
    if len(items) <= 2:
        return [line(item) for item in items]
    return [line(items[0]), f"and {len(items) - 1} more: {option}"]


def _page_line(page: PageFigures) -> str:
    return (
        f"{page.file}: {page.width} x {page.height} px, {_counted(page.use.frames, 'frame')} in "
        f"{_counted(page.use.places, 'place')}, {100 * page.use.occupancy:.1f} % covered, safe mip "
        f"level: {safe_mip(page.safe_mip)}"
    )


def _grid(found: Inspection) -> list[str]:
    if found.grid is None:
        return []
    grid = found.grid
    cell = f"{grid.cell_width} x {grid.cell_height}"
    return [f"{grid.columns} columns x {grid.rows} rows of cells of {cell} px, gutter included"]


def _memories(found: Inspection) -> list[str]:
    """Return how much all images take in each format that they are kept in."""
    taken: dict[str, int] = {}
    for use in found.textures:
        taken[use.format] = taken.get(use.format, 0) + use.memory
    return [f"{memory / _MIB:.2f} MiB as {kept}" for kept, memory in taken.items()]


def _frames_line(animation: AnimationFigures) -> str:
    return (
        f"{animation.name}: {animation.frames}, {animation.seconds:.2f} s at {_rate(animation)} "
        f"fps, plays {_plays(animation)}, {_full(animation)} px, trimmed: {_trimmed(animation)}, "
        f"pivot {_pivot(animation)}"
    )


def _overdraw_line(found: Inspection) -> str:
    total = Overdraw.together(list(found.overdraw.values()))
    as_drawn = "meshes" if found.has_meshes else "rectangles"
    ratio = _ratio(total.drawn, total.visible)
    return f"{ratio} px are drawn for each that shows something, as {as_drawn}"


def _loop_line(name: str, figures: Sequence[Figure]) -> str:
    measured = ", ".join(f"{figure.name} {figure.value:.2f}" for figure in figures[:1])
    odd = [figure.name for figure in figures if not figure.is_in_range]
    return f"{name}: {measured}: {'TO BE SEEN: ' + ', '.join(odd) if odd else 'goes unnoticed'}"


def _map_line(stated: MapFigures) -> str:
    first, *others = stated.files
    files = f"{first} and {len(others)} more" if others else first
    return f"{stated.kind}: {', '.join(filter(None, [files, stated.engine, stated.strength]))}"


def _first_sentences(sentences: BuildSentences) -> list[str]:
    """Return the first sentence on pages, blends, motion vectors and flakes, and how many more
    there are."""
    kinds = (sentences.pages, sentences.blends, sentences.motion, sentences.flakes)
    shown = [kind[0] for kind in kinds if kind]
    more = sum(map(len, kinds)) - len(shown)
    return [*shown, f"and {more} more: --pages --loops --maps --flakes"] if more else shown


@dataclass(frozen=True, slots=True)
class Detail:
    """A table.

    Attributes:
        heads: Heads of its columns.
        rows: Its cells, as text.
        remarks: Sentences below it.
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()

    def lines(self) -> Iterator[str]:
        """Yield the table and its remarks as lines; no cell is broken."""
        if self.rows:
            table = [self.heads, *self.rows]
            widths = [max(map(len, column)) for column in zip(*table, strict=True)]
            for row in table:
                padded = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
                yield "  ".join(padded).rstrip()
        yield from self.remarks


def _pages(found: Inspection) -> Detail:
    rows = [
        (
            page.file,
            f"{page.width} x {page.height}",
            str(page.use.frames),
            str(page.use.places),
            f"{100 * page.use.occupancy:.1f} %",
            safe_mip(page.safe_mip),
        )
        for page in found.pages
    ]
    heads = ("page", "size", "frames", "places", "occupancy", "safe mip level")
    return Detail(heads, tuple(rows), (*_grid(found), *found.sentences.pages))


def _memory(found: Inspection) -> Detail:
    rows, whole = [], 0
    for use in found.textures:
        whole = use.memory if use.format in UNCOMPRESSED else whole
        rows.append(
            (
                use.file,
                use.format,
                str(use.levels),
                f"{use.memory / _MIB:.2f} MiB",
                f"{100 * use.memory / whole:.1f} %",
                "-" if use.psnr is None else f"{use.psnr:.1f} dB",
                "-" if use.hue is None else f"{use.hue:.1f}",
            )
        )
    captions = (
        "PSNR: over visible pixels, premultiplied",
        "hues: distance, ΔE, that 99.5 % of them keep",
    )
    has_errors = any(use.psnr is not None for use in found.textures)
    heads = ("file", "kept as", "mip levels", "memory", "of uncompressed", "PSNR", "hues")
    return Detail(heads, tuple(rows), captions if has_errors else ())


def _budget(found: Inspection) -> Detail:
    if found.budget is None:
        return Detail((), ())
    heads = ("budget", "frames", "height", "memory", "off the whole", "")
    return Detail(heads, tuple(found.budget.rows()), (found.budget.sentence(),))


def _frames(found: Inspection) -> Detail:
    rows = [
        (
            animation.name,
            str(animation.frames),
            f"{animation.seconds:.2f} s",
            _rate(animation),
            _plays(animation),
            _full(animation),
            _trimmed(animation),
            _pivot(animation),
        )
        for animation in found.animations
    ]
    heads = ("animation", "frames", "duration", "fps", "plays", "full size", "trimmed", "pivot")
    return Detail(heads, tuple(rows))


def _rate(animation: AnimationFigures) -> str:
    return f"{animation.frames / animation.seconds:.4g}" if animation.seconds else "-"


def _plays(animation: AnimationFigures) -> str:
    return "in a loop" if animation.loop else "once"


def _full(animation: AnimationFigures) -> str:
    return f"{_span(animation.widths)} x {_span(animation.heights)}"


def _trimmed(animation: AnimationFigures) -> str:
    if not animation.trimmed:
        return "none"
    size = f"{_span(animation.trimmed_widths)} x {_span(animation.trimmed_heights)}"
    return f"{animation.trimmed}, to {size}"


def _pivot(animation: AnimationFigures) -> str:
    return ", ".join(f"{coordinate:.3g}" for coordinate in animation.pivot)


def _span(values: tuple[int, int]) -> str:
    least, most = values
    return str(least) if least == most else f"{least}..{most}"


def _overdraw(found: Inspection) -> Detail:
    caption = "overdraw: area that is drawn / pixels that show something"
    if not found.has_meshes:
        caption += "; atlas.mesh: {vertices: 8} draws tight polygons"
    figures = dict(found.overdraw)
    if len(figures) > 1:
        figures["all"] = Overdraw.together(list(figures.values()))
    rows = [
        (
            name,
            _ratio(drawn.drawn, drawn.visible),
            _ratio(drawn.rectangles, drawn.visible),
            _drawn_as(drawn) if found.has_meshes else "rectangles",
        )
        for name, drawn in figures.items()
    ]
    return Detail(("animation", "overdraw", "of rectangles", "drawn as"), tuple(rows), (caption,))


def _drawn_as(figures: Overdraw) -> str:
    """Return how many frames have meshes, and how many keep their rectangles for what reason."""
    counts = {
        f"as meshes of up to {figures.vertices} vertices": figures.meshes,
        "as rectangles: opaque": figures.opaque,
        "as rectangles: empty": figures.empty,
        "as rectangles: filled to all corners": figures.full,
    }
    return "; ".join(f"{count} {how}" for how, count in counts.items() if count)


def _ratio(area: float, visible: int) -> str:
    return f"{area / visible:.2f}" if visible else "-"


def _loops(found: Inspection) -> Detail:
    names = [figure.name for figures in list(found.loops.values())[:1] for figure in figures]
    rows = [
        (name, *(f"{figure.value:.2f}" for figure in figures))
        for name, figures in found.loops.items()
    ]
    captions = (
        "steps: change from frame to frame / its median (at the seam, 0.8 to 1.25 goes unnoticed)",
        "flow and light at the seam: change there / 95th percentile of the loop's other changes",
        "least detail: detail of the blurriest frame / median detail",
    )
    remarks = (*(captions if rows else ()), *found.sentences.blends)
    return Detail(("loop", *names), tuple(rows), remarks)


def _maps(found: Inspection) -> Detail:
    rows = [
        (stated.kind, stated.engine, stated.strength, ", ".join(stated.files))
        for stated in found.maps
    ]
    return Detail(("map", "for", "strength", "files"), tuple(rows), found.sentences.motion)


def _flakes(found: Inspection) -> Detail:
    rows = []
    for name, flakes in found.flakes.items():
        rounds = f", {flakes.rounds} rounds of the loop" if flakes.rounds > 1 else ""
        rows.append((name, "length", f"{flakes.seconds:.4g} s{rounds}", "", ""))
        for figure in flakes.figures:
            verdict = "" if figure.is_in_range else "out of range"
            wanted = range_text(figure.low, figure.high)
            rows.append((name, figure.name, value_text(figure), wanted, verdict))
    remarks = list(found.sentences.flakes)
    if remarks and not rows:
        remarks.append(
            "flakes: their tracks are not beside the atlas; tracks: [json] has them measured here"
        )
    return Detail(("flakes of", "", "", "should be", ""), tuple(rows), tuple(remarks))


DETAILS: Mapping[str, Callable[[Inspection], Detail]] = {
    "pages": _pages,
    "memory": _memory,
    "budget": _budget,
    "frames": _frames,
    "overdraw": _overdraw,
    "loops": _loops,
    "maps": _maps,
    "flakes": _flakes,
}
"""The tables that ``inspect`` prints by their names."""
