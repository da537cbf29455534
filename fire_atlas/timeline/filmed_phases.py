"""Find the loop in a clip that shows how its fire is lit, or goes out, and what is before and after
it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import luminance
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.cutting import analyse_cuts, best_cut
from fire_atlas.timeline.edit_list import apply_edit, loop_edit
from fire_atlas.timeline.holds import Holds
from fire_atlas.timeline.retiming import at_rate
from fire_atlas.vision.thumbnails import shrunk

_SIDE = 96
"""Longest side, px, of the small copies by which light is measured."""

_OUT = 0.05
"""Light, of that of the fire as it burns, up to which it is out."""

_BURNS = 0.6
"""Light, of the median, from which on the fire burns as it is to burn."""

_LEAST = 12
"""Minimum frames of the part in which it burns, for a loop to be looked for in it."""


@dataclass(frozen=True, slots=True)
class FilmedPhases:
    """A clip in parts.

    Attributes:
        loop: The fire as it burns.
        lit: What leads to the first frame of the loop; None if the clip does not begin dark.
        dying: What follows frame ``exit`` of the loop; None if the clip does not end dark.
        exit: Number of a frame of the loop.
        lit_fuel, dying_fuel: (frames,) light of ``lit`` and ``dying``, of that of the loop, 0..1.
    """

    loop: Clip
    lit: Clip | None
    dying: Clip | None
    exit: int
    lit_fuel: NDArray[np.float64]
    dying_fuel: NDArray[np.float64]


def filmed_phases(
    clip: Clip, timeline: Timeline, workers: Workers, progress: Progress
) -> FilmedPhases | None:
    """Return the parts of a clip whose fire is out in its first or last frame; None of others, and
    where no loop is found between."""
    if clip.loop or timeline.loop != "auto" or clip.count < _LEAST:
        return None
    if timeline.fps not in (None, clip.fps):
        fps = timeline.fps or clip.fps
        count = int((clip.count - 1) * fps / clip.fps) + 1
        clip = at_rate(clip, fps, count, workers, progress)
    light = _light(clip, workers)
    usual = float(np.median(light[light > light.max() / 2]))
    begins_dark, ends_dark = (light[[0, -1]] < _OUT * usual).tolist()
    burns = np.flatnonzero(light > _BURNS * usual)
    if not (begins_dark or ends_dark) or burns[-1] + 1 - burns[0] < _LEAST:
        return None
    first = int(burns[0]) if begins_dark else 0
    end = int(burns[-1]) + 1 if ends_dark else clip.count
    part = _section(clip, first, end)
    analysis = analyse_cuts(part, timeline, timeline.frames, False, workers)
    free = replace(analysis, holds=Holds.none(analysis.count))
    cut = best_cut(analysis, timeline.frames) or best_cut(free, timeline.frames)
    if cut is None:
        return None
    edit = loop_edit([cut], analysis.overlap, analysis.holds)
    begins = cut.beginning + analysis.overlap
    share = np.clip(light / usual, 0, 1)
    return FilmedPhases(
        loop=apply_edit(part, edit, analysis.thumbnails, workers),
        lit=_section(clip, 0, first + begins) if begins_dark else None,
        dying=_section(clip, first + cut.ending, clip.count) if ends_dark else None,
        exit=cut.ending - begins - 1,
        lit_fuel=share[: first + begins],
        dying_fuel=share[first + cut.ending :],
    )


def _section(clip: Clip, first: int, end: int) -> Clip:
    """Return frames ``first`` to ``end``, without the latter, as a clip that plays once."""
    return replace(
        clip,
        count=end - first,
        picture=lambda i: clip.picture(first + i),
        loop=False,
        backwards=frozenset(),
        flow=None,
        skipped={},
    )


def _light(clip: Clip, workers: Workers) -> NDArray[np.float64]:
    """Return the light of the fire in each frame; of an opaque scene what is brighter than it."""
    planes = list(workers.map(lambda i: luminance(shrunk(clip.read(i), _SIDE)), range(clip.count)))
    if clip.matte == "none":
        behind = np.min(planes, axis=0)
        planes = [plane - behind for plane in planes]
    return np.array([float(plane.sum()) for plane in planes])
