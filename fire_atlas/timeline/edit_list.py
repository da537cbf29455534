"""Edit lists: which frames of a clip follow each other, and which frames blend two stretches of
it."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, cached
from fire_atlas.core.picture import Picture, as_light
from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.holds import Holds
from fire_atlas.timeline.seam import plan_seam
from fire_atlas.vision.palette import Palette
from fire_atlas.vision.thumbnails import Thumbnails


class Transition(NamedTuple):
    """Where one stretch of a clip blends into another, over the frames of the overlap.

    Attributes:
        ending: First frame of the overlap in the stretch that ends.
        beginning: First frame of the overlap in the stretch that begins.
    """

    ending: int
    beginning: int


@dataclass(frozen=True, slots=True)
class EditList:
    """How a clip is cut, frame by frame.

    Attributes:
        frames: For each frame of the result, the number of the clip's frame that it shows, or the
            transition it belongs to and its number in the overlap.
        overlap: Number of frames of each transition.
        loop: Whether the first frame follows the last.
    """

    frames: tuple["int | tuple[Transition, int]", ...]
    overlap: int
    loop: bool

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """Every transition once, in the order in which it is shown."""
        return tuple(dict.fromkeys(frame[0] for frame in self.frames if not isinstance(frame, int)))


def loop_edit(transitions: list[Transition], overlap: int, holds: Holds) -> EditList:
    """Return the loop that makes these transitions in turn; the last leads back to its start.

    Frame numbers wrap around if the frames of the clip, which has these ``holds``, are a loop
    already. Transitions hold what they show as the stretch does that begins.
    """
    count = len(holds.first)
    frames: list[int | tuple[Transition, int]] = []
    at = transitions[-1].beginning + overlap
    for transition in transitions:
        frames += stretch(at, transition.ending, count)
        frames += [(transition, k) for k in holds.rhythm(transition.beginning, overlap)]
        at = transition.beginning + overlap
    return EditList(tuple(frames), overlap, loop=True)


def one_shot_edit(
    transitions: list[Transition], overlap: int, count: int, holds: Holds
) -> EditList:
    """Return ``count`` frames from the clip's first one on, played once, with the transitions.

    They hold what they show as in ``loop_edit``.
    """
    frames: list[int | tuple[Transition, int]] = []
    at = 0
    for transition in transitions:
        frames += range(at, transition.ending)
        frames += [(transition, k) for k in holds.rhythm(transition.beginning, overlap)]
        at = transition.beginning + overlap
    frames += range(at, at + count - len(frames))
    return EditList(tuple(frames), overlap, loop=False)


def stretch(first: int, end: int, count: int) -> list[int]:
    """Frame numbers from ``first`` until ``end``; they wrap at ``count`` if ``end`` is less."""
    return [n % count for n in range(first, end if end >= first else end + count)]


def apply_edit(clip: Clip, edit: EditList, thumbnails: Thumbnails, workers: Workers) -> Clip:
    """Return ``clip`` cut as ``edit`` says; frames of transitions are blended when read."""
    mean = as_plane(thumbnails.frames.mean(axis=0))
    palette = Palette.of(clip, workers)
    seams = {
        transition: plan_seam(clip, _pairs(transition, edit.overlap, clip.count), mean, workers)
        for transition in edit.transitions
    }

    def picture(i: int) -> Picture:
        shown = edit.frames[i]
        if isinstance(shown, int):
            return clip.picture(shown)
        transition, k = shown
        one, other = (clip.read((start + k) % clip.count) for start in transition)
        return seams[transition][k].blend(one, other, mean, palette)

    def flow(i: int) -> NDArray[np.float32]:
        assert clip.flow is not None, "only given where the clip has one"
        shown = edit.frames[i]
        if isinstance(shown, int):
            return clip.flow(shown)
        transition, k = shown
        one, other = (clip.flow((start + k) % clip.count) for start in transition)
        return as_plane(one + (other - one) * ((k + 1) / (edit.overlap + 1)))

    blended = {i for i, shown in enumerate(edit.frames) if not isinstance(shown, int)}
    read = cached(picture, blended)
    errors = workers.map(lambda i: palette.hue_error(as_light(read(i))), sorted(blended))
    return replace(
        clip,
        count=len(edit.frames),
        picture=read,
        hue_error=max(errors, default=None),
        loop=edit.loop,
        flow=None if clip.flow is None else flow,
    )


def _pairs(transition: Transition, overlap: int, count: int) -> list[tuple[int, int]]:
    """Return for each frame of a transition the two frames of the clip that it blends."""
    return [
        ((transition.ending + k) % count, (transition.beginning + k) % count)
        for k in range(overlap)
    ]
