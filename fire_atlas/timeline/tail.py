"""Add frames after a clip that plays once, in which its last flakes burn out."""

import math
from dataclasses import replace

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import Picture

_FADE = 1 / 3
"""Time in which the last frame fades out, s."""


def with_tail(clip: Clip, seconds: float) -> Clip:
    """Return ``clip`` with ``seconds`` more, in which its last frame fades to nothing.

    The rest of an explosion must neither stand still for seconds nor vanish at once. An opaque
    scene has nothing to fade to: its last frame stays.
    """
    last, frames, flow = clip.count - 1, math.ceil(seconds * clip.fps), clip.flow
    if frames == 0:
        return clip
    fade = min(fade_frames(clip.fps), frames)

    def picture(i: int) -> Picture:
        if i <= last:
            return clip.picture(i)
        if clip.matte == "none":
            return clip.picture(last)
        faded = (i - last) / fade
        if faded >= 1:
            return np.zeros((clip.height, clip.width, 4), np.float32)
        # The fade looks even, because the eye's response is about the square root of light.
        return clip.read(last) * np.float32((1 - faded) ** 2)

    return replace(
        clip,
        count=clip.count + frames,
        picture=picture,
        tail=frames,
        flow=None if flow is None else lambda i: flow(min(i, last)),
    )


def shortened(clip: Clip, needed: int) -> Clip:
    """Return ``clip`` with ``needed`` frames of its tail, but not fewer than its fade takes."""
    if needed == 0:
        return replace(clip, count=clip.body, tail=0)
    kept = min(max(needed, fade_frames(clip.fps)), clip.tail)
    return replace(clip, count=clip.body + kept, tail=kept)


def fade_frames(fps: float) -> int:
    """Return how many frames the last frame takes to fade to nothing."""
    return math.ceil(_FADE * fps)
