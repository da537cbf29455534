"""Clips that go round: as they are, cut where their end meets their beginning, or going on longer
than they are."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.closing import SEAM, is_closed
from fire_atlas.timeline.continuing import continued_loop
from fire_atlas.timeline.cutting import Footage, best_cut
from fire_atlas.timeline.footage import footage_of, overlap_of
from fire_atlas.timeline.once import FEWEST, as_it_is
from fire_atlas.timeline.one_shot import why_once
from fire_atlas.timeline.splicing import spliced
from fire_atlas.timeline.takes import Join, edit_of_loop, started_at
from fire_atlas.vision.sampling import Samples
from fire_atlas.vision.thumbnails import Thumbnails


def recognised(clip: Clip, workers: Workers) -> Clip:
    """Return the frames as they are; they loop if their end meets their beginning."""
    if clip.loop or clip.count < 3:
        return clip
    samples = Samples.of(clip, workers)
    return replace(clip, loop=is_closed(samples) and why_once(samples) is None)


def looped(
    clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the best loop the clip gives, or the clip played once if it is not meant for one."""
    if clip.loop and wanted in (None, clip.count):
        return clip
    if clip.count < 3:
        return as_it_is(clip, wanted, "it has too few frames to go round")
    samples = Samples.of(clip, workers)
    why = None if clip.loop else why_once(samples)
    if why:
        return _played_once(clip, wanted, why, progress)
    closed = clip.loop or is_closed(samples)
    if closed and wanted in (None, clip.count):
        return replace(clip, loop=True)
    if clip.count < FEWEST and not closed:
        why = f"it has only {clip.count} frames and its end does not meet its beginning"
        return _played_once(clip, wanted, why, progress)
    footage = footage_of(clip, timeline, wanted, closed, workers)
    joins = _joins(footage, wanted)
    if joins and not wanted and footage.overlap == 0 and footage.jump(joins[0]) > SEAM:
        why = "its few colours cannot be mixed, and no end meets a beginning"
        return _played_once(clip, wanted, why, progress)
    if joins is None:
        raise RecipeError(
            f"timeline.frames: no loop of {wanted} frames can be made of {clip.count}; give "
            "another number, or a smaller timeline.overlap"
        )
    edit = edit_of_loop(joins, footage.overlap, footage.count)
    progress.note(_told(joins, footage, len(edit.shown)))
    return spliced(clip, edit, footage.thumbnails, workers)


def _played_once(clip: Clip, wanted: int | None, why: str, progress: Progress) -> Clip:
    """Return a clip that is not meant to go round, and tell why."""
    progress.note(f"{why}, so it plays once; timeline.loop: crossfade would make it go round")
    return as_it_is(clip, wanted, why)


def _joins(footage: Footage, wanted: int | None) -> list[Join] | None:
    """One join if the clip is long enough, else several."""
    cut = best_cut(footage, wanted)
    if cut is not None:
        return [cut]
    joins = continued_loop(footage, wanted) if wanted else None
    if joins is None:
        return None
    # It may begin after any of its joins: where the first step is like most.
    return started_at(joins, min(joins, key=lambda join: abs(footage.step_into(join) - 1)))


def crossfaded(clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers) -> Clip:
    """Return the clip from its first frame on, its end passing into its beginning."""
    overlap = overlap_of(clip, timeline, wanted)
    longest = clip.count - overlap
    length = wanted or longest
    if longest <= overlap:
        raise RecipeError(
            f"timeline.loop: crossfade needs more than the {clip.count} frames of this clip"
        )
    if not overlap < length <= longest:
        raise RecipeError(
            f"timeline.frames asks for {length} frames, but {clip.count} frames of which {overlap} "
            f"pass into the first ones give {overlap + 1} to {longest}; "
            "use loop: auto to go on longer, or a smaller timeline.overlap"
        )
    edit = edit_of_loop([Join(length, 0)], overlap, clip.count)
    numbers = range(length + overlap)
    return spliced(clip, edit, Thumbnails.of(clip, numbers, workers), workers)


def _told(joins: list[Join], footage: Footage, length: int) -> str:
    """Say how the clip is cut."""
    faded = f"cross-faded over {footage.overlap} frames" if footage.overlap else "cut hard"
    if len(joins) == 1:
        first = (joins[0].beginning + footage.overlap) % footage.count
        return f"a loop of {length} frames from frame {first} on, {faded} at its end"
    return f"a loop of {length} frames with {len(joins)} passages between moments alike, {faded}"
