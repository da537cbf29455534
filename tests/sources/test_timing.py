"""Drawings with individual delays, at a constant rate."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.timing import Timing, time_drawings
from tests.support import synthetic_fire as fire


def timed(
    delays: Sequence[int], fps: float | None = None, stated: float | None = None
) -> tuple[float, list[int]]:
    """Return the rate, and for how many ticks each of drawings with these delays, ms, is shown."""
    timing = of_milliseconds(delays, fps, stated)
    return timing.rate, [timing.shown.count(i) for i in range(len(delays))]


def of_milliseconds(
    delays: Sequence[int], fps: float | None = None, stated: float | None = None
) -> Timing:
    return time_drawings([Fraction(ms, 1000) for ms in delays], fps, Path("a.gif"), stated)


@pytest.mark.parametrize(
    ("delays", "rate", "ticks"),
    [
        ([40] * 5 + [2000], 25, [1] * 5 + [50]),
        ([83, 83, 83, 42, 42, 83], 24, [2, 2, 2, 1, 1, 2]),  # drawn on twos, and once on ones
        ([100, 100, 50, 100], 4 / 0.35, [1, 1, 1, 1]),
        ([20, 3000], 76 / 3.02, [1, 75]),
        ([700], 1 / 0.7, [1]),
    ],
)
def test_the_rate_is_the_lowest_that_loses_no_drawing(
    delays: list[int], rate: float, ticks: list[int]
) -> None:
    found, shown = timed(delays)
    assert found == pytest.approx(rate, rel=0.005)
    assert shown == ticks


def test_a_rate_that_the_file_states_is_kept_where_rounded_times_agree_with_it() -> None:
    assert timed([33, 34, 33, 33, 34], stated=30000 / 1001) == (30000 / 1001, [1] * 5)
    assert timed([33, 34, 33, 33, 400], stated=30000 / 1001)[1] == [1, 1, 1, 1, 12]


DELAYS = st.lists(st.integers(11, 3000), min_size=1, max_size=40)


@given(DELAYS, st.sampled_from([5, 10, 12.5, 24, 30, 60]))
def test_each_tick_shows_what_is_displayed_at_its_middle(delays: list[int], fps: float) -> None:
    timing, ends = of_milliseconds(delays, fps), list(accumulate(delays))
    assert timing.rate == fps
    assert len(timing.shown) == max(1, round(Fraction(sum(delays), 1000) * Fraction(fps)))
    for k, drawing in enumerate(timing.shown):
        middle = (k + Fraction(1, 2)) / Fraction(fps) * 1000
        later = [i for i, end in enumerate(ends) if end > middle]
        assert drawing == (later[0] if later else len(delays) - 1)


@given(st.lists(st.integers(20, 3000), min_size=1, max_size=60))
def test_every_drawing_is_shown_within_half_a_tick_of_its_time(delays: list[int]) -> None:
    timing, begins = of_milliseconds(delays), [0, *accumulate(delays)]
    tick = 1000 / timing.rate
    assert sorted(set(timing.shown)) == list(range(len(delays)))
    assert list(timing.shown) == sorted(timing.shown)
    for i, begin in enumerate(begins[:-1]):
        assert abs(timing.shown.index(i) * tick - begin) <= tick / 2 + 1e-6
    assert abs(len(timing.shown) * tick - begins[-1]) <= tick + 1e-6
    assert timing.rate <= 60 or set(timing.shown) == set(range(len(timing.shown)))


@given(st.integers(1, 500), st.integers(1, 60))
def test_equal_delays_show_every_frame_once(milliseconds: int, count: int) -> None:
    rate, shown = timed([milliseconds] * count)
    assert rate == pytest.approx(1000 / milliseconds)
    assert shown == [1] * count


def test_what_a_rate_cannot_show_is_noted() -> None:
    (note,) = of_milliseconds([100] * 12, fps=5).notes
    assert note == "a.gif: source.fps: 5 shows 6 of its 12 frames"
    (note,) = of_milliseconds([5, 5, 5, 2000]).notes
    assert note.startswith(
        "a.gif: 2 of 4 drawings are shorter than a frame at 60 fps, and left out"
    )
    (note,) = of_milliseconds([40] * 5 + [2000]).notes
    assert "6 drawings become 55 frames at 25 fps, of which 49 only hold a drawing" in note
    assert of_milliseconds([100, 100, 50, 100]).notes == ()


def test_more_ticks_than_an_atlas_can_hold_are_refused() -> None:
    with pytest.raises(SourceError, match=r"a\.gif: 600 s at 60 fps are 36000 frames"):
        of_milliseconds([600_000], fps=60)


@pytest.mark.slow
@settings(deadline=None, max_examples=67)
@given(st.lists(st.integers(2, 300).map(lambda n: 10 * n), min_size=2, max_size=60))
@pytest.mark.parametrize("ending", ["gif", "webp", "png"])
def test_every_delay_of_a_file_is_kept(
    ending: str, tmp_path_factory: pytest.TempPathFactory, delays: list[int]
) -> None:
    drawings = [np.full((2, 2, 4), (4 * i, 255 - i, i, 255), np.uint8) for i in range(len(delays))]
    path = tmp_path_factory.mktemp("delays") / f"a.{ending}"
    options = {"lossless": True} if ending == "webp" else {}
    fire.write_animation(path, drawings, duration=delays, **options)
    clip, timing = fire.open_clip(path, matte="none"), of_milliseconds(delays)
    assert (clip.fps, clip.count) == (timing.rate, len(timing.shown))
    for k, drawing in enumerate(timing.shown):
        expected = fire.light(drawings[drawing])[0, 0]
        np.testing.assert_allclose(clip.read(k)[0, 0], expected, atol=1e-6)


@pytest.mark.parametrize("ending", ["gif", "webp", "png"])
@pytest.mark.parametrize("milliseconds", [0, 10])
def test_a_delay_of_10_ms_or_less_is_a_tenth_of_a_second(
    ending: str, milliseconds: int, tmp_path: Path
) -> None:
    path = fire.write_animation(tmp_path / f"a.{ending}", fire.fires(3), duration=milliseconds)
    assert fire.open_clip(path, matte="none").fps == 10
