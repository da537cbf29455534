"""Make a clip loop or play once: as it is, cut where its end best matches its beginning, played
there and back, or extended."""

from collections.abc import Callable
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
from fire_atlas.timeline.holds import Holds
from fire_atlas.vision.sampling import ClipSamples, step_lengths
from fire_atlas.vision.steps import held_steps, median_step
from fire_atlas.vision.thumbnails import Thumbnails, distance

_UNSEEN_SEAM = 1.25
"""A seam of at most this many median steps is no more visible than the steps are."""

_SHORT_STEP = 0.25
"""A sampled step below this fraction of others, or of the distance of frames that are far apart,
may lie between two frames that show the same drawing."""

_MIN_FRAMES = 8
"""A clip of fewer frames is not cut: it was drawn to be played as it is."""

_DARK = 0.15
"""A frame with less than this fraction of the brightest frame's fire shows almost nothing."""

_DARK_SCENE = 2 / 3
"""Such a frame also has less than this fraction of the brightest frame's light, scene included."""


def keep_frames(clip: Clip, workers: Workers, progress: Progress) -> Clip:
    """Return the frames as they are; they loop if the step from the last to the first is small."""
    if clip.loop or clip.count < 3:
        return clip
    samples = ClipSamples.of(clip, workers)
    why = _why_one_shot(samples)
    usual = _usual_step(clip, samples, workers)
    loop = why is None and _is_closed(samples, usual)
    played = "loop" if loop else "play once"
    progress.note(
        f"the frames are packed as they are, and {played}: {why or _seam_clause(samples, usual)}"
    )
    return replace(clip, loop=loop)


