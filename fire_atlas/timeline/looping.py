"""Make clips that loop, or play once: as they are, cut where their end passes into their beginning,
or extended."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import luminance
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.continuing import extend_loop, extend_once
from fire_atlas.timeline.cutting import CutAnalysis, analyse_cuts, best_cut, overlap_of
from fire_atlas.timeline.edit_list import Transition, apply_edit, loop_edit, one_shot_edit
from fire_atlas.vision.sampling import ClipSamples
from fire_atlas.vision.thumbnails import Thumbnails, distance

_UNSEEN_SEAM = 1.25
"""A seam this many times the median step is no more seen than the steps are."""

_FEWEST_FRAMES = 8
"""A clip of fewer frames is drawn to be played as it is."""

_DARK = 0.15
"""A frame with less than this share of the brightest frame's light shows next to nothing."""

_DARK_SCENE = 2 / 3
"""Where a lit scene is behind the fire, such a frame has less than this share of all light too."""


def keep_frames(clip: Clip, workers: Workers) -> Clip:
    """Return the frames as they are; they loop if the last one passes into the first."""
    if clip.loop or clip.count < 3:
        return clip
    samples = ClipSamples.of(clip, workers)
    return replace(clip, loop=_is_closed(samples) and _why_one_shot(samples) is None)


