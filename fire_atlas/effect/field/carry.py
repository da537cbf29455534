"""The air of a whole clip: carried from frame to frame, and recorded."""

from collections.abc import Iterator
from itertools import islice

from fire_atlas.core.clip import Clip
from fire_atlas.effect.field.air import grid_shape
from fire_atlas.effect.field.ambient import Ambient
from fire_atlas.effect.field.buoyancy import Drive, Physics, advance, settle
from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.record import FieldRecord, overlap_frames
from fire_atlas.recipe.effect import Buoyancy
from fire_atlas.recipe.wind import Wind

_LEAD = 0.5
"""Last seconds of a loop that act on the air before its first frame, so that the air begins as it
ends."""


def driving_order(clip: Clip) -> list[int]:
    """Return the frames of a clip in the order in which ``record_field`` takes their drives.

    A loop begins with its last frames, whose air its first frame meets.
    """
    lead = _lead_frames(clip)
    return [*range(clip.count - lead, clip.count), *range(clip.count - lead)]


def record_field(
    drives: Iterator[Drive], clip: Clip, buoyancy: Buoyancy, wind: Wind, seed: int
) -> FieldRecord:
    """Carry the air through all frames of a clip and record its field (eq. 12) in each.

    Args:
        drives: What each frame does to the air, in the order of ``driving_order(clip)``.
        clip: Its length, rate and size.
        buoyancy: The forces, as the recipe states them.
        wind: What blows from outside.
        seed: Of the eddies.
    """
    physics = Physics.of(buoyancy, clip.height)
    shape = grid_shape(clip.width, clip.height, physics.cell)
    field = FieldRecord.blank(clip.count, shape, physics.cell, clip.fps, clip.loop)
    period = clip.count / clip.fps if clip.loop else None
    eddies = Eddies.random(seed, shape[0], buoyancy.turbulence * clip.height, period)
    ambient = Ambient(eddies, wind, clip.height)
    air = None
    for n, drive in _steps(drives, clip):
        air = air or settle(drive, ambient, physics, shape)
        air = advance(air, drive, ambient, physics, n / clip.fps, 1 / clip.fps)
        if n >= 0:
            field.write(n, air, drive.lit)
    return field


def _steps(drives: Iterator[Drive], clip: Clip) -> Iterator[tuple[int, Drive]]:
    """Yield the number of each step of the air, and the drive that acts in it.

    A loop's last frames come before its first one, again at its end, and are followed by its first
    frames once more, for the end to pass into the beginning. Steps before frame 0 have negative
    numbers.
    """
    count, lead = clip.count, _lead_frames(clip)
    overlap = overlap_frames(clip.fps) if lead else 0
    last = list(islice(drives, lead))
    yield from zip(range(-lead, 0), last, strict=True)
    first = []
    for n, drive in enumerate(drives):
        if n < overlap:
            first.append(drive)
        yield n, drive
    yield from zip(range(count - lead, count), last, strict=True)
    if lead:
        # Where the loop is so short that its first frames are among its last, these follow.
        again = first + last
        yield from ((count + n, again[n % count]) for n in range(overlap))


def _lead_frames(clip: Clip) -> int:
    """Return how many of a loop's last frames act before its first; none in a clip played once."""
    return min(max(1, round(_LEAD * clip.fps)), clip.count) if clip.loop else 0
