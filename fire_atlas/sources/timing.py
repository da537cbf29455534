"""At which constant rate drawings that have individual delays are shown, and which at each tick.

Pages play at one rate, so a drawing that is held is shown for several ticks. Where frames are only
packed these share one place on the page; but flakes fly on during a hold, and each of its ticks
becomes a frame of its own. So the rate is as low as it can be without losing a drawing.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, chain, islice, pairwise
from math import floor, lcm
from pathlib import Path
from statistics import mode

from fire_atlas.core.errors import SourceError
from fire_atlas.core.workload import MAX_FRAMES

_MAX_RATE = 60
"""Limit on the ticks per second by which uneven delays are honoured; a steady clip has its own
rate, which may be higher."""


_ROUNDED = Fraction(1, 2000)
"""Rates that differ by a smaller fraction are the same, of delays that were rounded to 1 ms."""

_OFF_BEAT = 0.1
"""Ticks: a drawing that begins further from every tick does not keep to the beat of the others."""

_FINEST_UNIT = 10**12
"""Units of time a second at most, by which delays are added up."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Drawings at a constant rate.

    Attributes:
        rate: Ticks per second.
        shown: For each tick, the number of the drawing that it shows.
        notes: What the rate does to the drawings, for the user.
    """

    rate: float
    shown: tuple[int, ...]
    notes: tuple[str, ...] = ()


def time_drawings(
    delays: Sequence[Fraction], fps: float | None, path: Path, file_fps: float | None = None
) -> Timing:
    """Return the rate for drawings with these delays, and which of them each tick shows.

    Each tick shows what is displayed at its middle. Unless the user states a rate, it is the first
    of the following at which each drawing gets a tick, and so begins within half a tick of its
    time: one tick for each drawing; the rate that the file states, or a multiple of that of the
    delay that most drawings have, if all keep to this beat; the lowest that has a whole number of
    ticks in all.

    Args:
        delays: Time for which each drawing is shown, s; all positive.
        fps: The rate that the user states; None to choose it.
        path: The file, for messages.
        file_fps: The rate that the file states. Where its time stamps, which are mostly rounded to
            1 ms, agree with it to half a tick in all, it is the one of one tick for each drawing.

    Raises:
        SourceError: There would be more than ``MAX_FRAMES`` ticks.
    """
    unit = _unit(delays)
    times = [0, *accumulate(round(delay * unit) for delay in delays)]
    count, total = len(delays), Fraction(times[-1], unit)
    if fps:
        rate = _fraction(fps)
    else:
        rates = _rates(times, unit, _fraction(file_fps) if file_fps else None)
        rate = next(
            (candidate for candidate in rates if _fits(times, unit, candidate)), Fraction(_MAX_RATE)
        )
    ticks = max(1, round(total * rate))
    if ticks > MAX_FRAMES:
        raise SourceError(
            f"{path}: {float(total):.0f} s at {float(rate):g} fps are {ticks} frames; "
            f"at most {MAX_FRAMES} are allowed: give a lower fps",
            key=("source", "fps"),
        )
    shown = list[int]()
    for drawing, end in enumerate(_first_ticks(times[1:], unit, rate)):
        shown += [drawing] * (min(end, ticks) - len(shown))
    shown += [count - 1] * (ticks - len(shown))
    notes = _notes(shown, count, float(rate), fps)
    return Timing(float(rate), tuple(shown), tuple(f"{path.name}: {note}" for note in notes))


def _unit(delays: Iterable[Fraction]) -> int:
    """Return how many units of time a second has, of which each delay is a whole number, or nearly:
    sums of fractions of any denominators would take for ever."""
    unit = 1
    for delay in delays:
        unit = lcm(unit, delay.denominator)
        if unit > _FINEST_UNIT:
            return _FINEST_UNIT
    return unit


def _fraction(rate: float) -> Fraction:
    return Fraction(rate).limit_denominator(1_000_000)


def _rates(times: Sequence[int], unit: int, file_rate: Fraction | None) -> Iterator[Fraction]:
    """Yield the rates to try, best first."""
    count, total = len(times) - 1, Fraction(times[-1], unit)
    mean = count / total
    if file_rate and abs(total * file_rate - count) < Fraction(1, 2):
        mean = file_rate
    elif round(mean) and abs(mean / round(mean) - 1) < _ROUNDED:
        mean = Fraction(round(mean))
    yield mean
    delays = [later - earlier for earlier, later in pairwise(times)]
    usual = mode(delays)
    beats = [file_rate] if file_rate and file_rate <= _MAX_RATE else []
    if 2 * delays.count(usual) > count:
        beats += [Fraction(k * unit, usual) for k in range(1, _MAX_RATE * usual // unit + 1)]
    for beat in beats:
        places = [float(time * beat / unit) for time in times[:-1]]
        if all(abs(place - round(place)) < _OFF_BEAT for place in places):
            yield beat
    most = min(floor(_MAX_RATE * total), MAX_FRAMES)
    yield from (ticks / total for ticks in range(count, most + 1))


def _fits(times: Sequence[int], unit: int, rate: Fraction) -> bool:
    """Return whether each drawing has a tick of its own; ``times``: when each begins, and the end,
    in units."""
    firsts = islice(_first_ticks(times, unit, rate), len(times) - 1)
    ticks = round(Fraction(times[-1], unit) * rate)
    return all(one < other for one, other in pairwise(chain(firsts, [ticks])))


def _first_ticks(times: Iterable[int], unit: int, rate: Fraction) -> Iterator[int]:
    """Yield for each time the first tick whose middle is not before it."""
    half, twice = rate.denominator * unit, 2 * rate.numerator
    return (-((half - twice * time) // (2 * half)) for time in times)


def _notes(shown: Sequence[int], count: int, rate: float, fps: float | None) -> Iterator[str]:
    """Yield what ``count`` drawings became that are ``shown`` at each tick."""
    seen = len(set(shown))
    at = f"{rate:g} fps"
    if fps and seen < count:
        yield f"source.fps: {fps:g} shows {seen} of its {count} frames"
    elif seen < count:
        yield (
            f"{count - seen} of {count} drawings are shorter than a frame at {at}, and left out; "
            f"a higher source.fps shows them"
        )
    elif 2 * seen < len(shown):
        yield (
            f"its delays are uneven: {count} drawings become {len(shown)} frames at {at}, of which "
            f"{len(shown) - count} only hold a drawing. Where nothing else is drawn these share "
            f"its place on the page; else a shorter hold in the file, or a lower source.fps, makes "
            f"fewer"
        )
