"""Write ``name.flakes.bytes``: flake tracks in the binary format of the player in Unity.

Little-endian; int32 unless float32 is stated:

====================  =====================================================================
``FAFL``, 2           magic bytes, version
animations            their number; then for each
· bytes, UTF-8        number, then the name of its state in the Animator
· fps (float32)       frames per second
· loop                1 if frame 0 follows the last frame
· hard                1 if its flakes are squares of uniform brightness
· rounds              number of rounds of the animation that the frames cover
· x, y (float32)      pivot, px
· frames              their number; then the number of flakes in each
rows                  26 bytes for each flake in each frame, of all animations in turn
====================  =====================================================================

Sets of flakes over one animation (``flakes.variants``) follow one another, with its name each.

A row is x, y (float32) and dx, dy, size, stretch, rotation, r, g, b, tail (float16): px, y down, as
in ``effect.flakes.tracks``; dx, dy the displacement to the next frame; r g b the linear light at
the head.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import Tracks, as_drawn, by_column
from fire_atlas.formats.tracks.columns import assert_finite

_VERSION = 2

ROW = np.dtype(
    [("x", "<f4"), ("y", "<f4")]
    + [(name, "<f2") for name in ("dx", "dy", "size", "stretch", "rotation", "r", "g", "b", "tail")]
)
"""Type of a row, which is one flake in one frame."""

_MAX_HALF = float(np.finfo(np.float16).max)


@dataclass(frozen=True, slots=True)
class AnimationFlakes:
    """The flakes of one animation.

    Attributes:
        state: Name of its state in the Animator.
        pivot: (x, y) in the frame, px, y down.
        tracks: The flakes.
    """

    state: str
    pivot: tuple[float, float]
    tracks: Tracks


def flake_bytes(animations: Iterable[AnimationFlakes]) -> bytes:
    """Return the content of the file."""
    animations = list(animations)
    heads = [b"FAFL", _ints(_VERSION, len(animations)), *map(_head, animations)]
    rows = [_rows(animation.tracks).tobytes() for animation in animations]
    return b"".join(heads + rows)


def _head(animation: AnimationFlakes) -> bytes:
    tracks, state = animation.tracks, animation.state.encode()
    return b"".join([
        _ints(len(state)), state,
        _floats(tracks.fps),
        _ints(tracks.loop, tracks.hard, tracks.rounds),
        _floats(*animation.pivot),
        _ints(len(tracks.frames), *map(len, tracks.frames)),
    ])  # fmt: skip


def _rows(tracks: Tracks) -> NDArray[np.void]:
    assert_finite(tracks)
    table = np.concatenate(as_drawn(tracks).frames)
    column = by_column(table)
    values = {**column, "dx": column["vx"] / tracks.fps, "dy": column["vy"] / tracks.fps}
    values |= {name: column[name] * column["a"] for name in "rgb"}
    rows = np.empty(len(table), ROW)
    for name in ROW.names or ():
        rows[name] = values[name] if name in "xy" else np.clip(values[name], -_MAX_HALF, _MAX_HALF)
    return rows


def _ints(*values: int) -> bytes:
    return np.array(values, "<i4").tobytes()


def _floats(*values: float) -> bytes:
    return np.array(values, "<f4").tobytes()
