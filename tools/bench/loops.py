"""How well the real clips go round, and what closing them costs.

Run it from the checkout: ``python -m tools.bench.loops [--json]``. FIRE_ATLAS_CLIPS names the
folder of clips; those that are not there are left out.

Every clip is closed by ``timeline.loop: auto``; the same cut is then made hard, and with a plain
linear cross-fade. Figures, all linear and premultiplied:

- ``seam``: step from the last frame to the first, against the median step (0.8 to 1.25);
- ``step``: largest step inside the overlap, against the median (at most 1.25);
- ``flow``: optical flow at the seam, against the 95th percentile of all other steps (at most 1);
- ``detail``: least gradient energy in the overlap, against the median (at least 0.9);
- ``clip``: the least gradient energy of any other frame, to compare with;
- ``light``: change of light at the seam, against the 95th percentile of all other steps.

Clips that close already are left as they are, whatever their figures: the seam is their own. What
``loop: crossfade`` would make of them stands below. The last columns are CPU time: what ``auto``
takes for its decision and plan, a frame of the clip, and what a frame of the overlap takes to make.

Exits 1 if a loop that ``auto`` has cut misses a bound.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.progress import SilentProgress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.arrange import arrange
from fire_atlas.timeline.cutting import analyse_cuts, best_cut
from fire_atlas.timeline.edit_list import loop_edit
from fire_atlas.vision.loop_figures import LoopFigures, loop_figures
from tests.support.clips import ALL_CLIPS, kept, real_clip

HEADS = ("clip", "closed by", "frames", "seam", "step", "flow", "detail", "clip", "light",
         "plan ms", "made ms")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table."""

    clip: str
    closed_by: str
    frames: int
    seam: float
    step: float
    flow: float
    detail: float
    others: float
    light: float
    plan_ms: float = 0.0
    made_ms: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether every bound is kept."""
        is_seen = not 0.8 <= self.seam <= 1.25 or self.step > 1.25
        return not is_seen and self.flow <= 1 and self.detail >= 0.9


def _row(clip: str, closed_by: str, figures: LoopFigures, overlap: int, *ms: float) -> Row:
    count = len(figures.steps)
    seam = slice(count - overlap - 1, count)
    details = figures.details / np.median(figures.details)
    here = slice(count - overlap, count) if overlap else slice(-1, None)
    return Row(
        clip, closed_by, count,
        figures.seam_ratio, float(figures.steps[seam].max() / np.median(figures.steps)),
        figures.seam_flow, float(details[here].min()), float(details[: here.start].min()),
        figures.seam_light, *ms,
    )  # fmt: skip


def _figures(read: Callable[[int], Pixels], count: int) -> LoopFigures:
    return loop_figures(read(i) for i in range(count))


def _compared(name: str, clip: Clip) -> list[Row]:
    """Close a clip by default, by a hard cut and by a linear cross-fade of the same frames."""
    begun = time.process_time()
    with Workers(2) as workers:
        loop = arrange(clip, Timeline(), 0.0, workers, SilentProgress())
        planned = 1e3 * (time.process_time() - begun) / clip.count
        if not loop.loop:
            return []
        if loop.count == clip.count:
            return [_row(name, "itself", _figures(loop.read, loop.count), 0, planned)]
        analysis = analyse_cuts(clip, Timeline(), None, False, workers)
    cut, overlap = best_cut(analysis, None), analysis.overlap
    assert cut is not None
    edit = loop_edit([cut], overlap, analysis.holds)
    begun = time.process_time()
    frames = [loop.read(i) for i in range(loop.count)]
    made = 1e3 * (time.process_time() - begun) / max(overlap, 1)

    def hard(i: int) -> Pixels:
        part = edit.frames[i]
        return clip.read(part if isinstance(part, int) else part[0].ending + part[1])

    def linear(i: int) -> Pixels:
        part = edit.frames[i]
        if isinstance(part, int):
            return clip.read(part)
        transition, k = part
        one, other = clip.read(transition.ending + k), clip.read(transition.beginning + k)
        return one + (other - one) * np.float32((k + 1) / (overlap + 1))

    return [
        _row(name, "auto", _figures(lambda i: frames[i], loop.count), overlap, planned, made),
        _row(name, "linear", _figures(linear, loop.count), overlap),
        _row(name, "hard cut", _figures(hard, loop.count), overlap),
    ]


def _crossfaded(name: str, clip: Clip) -> list[Row]:
    """A clip that closes already, closed once more: what the cross-fade itself does to it."""
    timeline = Timeline(loop="crossfade")
    with Workers(2) as workers:
        loop = arrange(clip, timeline, 0.0, workers, SilentProgress())
        figures = _figures(loop.read, loop.count)
    return [_row(name, "crossfade", figures, clip.count - loop.count)]


def main() -> int:
    """Print the table, or JSON lines."""
    folder = Path(os.environ.get("FIRE_ATLAS_CLIPS", "clips"))
    rows: list[Row] = []
    for name in ALL_CLIPS:
        if not (folder / name).is_dir():
            continue
        clip = kept(replace(real_clip(folder, name), loop=False))
        found = _compared(name, clip)
        if not found:
            print(f"{name}: plays once", file=sys.stderr)
        elif found[0].closed_by == "itself":
            found += _crossfaded(name, clip)
        rows += found
    if "--json" in sys.argv[1:]:
        for row in rows:
            print(json.dumps(asdict(row)))
    else:
        print(("{:<27} {:<10}" + " {:>7}" * 9).format(*HEADS))
        for row in rows:
            values = (
                f"{v:.2f}" if isinstance(v, float) else v for v in list(asdict(row).values())[2:]
            )
            print(("{:<27} {:<10}" + " {:>7}" * 9).format(row.clip, row.closed_by, *values))
    return 0 if all(row.holds for row in rows if row.closed_by == "auto") else 1


if __name__ == "__main__":
    sys.exit(main())
