"""Arrange a clip as the recipe's ``timeline`` says: cut it, loop it, retime it, add a tail."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.tail import with_tail

_FEW_IMAGES = 3
"""So few images show no motion that could be played on."""


def arrange(
    clip: Clip,
    timeline: Timeline,
    longest_life: float,
    workers: Workers,
    progress: Progress,
    only_packs: bool = False,
    seed: int = 0,
) -> Clip:
    """Return ``clip`` as ``timeline`` plays it, before any analysis of its flame.

    Args:
        clip: The clip as its source delivers it.
        timeline: The recipe's section.
        longest_life: Maximum lifetime of a flake, s, which limits the tail.
        workers: Read and compare frames in parallel.
        progress: Receives notes on what was decided, and why.
        only_packs: Whether the recipe only packs finished frames. They are then kept unchanged
            unless ``timeline`` sets something.
        seed: The recipe's seed, by which a few images are animated.

    Raises:
        RecipeError: The timeline does not suit the clip.
    """
    check_timeline(timeline, clip.count, clip.fps)
    wanted = _wanted(timeline, clip.fps)
    keeps_rate = timeline.fps in (None, clip.fps)
    if only_packs and keeps_rate and timeline.model_copy(update={"fps": None}) == Timeline():
        from fire_atlas.timeline.looping import keep_frames

        return keep_frames(clip, workers, progress)
    if wanted and _become_a_flame(timeline, clip.count, wanted):
        from fire_atlas.timeline.few_images import animate_images

        played = animate_images(clip, wanted, timeline.loop == "auto", seed, workers)
        images = "1 image becomes" if clip.count == 1 else f"{clip.count} images become"
        progress.note(f"{images} {wanted} frames of a flame that sways (timeline.frames)")
    else:
        played = _played(clip, timeline, wanted, workers, progress)
    timed = _timed(played, timeline, workers, progress)
    if not timeline.tail:
        return timed
    if timed.loop:
        raise RecipeError(
            "lets flakes burn out after a clip that plays once, but this one loops; leave it out, "
            "or use timeline.loop: none",
            key=("timeline", "tail"),
        )
    longest = longest_life + 1 / timed.fps
    return with_tail(timed, longest if timeline.tail is True else min(timeline.tail, longest))


def check_timeline(timeline: Timeline, count: int, fps: float) -> None:
    """Refuse a timeline that cannot be, as far as the number of frames of its clip tells.

    Args:
        timeline: The recipe's section.
        count: Number of frames of the clip.
        fps: Their rate.

    Raises:
        RecipeError: The clip has too few frames.
    """
    wanted = _wanted(timeline, fps)
    if timeline.loop == "auto" or (timeline.loop == "none" and (wanted or 0) <= count):
        return
    from fire_atlas.timeline import looping

    match timeline.loop:
        case "none":
            if wanted and not _become_a_flame(timeline, count, wanted):
                looping.check_extension(count)
        case "pingpong":
            looping.check_pingpong(count, _even(wanted))
        case "crossfade":
            looping.check_crossfade(count, fps, timeline, wanted)


def _wanted(timeline: Timeline, fps: float) -> int | None:
    """Return how many frames of a clip the result lasts; None if the recipe does not state it."""
    rate = timeline.fps or fps
    return timeline.frames and max(1, round(timeline.frames * fps / rate))


def _become_a_flame(timeline: Timeline, count: int, wanted: int) -> bool:
    """Return whether so few images are wanted for longer that a flame is made of them."""
    are_images = count <= _FEW_IMAGES and timeline.loop in ("auto", "none")
    return are_images and count < wanted


def _even(wanted: int | None) -> int | None:
    return wanted + wanted % 2 if wanted else None


def _played(
    clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the clip cut or looped at its own rate; ``wanted`` is its length, if stated."""
    if timeline.loop == "none" and (wanted or 0) <= clip.count:
        progress.note(f"the clip plays once, {wanted or clip.count} frames (timeline.loop: none)")
        return replace(clip, loop=False)
    from fire_atlas.timeline import looping

    match timeline.loop:
        case "none":
            return looping.extended(clip, timeline, wanted or clip.count, workers, progress)
        case "pingpong":
            why = "timeline.loop: pingpong"
            return looping.pingpong(clip, _even(wanted), why, workers, progress)
        case "crossfade":
            return looping.crossfade(clip, timeline, wanted, workers, progress)
        case "auto":
            return looping.loop_clip(clip, timeline, wanted, workers, progress)


def _timed(played: Clip, timeline: Timeline, workers: Workers, progress: Progress) -> Clip:
    """Return the clip with the frame rate and the number of frames that the recipe states."""
    fps = timeline.fps or played.fps
    pace = played.fps / fps
    full = max(1, round(played.count / pace))
    if played.loop:
        count = timeline.frames or full
    else:
        count = min(timeline.frames or int((played.count - 1) / pace) + 1, full)
    if pace == 1:
        return replace(played, count=count)
    from fire_atlas.timeline.retiming import at_rate

    return at_rate(played, fps, count, workers, progress)
