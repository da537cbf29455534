"""What is known of a clip that is to be cut."""

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.cutting import Footage
from fire_atlas.timeline.pixel_art import is_pixel_art
from fire_atlas.vision.thumbnails import Thumbnails

_OVERLAP = 1 / 3
"""Seconds over which an end passes into a beginning, by itself."""

_SHARE = 5
"""At most this part of the clip passes over, by itself."""

_STRANGERS = 1.2
"""Where any two frames are no further apart than this many steps, neighbours have little in common,
and a hard cut is seen as little as any step."""

_MOST = 1024
"""Frames, from the first on, among which cuts are searched."""


def footage_of(
    clip: Clip, timeline: Timeline, wanted: int | None, closed: bool, workers: Workers
) -> Footage:
    """Look at all frames of ``clip``, of which ``wanted`` are to result.

    ``closed``: whether its first frame follows its last already.
    """
    used = min(clip.count, _MOST)
    thumbnails = Thumbnails.of(clip, range(used), workers)
    overlap = overlap_of(clip, timeline, wanted)
    are_strangers = thumbnails.usual <= _STRANGERS * thumbnails.step
    if timeline.overlap == "auto" and (are_strangers or is_pixel_art(clip)):
        overlap = 0
    return Footage(thumbnails, overlap, closed and used == clip.count)


def overlap_of(clip: Clip, timeline: Timeline, wanted: int | None) -> int:
    """Frames over which an end passes into a beginning."""
    most = max(1, min(clip.count, wanted or clip.count) // 2)
    if timeline.overlap == "auto":
        return max(1, min(round(_OVERLAP * clip.fps), most, clip.count // _SHARE))
    if timeline.overlap > most:
        raise RecipeError(
            f"timeline.overlap is {timeline.overlap} frames, but with {clip.count} frames in and "
            f"{wanted or 'as many'} out at most {most} can overlap"
        )
    return timeline.overlap
