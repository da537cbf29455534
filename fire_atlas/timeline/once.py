"""Clips that play once."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.continuing import continued_once
from fire_atlas.timeline.footage import footage_of
from fire_atlas.timeline.one_shot import why_once
from fire_atlas.timeline.splicing import spliced
from fire_atlas.timeline.takes import edit_played_once
from fire_atlas.vision.sampling import Samples

FEWEST = 8
"""A clip of fewer frames is drawn to be played as it is."""


def once(clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers) -> Clip:
    """Return the clip played once; if more frames are wanted than it has, the fire goes on."""
    if wanted is None or wanted <= clip.count:
        return replace(clip, loop=False)
    if clip.count < FEWEST:
        return as_it_is(clip, wanted, "it has too few frames to go on from")
    if why := why_once(Samples.of(clip, workers)):
        return as_it_is(clip, wanted, why)
    footage = footage_of(clip, timeline, wanted, False, workers)
    joins = continued_once(footage, wanted)
    if joins is None:
        return as_it_is(clip, wanted, "no two of its moments look alike enough to go on from")
    edit = edit_played_once(joins, footage.overlap, wanted)
    return spliced(clip, edit, footage.thumbnails, workers)


def as_it_is(clip: Clip, wanted: int | None, why: str) -> Clip:
    """Return a clip that plays once and cannot go on."""
    if wanted is not None and wanted > clip.count:
        raise RecipeError(
            f"timeline.frames asks for more than the {clip.count} frames of this clip, but {why}; "
            "leave timeline.frames out, or let flakes burn out with timeline.tail: true"
        )
    return clip
