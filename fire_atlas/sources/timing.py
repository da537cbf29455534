"""Frames with delays of their own, shown at a constant rate."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.listing import MAX_FRAMES


def resample(delays: Sequence[Fraction], fps: float | None, path: Path) -> tuple[float, list[int]]:
    """Return the rate, and for each output frame k the input frame shown at (k + 0.5) / rate.

    Args:
        delays: How long each input frame is shown, s; all positive.
        fps: Rate of the output; None takes frames / total duration.
        path: Named in errors.

    Raises:
        SourceError: The output would have more than ``MAX_FRAMES`` frames.
    """
    total = sum(delays, Fraction())
    rate = Fraction(fps).limit_denominator(1_000_000) if fps else len(delays) / total
    count = max(1, round(total * rate))
    if count > MAX_FRAMES:
        raise SourceError(
            f"{path}: {float(total):.0f} s at {float(rate):g} fps are {count} frames; "
            f"at most {MAX_FRAMES} are taken: give a lower fps"
        )
    shown: list[int] = []
    frame, until = 0, delays[0]
    for k in range(count):
        while (2 * k + 1) / (2 * rate) >= until and frame + 1 < len(delays):
            frame += 1
            until += delays[frame]
        shown.append(frame)
    return float(rate), shown