def loop_clip(
    clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the best loop of the clip, or the clip played once if it is not meant to loop.

    Args:
        clip: The clip at its own rate.
        timeline: The recipe's section.
        wanted: Number of frames of the result; None for any number.
        workers: Read and compare frames in parallel.
        progress: Receives a note on what was decided.

    Raises:
        RecipeError: There is no loop of this length.
    """
    if clip.loop and wanted in (None, clip.count):
        return clip
    if clip.count < 3:
        progress.note(f"the clip plays once: a loop has at least 3 frames, and it has {clip.count}")
        return _played_as_it_is(clip, wanted, "it has too few frames to loop")
    samples = ClipSamples.of(clip, workers)
    usual = _usual_step(clip, samples, workers)
    closed = clip.loop or _is_closed(samples, usual)
    why = None if clip.loop else _why_one_shot(samples)
    if why is None and clip.count < _MIN_FRAMES and not closed:
        why = f"it has only {clip.count} frames and its end does not match its beginning"
    if why:
        return _played_once(clip, wanted, why, progress)
    if closed and wanted in (None, clip.count):
        progress.note(f"the clip loops as it is: {_seam_clause(samples, usual)}")
        return replace(clip, loop=True)
    analysis = analyse_cuts(clip, timeline, wanted, closed, workers)
    return _cut_to_loop(clip, analysis, wanted, workers, progress)


def extended(
    clip: Clip, timeline: Timeline, wanted: int, workers: Workers, progress: Progress
) -> Clip:
    """Return the clip played once and on, to more frames than it has.

    Raises:
        RecipeError: The fire cannot be extended.
    """
    check_extension(clip.count)
    if why := _why_one_shot(ClipSamples.of(clip, workers)):
        return _played_as_it_is(clip, wanted, why)
    analysis = analyse_cuts(clip, timeline, wanted, False, workers)
    transitions = _first_found(lambda cut_analysis: extend_once(cut_analysis, wanted), analysis)
    if transitions is None:
        why = "no two of its moments look alike enough to jump between"
        return _played_as_it_is(clip, wanted, why)
    progress.note(
        f"{clip.count} frames go on to {wanted} (timeline.frames), with "
        f"{_transitions_clause(len(transitions), analysis.overlap)}"
    )
    edit = one_shot_edit(transitions, analysis.overlap, wanted, analysis.holds)
    return apply_edit(clip, edit, analysis.thumbnails, workers)


def check_extension(count: int) -> None:
    """Refuse to play a clip of ``count`` frames once and on, to more frames than it has.

    Raises:
        RecipeError: It has too few.
    """
    if count < _MIN_FRAMES:
        raise _too_long(count, "it has too few frames to be extended")


def crossfade(
    clip: Clip, timeline: Timeline, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the clip from its first frame on, its end cross-faded into its beginning.

    Raises:
        RecipeError: The clip has too few frames for that.
    """
    overlap = check_crossfade(clip.count, clip.fps, timeline, wanted)
    holds = _open_holds(clip, workers)
    if timeline.overlap == "auto":
        overlap = holds.start_before(overlap) or overlap
    length = wanted or holds.start_before(clip.count - overlap)
    _check_crossfaded(length, clip.count, overlap)
    edit = loop_edit([Transition(length, 0)], overlap, holds)
    thumbnails = Thumbnails.of(clip, range(length + overlap), workers)
    seam = _step_clause(float(thumbnails.distances[length - 1, 0]), thumbnails.median_step)
    progress.note(
        f"a loop of {length} frames, its end cross-faded into its beginning over {overlap} frames "
        f"(timeline.loop: crossfade); uncut, {seam}"
    )
    return apply_edit(clip, edit, thumbnails, workers)


def check_crossfade(count: int, fps: float, timeline: Timeline, wanted: int | None) -> int:
    """Return the number of frames by which a clip of ``count`` frames overlaps itself, at most.

    Raises:
        RecipeError: The clip has too few frames for that, or for a loop of ``wanted`` ones.
    """
    overlap = overlap_of(count, fps, timeline, wanted)
    if count - overlap <= overlap:
        raise RecipeError(
            f"crossfade needs more than the {count} frames of this clip", key=("timeline", "loop")
        )
    if wanted and timeline.overlap != "auto":
        _check_crossfaded(wanted, count, overlap)
    return overlap


def _check_crossfaded(length: int, count: int, overlap: int) -> None:
    longest = count - overlap
    if not overlap < length <= longest:
        raise RecipeError(
            f"asks for {length} frames, but {count} frames of which {overlap} fade into the first "
            f"ones give {overlap + 1} to {longest}; use loop: auto for a longer loop, or a smaller "
            f"timeline.overlap",
            key=("timeline", "frames"),
        )


def check_pingpong(count: int, frames: int | None) -> None:
    """Refuse to play a clip of ``count`` frames there and back for ``frames`` ones; None for all.

    Raises:
        RecipeError: The clip has too few frames.
    """
    longest = 2 * count - 2
    if not 2 <= (frames or longest) <= longest:
        raise RecipeError(
            f"asks for {frames or 2} frames, but {count} frames played forwards and backwards give "
            f"at most {longest}; leave timeline.frames out, or use loop: auto",
            key=("timeline", "frames" if frames else "loop"),
        )


def pingpong(
    clip: Clip, frames: int | None, why: str, workers: Workers, progress: Progress
) -> Clip:
    """Return ``clip`` played forwards, then backwards; neither of its ends is shown twice.

    Args:
        clip: The clip, of at least 2 frames.
        frames: Length of the result, even; None plays all of the clip.
        why: Why it is, as a clause for the user.
        workers: Compare frames in parallel, to find those that are held.
        progress: Receives a note on what was done.

    Raises:
        RecipeError: The clip has too few frames.
    """
    check_pingpong(clip.count, frames)
    there = frames // 2 + 1 if frames else clip.count
    # The drawings at both ends are shown once, for as long as they are held.
    holds = Holds.none(clip.count) if frames else _open_holds(clip, workers)
    at_start, at_end = (int(holds.length[i]) for i in (0, -1))
    count = frames or max(2 * there - at_start - at_end, there)
    progress.note(f"a loop of {count} frames, forwards and backwards ({why})")
    flow = clip.flow

    def shown(i: int) -> int:
        return i if i < there else 2 * there - 1 - at_end - i

    return replace(
        clip,
        count=count,
        picture=lambda i: clip.picture(shown(i)),
        loop=True,
        flow=None if flow is None else lambda i: flow(shown(i)),
        backwards=frozenset(range(there - 1, count)),
    )


def _open_holds(clip: Clip, workers: Workers) -> Holds:
    """Return the holds of a clip whose last frame the first does not follow."""
    return Holds.of(replace(clip, loop=False), workers)


def _cut_to_loop(
    clip: Clip, analysis: CutAnalysis, wanted: int | None, workers: Workers, progress: Progress
) -> Clip:
    """Return the best loop that can be cut from a clip; flat art is else played there and back, and
    a clip that mostly stands still is whole: any of its pauses would be the best loop."""
    if not wanted and analysis.thumbnails.median_step == 0:
        progress.note("the clip loops whole: most of its frames are equal, so no cut keeps them")
        return replace(clip, loop=True)
    transitions = _first_found(
        lambda cut_analysis: _loop_transitions(cut_analysis, wanted), analysis
    )
    if transitions is None:
        raise RecipeError(
            f"no loop of {wanted} frames can be made of {clip.count}; give another number, or a "
            f"smaller timeline.overlap",
            key=("timeline", "frames"),
        )
    is_hard = analysis.overlap == 0
    if is_hard and not wanted and analysis.hard_step(transitions[0]) > _UNSEEN_SEAM:
        why = "it has too few colours to mix them unseen, and no end matches a beginning"
        return pingpong(clip, None, why, workers, progress)
    edit = loop_edit(transitions, analysis.overlap, analysis.holds)
    why = "timeline.frames" if wanted else f"uncut, {_uncut_seam(analysis)}"
    progress.note(f"{_cut_note(transitions, analysis, len(edit.frames))} ({why})")
    return apply_edit(clip, edit, analysis.thumbnails, workers)


def _loop_transitions(analysis: CutAnalysis, wanted: int | None) -> list[Transition] | None:
    """Return one transition if the clip is long enough, else several; None if there is no loop."""
    cut = best_cut(analysis, wanted)
    if cut is not None:
        return [cut]
    found = extend_loop(analysis, wanted) if wanted else None
    if found is None:
        return None
    # The loop may begin after any transition: choose the one after which the step is most usual.
    last = found.index(min(found, key=lambda transition: abs(analysis.step_after(transition) - 1)))
    return found[last + 1 :] + found[: last + 1]


def _first_found(
    find: Callable[[CutAnalysis], list[Transition] | None], analysis: CutAnalysis
) -> list[Transition] | None:
    """Return what ``find`` finds; if holds leave nothing to be found, regardless of these."""
    return find(analysis) or find(replace(analysis, holds=Holds.none(analysis.count)))


def _cut_note(transitions: list[Transition], analysis: CutAnalysis, length: int) -> str:
    """Return a note on how the clip is cut."""
    overlap = analysis.overlap
    if len(transitions) == 1:
        first = (transitions[0].beginning + overlap) % analysis.count
        return f"a loop of {length} frames from frame {first} on, {_cut_clause(overlap)} at its end"
    return f"a loop of {length} frames with {_transitions_clause(len(transitions), overlap)}"


def _transitions_clause(count: int, overlap: int) -> str:
    jumps = "a jump" if count == 1 else f"{count} jumps"
    return f"{jumps} between similar moments, {_cut_clause(overlap)}"


def _cut_clause(overlap: int) -> str:
    return f"cross-faded over {overlap} frames" if overlap else "cut hard"


def _uncut_seam(analysis: CutAnalysis) -> str:
    thumbnails = analysis.thumbnails
    return _step_clause(float(thumbnails.distances[-1, 0]), thumbnails.median_step)


def _played_once(clip: Clip, wanted: int | None, why: str, progress: Progress) -> Clip:
    """Return a clip that is not meant to loop unchanged, and note why."""
    progress.note(f"{why}, so it plays once; timeline.loop: crossfade would make it loop")
    return _played_as_it_is(clip, wanted, why)


def _played_as_it_is(clip: Clip, wanted: int | None, why: str) -> Clip:
    """Return a clip that cannot be extended unchanged.

    Raises:
        RecipeError: More frames are wanted than it has.
    """
    if wanted is not None and wanted > clip.count:
        raise _too_long(clip.count, why)
    return clip


def _too_long(count: int, why: str) -> RecipeError:
    return RecipeError(
        f"asks for more than the {count} frames of this clip, but {why}; leave it out, or let "
        f"flakes burn out with timeline.tail: true",
        key=("timeline", "frames"),
    )


def _usual_step(clip: Clip, samples: ClipSamples, workers: Workers) -> float:
    """Return the median step; of a clip that holds frames, of the steps to another drawing.

    All frames are compared only if the sampled steps may be those within holds.
    """
    steps = samples.steps()
    apart = [distance(samples.frames[0], samples.frames[i]) for i in samples.pair_starts[1:]]
    if min(steps) < _SHORT_STEP * max(*steps, float(np.median(apart or [0.0]))):
        lengths = step_lengths(clip, workers)
        if held_steps(lengths, clip.loop).any():
            return median_step(lengths, clip.loop)
    return float(np.median(steps))


def _is_closed(samples: ClipSamples, usual: float) -> bool:
    """Whether the step from the last frame to the first is about as small as those between."""
    return samples.count >= 3 and _seam(samples) <= _UNSEEN_SEAM * usual


def _seam(samples: ClipSamples) -> float:
    """Return the distance of the last frame to the first."""
    return distance(samples.frames[samples.count - 1], samples.frames[0])


def _seam_clause(samples: ClipSamples, usual: float) -> str:
    return _step_clause(_seam(samples), usual)


def _step_clause(seam: float, median: float) -> str:
    """Return a clause that compares the step from the last frame to the first with the others."""
    if median == 0:
        return "most of its frames are equal"
    return f"the step from its last frame to its first is {seam / median:.2f} times the median step"


def _why_one_shot(samples: ClipSamples) -> str | None:
    """Return, as a clause, why a clip is meant to play once; None if it may loop.

    It is, if the light of the whole frame is almost nothing at one end or both, but nowhere in
    between: a fire that only flickers would be dark there too.
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


def why_one_shot(clip: Clip, workers: Workers) -> str | None:
    """Return, as a clause, why a clip is meant to play once; None if it may loop."""
    return None if clip.loop else _why_one_shot(ClipSamples.of(clip, workers))


def _light(samples: ClipSamples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the light of each sampled frame: all of it, and that of the fire alone.

    They differ only in an opaque scene, whose constant light is subtracted.
    """
    frames = samples.frames.values()
    planes = np.stack([luminance(frame) for frame in frames])
    is_scene = all(frame[..., 3].min() >= 1 for frame in frames)
    behind = planes.min(axis=0) if is_scene else np.zeros_like(planes[0])
    return planes.sum(axis=(1, 2), dtype=np.float64), (planes - behind).sum(
        axis=(1, 2), dtype=np.float64
    )
