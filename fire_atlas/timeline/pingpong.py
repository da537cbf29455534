"""Clips that play forwards, then backwards."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError


def pingpong(clip: Clip, frames: int | None) -> Clip:
    """Return ``clip`` forwards and backwards; neither of its ends is shown twice.

    Args:
        clip: At least 2 frames.
        frames: Length of the result, even. None: all of the clip.

    Raises:
        RecipeError: The clip has too few frames.
    """
    longest = 2 * clip.count - 2
    count = frames or longest
    if not 2 <= count <= longest:
        raise RecipeError(
            f"timeline.frames asks for {count} frames, but {clip.count} frames played forwards and "
            f"backwards give at most {longest}; leave timeline.frames out, or use loop: auto"
        )
    turn, flow = count // 2, clip.flow

    def shown(i: int) -> int:
        return i if i <= turn else count - i

    return replace(
        clip,
        count=count,
        picture=lambda i: clip.picture(shown(i)),
        loop=True,
        flow=None if flow is None else lambda i: flow(shown(i)),
        backwards=frozenset(range(turn, count)),
    )