def loop_clip(
    clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the best loop the clip gives, or the clip played once if it is not meant for one.

    Args:
        clip: At its own rate.
        timeline: Of the recipe.
        wanted: Frames of the result; None: any number.
        workers: To look at the frames.
        progress: Gets a note of what was decided.

    Raises:
        RecipeError: There is no loop of so many frames.
    """
    if clip.loop and wanted in (None, clip.count):
        return clip
    if clip.count < 3:
        return _played_as_it_is(clip, wanted, "it has too few frames to go round")
    samples = ClipSamples.of(clip, workers)
    closed = clip.loop or _is_closed(samples)
    why = None if clip.loop else _why_one_shot(samples)
    if why is None and clip.count < _FEWEST_FRAMES and not closed:
        why = f"it has only {clip.count} frames and its end does not meet its beginning"
    if why:
        return _played_once(clip, wanted, why, progress)
    if closed and wanted in (None, clip.count):
        return replace(clip, loop=True)
    analysis = analyse_cuts(clip, timeline, wanted, closed, workers)
    return _cut_to_loop(clip, analysis, wanted, workers, progress)


def play_once(clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers) -> Clip:
    """Return the clip played once; if more frames are wanted than it has, the fire is extended.

    Raises:
        RecipeError: It cannot be.
    """
    if wanted is None or wanted <= clip.count:
        return replace(clip, loop=False)
    if clip.count < _FEWEST_FRAMES:
        return _played_as_it_is(clip, wanted, "it has too few frames to go on from")
    if why := _why_one_shot(ClipSamples.of(clip, workers)):
        return _played_as_it_is(clip, wanted, why)
    analysis = analyse_cuts(clip, timeline, wanted, False, workers)
    transitions = extend_once(analysis, wanted)
    if transitions is None:
        why = "no two of its moments look alike enough to go on from"
        return _played_as_it_is(clip, wanted, why)
    edit = one_shot_edit(transitions, analysis.overlap, wanted)
    return apply_edit(clip, edit, analysis.thumbnails, workers)


def crossfade(clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers) -> Clip:
    """Return the clip from its first frame on, its end passing into its beginning.

    Raises:
        RecipeError: The clip has too few frames for that.
    """
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
    edit = loop_edit([Transition(length, 0)], overlap, clip.count)
    thumbnails = Thumbnails.of(clip, range(length + overlap), workers)
    return apply_edit(clip, edit, thumbnails, workers)


def _cut_to_loop(
    clip: Clip, analysis: CutAnalysis, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the best loop that can be cut from a clip, or the clip played once."""
    transitions = _loop_transitions(analysis, wanted)
    if transitions is None:
        raise RecipeError(
            f"timeline.frames: no loop of {wanted} frames can be made of {clip.count}; give "
            "another number, or a smaller timeline.overlap"
        )
    is_hard = analysis.overlap == 0
    if is_hard and not wanted and analysis.hard_step(transitions[0]) > _UNSEEN_SEAM:
        why = "its few colours cannot be mixed, and no end meets a beginning"
        return _played_once(clip, wanted, why, progress)
    edit = loop_edit(transitions, analysis.overlap, analysis.count)
    progress.note(_described(transitions, analysis, len(edit.frames)))
    return apply_edit(clip, edit, analysis.thumbnails, workers)


def _loop_transitions(analysis: CutAnalysis, wanted: int | None) -> list[Transition] | None:
    """Return one transition if the clip is long enough, else several; None if there is no loop."""
    cut = best_cut(analysis, wanted)
    if cut is not None:
        return [cut]
    found = extend_loop(analysis, wanted) if wanted else None
    if found is None:
        return None
    # It may begin after any of its transitions: where the first step is most like the median.
    last = found.index(min(found, key=lambda each: abs(analysis.step_after(each) - 1)))
    return found[last + 1 :] + found[: last + 1]


def _described(transitions: list[Transition], analysis: CutAnalysis, length: int) -> str:
    """Say how the clip is cut."""
    overlap = analysis.overlap
    faded = f"cross-faded over {overlap} frames" if overlap else "cut hard"
    if len(transitions) == 1:
        first = (transitions[0].beginning + overlap) % analysis.count
        return f"a loop of {length} frames from frame {first} on, {faded} at its end"
    passages = f"{len(transitions)} passages between moments alike"
    return f"a loop of {length} frames with {passages}, {faded}"


def _played_once(clip: Clip, wanted: int | None, why: str, progress: Progress) -> Clip:
    """Return a clip that is not meant to loop as it is, and note why."""
    progress.note(f"{why}, so it plays once; timeline.loop: crossfade would make it go round")
    return _played_as_it_is(clip, wanted, why)


def _played_as_it_is(clip: Clip, wanted: int | None, why: str) -> Clip:
    """Return a clip that plays once and cannot be extended.

    Raises:
        RecipeError: More frames are wanted than it has.
    """
    if wanted is not None and wanted > clip.count:
        raise RecipeError(
            f"timeline.frames asks for more than the {clip.count} frames of this clip, but {why}; "
            "leave timeline.frames out, or let flakes burn out with timeline.tail: true"
        )
    return clip


def _is_closed(samples: ClipSamples) -> bool:
    """Whether the step from the last frame to the first is like those in between."""
    if samples.count < 3:
        return False
    seam = distance(samples.frames[samples.count - 1], samples.frames[0])
    return seam <= _UNSEEN_SEAM * float(np.median(samples.steps()))


def _why_one_shot(samples: ClipSamples) -> str | None:
    """Say, as a clause, why a clip is meant to play once; None if nothing speaks for that.

    What decides is light, summed over the frame: it is next to nothing at one end or at both, and
    nowhere in between, where a fire that only flickers would be dark too.
    """
    whole, fire = _light(samples)
    dark = (fire < _DARK * fire.max()) & (whole < _DARK_SCENE * whole.max())
    bright = np.flatnonzero(~dark)
    if not dark.any() or dark[bright[0] : bright[-1]].any():
        return None
    ends = {"flares up from nothing": dark[0], "fades to nothing": dark[-1]}
    does = " and ".join(what for what, is_so in ends.items() if is_so)
    least = 100 * float(fire[dark].min() / fire.max())
    return f"the fire {does} ({least:.0f} % of its brightest light)"


def _light(samples: ClipSamples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the light of each sampled frame: all of it, and without what is always there.

    Only in an opaque scene is there anything beside the fire.
    """
    frames = samples.frames.values()
    planes = np.stack([luminance(frame) for frame in frames])
    is_scene = all(frame[..., 3].min() >= 1 for frame in frames)
    behind = planes.min(axis=0) if is_scene else np.zeros_like(planes[0])
    return planes.sum(axis=(1, 2), dtype=np.float64), (planes - behind).sum(
        axis=(1, 2), dtype=np.float64
    )
