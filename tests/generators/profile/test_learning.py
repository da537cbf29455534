"""What is learnt of a clip, and which clips nothing can be learnt from."""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Pixels, linear_to_srgb
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.generate.particles import (
    PeripheralCurve,
    height_after,
    rise_time,
)
from fire_atlas.generators.profile.learn.colour_table import cell_sums, colour_table
from fire_atlas.generators.profile.learn.fitness import refuse_unfit
from fire_atlas.generators.profile.learn.learn import leaning_sets
from fire_atlas.generators.profile.model import (
    LeaningSet,
    interpolated,
    node_heights,
    swinging,
)
from fire_atlas.recipe.source import FramesSource, ProfileSource
from fire_atlas.sources.frames import open_with_proxy
from fire_atlas.sources.profile import learn_from_files
from fire_atlas.sources.reader import OpeningContext
from tests.generators.profile.colour_difference import delta_e
from tests.generators.profile.flames import (
    BASE,
    FOOT,
    HEIGHT,
    WIDTH,
    cells_of,
    clip_of,
    kite,
    painted,
    swaying,
)
from tests.support.clips import RISING_SAMPLES, open_clip, proxied
from tests.support.likeness import learnt


@pytest.mark.parametrize("size", [2, 5, 8])
def test_the_colour_table_is_that_of_the_flame(size: int) -> None:
    pixels, mask, colours = cells_of(size, lambda r, c: (255 - 9 * r, 60 + 20 * c, 10 + 12 * r))
    table = colour_table(3 * cell_sums(pixels, mask, size))
    assert np.abs(table.colours.astype(int) - colours).max() <= 2
    assert table.coverage == pytest.approx(np.ones((size, size)))


def test_the_table_means_light_not_bytes() -> None:
    white, black = np.ones((HEIGHT, WIDTH), np.bool_), np.ones((HEIGHT, WIDTH), np.bool_)
    bright = cell_sums(painted(white, (255, 255, 255)), white, 2)
    dark = cell_sums(painted(black, (0, 0, 0)), black, 2)
    assert (colour_table(bright + dark).colours == 188).all()  # half the light of 255


def test_every_frame_of_a_known_clip_gives_its_points_and_its_lean() -> None:
    clip, leans = swaying()
    front = learnt(clip).front
    assert front.leans == pytest.approx(leans, abs=1.0)
    for found in front.points:
        assert found.bottom == pytest.approx((FOOT, BASE), abs=1.0)
        assert (found.left[0], found.right[0]) == pytest.approx((FOOT - 20, FOOT + 20), abs=1.0)
    assert front.statistics.width.median == pytest.approx(40, abs=1)


@pytest.mark.slow
@pytest.mark.clips
def test_a_lit_prop_is_left_out() -> None:
    front = learnt(open_clip("real_candle_red")).front
    # The wax begins at row 174, and is wider than the flame.
    assert max(points.bottom[1] for points in front.points) < 176
    assert front.statistics.width.median < 32


def test_a_threshold_that_is_given_is_kept() -> None:
    clip, _ = swaying()
    assert learnt(clip, threshold=33.0).front.threshold == 33.0


def _still() -> list[Pixels]:
    return [painted(kite(0.0)) for _ in range(12)]


def _dark() -> list[Pixels]:
    return [np.zeros((HEIGHT, WIDTH, 4), np.float32) for _ in range(12)]


def _everywhere() -> list[Pixels]:
    noise = np.random.default_rng(0)
    return [
        np.dstack([noise.uniform(0.3, 1, (60, 60, 3)), np.ones((60, 60))]).astype(np.float32)
        for _ in range(12)
    ]


def _two() -> list[Pixels]:
    frames = []
    for i in range(12):
        flame = kite(5.0 * np.sin(i))
        frames.append(painted(np.roll(flame, -45, axis=1) | np.roll(flame, 40, axis=1)))
    return frames


def _turned(quarters: int) -> list[Pixels]:
    clip, _ = swaying()
    frames = []
    for i in range(clip.count):
        flame = clip.read(i)
        flame[: 70 + (i * 7) % 40] = 0  # its tip comes and goes
        frames.append(np.ascontiguousarray(np.rot90(flame, quarters)))
    return frames


def _cut_at_the_side() -> list[Pixels]:
    clip, _ = swaying()
    return [np.ascontiguousarray(clip.read(i)[:, 82:]) for i in range(clip.count)]


def _cut_at_the_tip() -> list[Pixels]:
    clip, _ = swaying()
    return [np.ascontiguousarray(clip.read(i)[130:]) for i in range(clip.count)]


def _ring() -> list[Pixels]:
    """A ring of small gas flames, each flickering, on a burner."""
    frames = []
    for i in range(12):
        mask = np.zeros((HEIGHT, WIDTH), np.bool_)
        for k in range(12):
            height = 12 + int(4 * np.sin(i + k))
            x = 15 + 11 * k
            mask[150 - height : 150, x : x + 10] = True
        mask[146:150, 15:147] = True
        frames.append(painted(mask, (60, 110, 255)))
    return frames


def _smoke() -> list[Pixels]:
    clip, _ = swaying()
    return [
        np.asarray(clip.read(i) * (0.3, 0.3, 0.3, 1), np.float32)
        for i in range(clip.count)
        if (clip.read(i)[..., :3].max(axis=-1) > 0).any()
    ]


def _grey(frames: list[Pixels]) -> list[Pixels]:
    for frame in frames:
        frame[..., :3] = frame[..., :3].mean(axis=-1, keepdims=True)
    return frames


def _goes_out() -> list[Pixels]:
    clip, _ = swaying(24)
    frames = [clip.read(i) for i in range(24)]
    for i in range(8, 16):
        frames[i][: int(BASE) - 20] = 0
    return frames


def _scene_change() -> list[Pixels]:
    clip, _ = swaying(24, half=12.0, reach=4.0)
    return [
        frame if i < 12 else np.roll(frame, (-70, 40), axis=(0, 1))
        for i, frame in enumerate(clip.read(i) for i in range(24))
    ]


def _two_sizes() -> list[Pixels]:
    """A spark that stays, and then a flame that is never twice in one place."""
    frames = []
    for i in range(20):
        mask = np.zeros((2 * HEIGHT, 2 * WIDTH), np.bool_)
        if i < 9:
            mask[425:435, 305:311] = True
        else:
            top, left = divmod(i - 9, 3)
            mask[10 + 105 * top : 90 + 105 * top, 20 + 90 * left : 50 + 90 * left] = True
        frames.append(painted(mask))
    return frames


def _gap(frame: Pixels) -> None:
    """Cut a flame in two, a third of its height above its foot."""
    rows = np.flatnonzero((frame[..., :3].max(axis=-1) > 0.2).any(axis=1))
    height = rows[-1] - rows[0]
    frame[rows[-1] - height // 3 : rows[-1] - height // 4] = 0


def _goes_out_once(frame: Pixels) -> None:
    frame[:] = 0


def _stands_aside(frame: Pixels) -> None:
    frame[:] = np.roll(frame, frame.shape[1] // 4, axis=1)


def _aside_in_a_sample() -> list[Pixels]:
    """One of the dozen frames that are looked at first does not make a fire burn sideways."""
    clip, _ = swaying()
    frames = [clip.read(i) for i in range(clip.count)]
    _stands_aside(frames[3])
    return frames


@pytest.mark.parametrize(
    ("breaks", "told"),
    [
        (_gap, "breaks up"),
        (_goes_out_once, "goes out"),
        (_stands_aside, "jumps elsewhere"),
    ],
)
@pytest.mark.parametrize(("name", "numbers"), [("candle", [27]), ("campfire", [14, 21])])
def test_a_clip_that_breaks_up_in_a_frame_or_two_is_refused_naming_them(
    name: str, numbers: list[int], breaks: Callable[[Pixels], None], told: str
) -> None:
    """Fire that is generated from it would break up now and then."""
    clip = open_clip(name)
    frames = [clip.read(i) for i in range(clip.count)]
    for number in numbers:
        breaks(frames[number])
    with pytest.raises(SourceError, match=rf"the flame {told} in.*source\.count to") as caught:
        learnt(clip_of(frames, clip.fps, clip.matte))
    assert any(f"{number}" in str(caught.value).split(";")[0] for number in numbers)


def _loses_its_tip(frame: Pixels) -> None:
    rows = np.flatnonzero((frame[..., :3].max(axis=-1) > 0.05).any(axis=1))
    frame[: rows[0] + (rows[-1] - rows[0]) // 4] = 0


def _over_black(frame: Pixels) -> NDArray[np.uint8]:
    return np.rint(255 * linear_to_srgb(frame[..., :3])).astype(np.uint8)


@pytest.mark.parametrize("scale", [1, 5])
@pytest.mark.parametrize(
    ("breaks", "told"),
    [
        (_gap, "breaks up"),
        (_loses_its_tip, "loses a part of itself"),
        (_goes_out_once, "goes out"),
    ],
)
def test_a_clip_on_black_that_breaks_up_in_a_frame_is_refused_at_any_size(
    tmp_path: Path, breaks: Callable[[Pixels], None], told: str, scale: int
) -> None:
    """The base of a candle is dim: what is missing of it is little, and gone for one frame."""
    clip = open_clip("candle")
    for i in range(clip.count):
        frame = clip.read(i)
        if i == 27:
            breaks(frame)
        shown = cv2.resize(_over_black(frame), None, fx=scale, fy=scale)
        cv2.imwrite(str(tmp_path / f"{i:04}.png"), shown[..., ::-1])
    source = ProfileSource(kind="profile", path=str(tmp_path))
    with Workers(2) as workers, pytest.raises(SourceError, match=f"{told} in frame 27;"):
        learn_from_files(source, [tmp_path], OpeningContext("srgb", workers))


def test_large_files_are_judged_by_frames_reduced_before_their_matte(tmp_path: Path) -> None:
    clip, _ = swaying(12)
    for i in range(12):
        shown = np.kron(_over_black(clip.read(i)), np.ones((4, 4, 1), np.uint8))
        cv2.imwrite(str(tmp_path / f"{i:04}.png"), shown[..., ::-1])
    with Workers(1) as workers:
        settings = FramesSource(path=str(tmp_path))
        opened = open_with_proxy(settings, tmp_path, OpeningContext("srgb", workers), 220)
    assert (opened.clip.width, opened.clip.height) == (4 * WIDTH, 4 * HEIGHT)
    assert (opened.proxy.width, opened.proxy.height) == (WIDTH, HEIGHT)
    for i in range(12):
        assert np.abs(opened.proxy.read(i) - clip.read(i)).max() < 1e-3


@pytest.mark.parametrize("name", RISING_SAMPLES)
def test_a_flame_that_only_flickers_is_not_refused(name: str) -> None:
    with Workers(2) as workers:
        threshold, cut_share = refuse_unfit(proxied(open_clip(name)).proxy, name, None, workers)
    assert threshold > 0 and cut_share == 0


def _on_twos(count: int) -> list[int]:
    return [i // 2 for i in range(2 * count)]


def _there_and_back(count: int) -> list[int]:
    return [*range(count), *range(count - 2, 0, -1)]


def _every_third(count: int) -> list[int]:
    return list(range(0, count, 3))


@pytest.mark.parametrize("order", [_on_twos, _there_and_back, _every_third])
@pytest.mark.parametrize("name", ["candle", "torch", "cartoon"])
def test_however_its_frames_follow_a_whole_flame_is_not_refused(
    name: str, order: Callable[[int], list[int]]
) -> None:
    clip = open_clip(name)
    played = clip_of([clip.read(i) for i in order(clip.count)], clip.fps, clip.matte)
    with Workers(2) as workers:
        refuse_unfit(proxied(played).proxy, name, None, workers)


def test_a_large_clip_is_judged_by_small_copies_and_learnt_at_its_size() -> None:
    """Fewer pixels are read for a refusal; the points of what is learnt are those of the clip."""
    clip, leans = swaying(16)
    frames = [np.kron(clip.read(i), np.ones((4, 4, 1), np.float32)) for i in range(16)]
    front = learnt(clip_of(frames)).front
    assert front.statistics.width.median == pytest.approx(160, abs=4)
    assert front.leans == pytest.approx(leans, abs=1.0)
    frames[11][:] = 0
    with pytest.raises(SourceError, match=r"goes out in frame 11;"):
        learnt(clip_of(frames))


@pytest.mark.parametrize(
    ("frames", "fault", "advice"),
    [
        (_still()[:1], "has 1 frame;", "best from 8 to 60"),
        (_still(), "no fire found", "flickers"),
        (_dark(), "no fire found", "moves"),
        (_everywhere(), "touches every edge", "room on all sides"),
        (_two(), "several flames", "crop"),
        (_ring(), "times as wide as it is high", "crop"),
        (_grey(_smoke()), "smoke or steam", "source.kind: frames"),
        (
            _goes_out(),
            "the flame goes out in 8 of 24 frames",
            "source.count to 8 for frames 0 to 7",
        ),
        (_scene_change(), "jumps elsewhere", "source.count to 12"),
        (_aside_in_a_sample(), "jumps elsewhere in frame 3;", "source.start 4 higher"),
        (_two_sizes(), "jumps elsewhere", "source.kind: frames"),
        (_turned(2), "burns downwards", "turn the clip"),
        (_turned(3), "burns to the right", "turn the clip"),
        (_turned(1), "burns to the left", "turn the clip"),
        (_cut_at_the_side(), "cut off at the left edge", "room on all sides"),
        (_cut_at_the_tip(), "tip of the flame is cut off", "room on all sides"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused_with_advice(
    frames: list[Pixels], fault: str, advice: str
) -> None:
    with pytest.raises(SourceError) as caught:
        learnt(clip_of(frames))
    assert fault in str(caught.value) and advice in str(caught.value), caught.value
    assert str(caught.value).startswith("clip 0: ")


def test_too_many_frames_are_refused_with_advice() -> None:
    frame = painted(kite(0.0))
    with pytest.raises(SourceError, match=r"at most 160.*source.count"):
        learnt(clip_of([frame] * 161))


def test_a_threshold_above_all_light_finds_no_fire() -> None:
    clip, _ = swaying()
    with pytest.raises(SourceError, match=r"brighter than 254 of 255: leave source.threshold out"):
        learnt(clip, threshold=254.0)


def _leaning(leans: Sequence[float]) -> dict[tuple[float, str], LeaningSet]:
    sets = leaning_sets(np.array(leans, np.float64))
    return {(each.low, each.period): each for each in sets}


def test_a_state_that_the_clip_shows_in_one_period_gives_its_frames_to_the_other() -> None:
    """It rests upright, then swings over to 15 degrees and back, again and again."""
    swing = [7.0, 12.0, 15.0, 17.0, 15.0, 18.0, 14.0, 12.0, 7.0]
    leans = ([5.0] * 10 + swing) * 3
    sets = _leaning(leans)
    aslant = tuple(i for i, lean in enumerate(leans) if lean >= 10)
    for period in ("swing", "rest"):
        assert sets[10.0, period].origin == "own"
        assert set(sets[10.0, period].frames) <= set(aslant)
        # The opposite state, which is never shown, has them mirrored.
        assert sets[-20.0, period].origin == "mirrored"
        assert set(sets[-20.0, period].frames) <= set(aslant)


def test_a_state_with_few_frames_in_each_period_has_those_of_both_in_both() -> None:
    slow, fast = np.linspace(-4, -3.8, 8), np.linspace(-3.8, -9.8, 8)
    leans = [*slow, *fast, *np.linspace(0, 9.5, 10), *np.linspace(9.5, 9.9, 10)]
    shown = np.array(leans) < 0
    assert np.count_nonzero(shown & swinging(np.array(leans))) == 8
    sets = _leaning(leans)
    for period in ("swing", "rest"):
        assert sets[-10.0, period].origin == "own"
        assert sets[-10.0, period].frames == tuple(range(16))


def test_a_state_with_few_frames_in_all_still_borrows() -> None:
    sets = _leaning([12.0] * 5 + [5.0] * 20)
    assert sets[10.0, "swing"].origin == "sheared"


def test_particles_rise_through_three_regimes() -> None:
    t = np.linspace(0, 3, 3001)
    height = height_after(t, rise_speed=1.5)
    speed = np.gradient(height, t)
    flame, zone, plume = height < 0.19, (height > 0.21) & (height < 0.99), height > 1.02
    assert (np.diff(speed[flame]) > 0).all()
    assert speed[zone] == pytest.approx(np.full(zone.sum(), 1.5), rel=1e-6)
    assert (np.diff(speed[plume]) < 1e-6).all() and speed[-1] < 1.3
    # As McCaffrey: by the root of height below, by its -1/3 power above.
    assert speed[flame][50:] == pytest.approx(1.5 * np.sqrt(height[flame][50:] / 0.2), rel=0.02)
    assert speed[plume][1:-1] == pytest.approx(1.5 * height[plume][1:-1] ** (-1 / 3), rel=0.01)
    for wanted in (0.5, 1.0, 1.7):
        reached = height_after(np.array([rise_time(wanted, 1.5)]), 1.5)[0]
        assert reached == pytest.approx(wanted, rel=0.35 if wanted < 1 else 1e-6)


def test_the_peripheral_curve_is_a_spline_through_the_extreme_points_of_both_views() -> None:
    curve, quarter = PeripheralCurve(3.0, 2.0), np.pi / 2
    points = [(3, 0), (0, 2), (-3, 0), (0, -2), (3, 0)]
    spline = CubicSpline(np.arange(5) * quarter, points, bc_type="periodic")
    azimuths = np.linspace(0, 2 * np.pi, 50)
    assert np.allclose(np.stack(curve.at(azimuths), axis=1), spline(azimuths))
    assert curve.half_width(0.0) == pytest.approx(3.0, rel=0.02)
    assert curve.half_width(quarter) == pytest.approx(2.0, rel=0.02)
    assert 2.0 < curve.half_width(quarter / 2) < 3.0


def test_a_pose_curve_is_a_spline_that_is_level_at_its_ends() -> None:
    curve = np.random.default_rng(0).normal(size=len(node_heights()))
    spline = CubicSpline(node_heights(), curve, bc_type="clamped")
    heights = np.linspace(-0.2, 1.8, 50)
    within = np.clip(heights, 0, node_heights()[-1])
    assert np.allclose(interpolated(curve, heights), spline(within))


def test_the_colour_difference_is_that_of_the_standard() -> None:
    # Pairs 1, 7, 17, 25 of the test data of Sharma, Wu and Dalal.
    one = np.array([[50, 2.6772, -79.7751], [50, 0, 0], [50, 2.5, 0], [60.2574, -34.0099, 36.2677]])
    two = np.array([[50, 0, -82.7485], [50, -1, 2], [73, 25, -18], [60.4626, -34.1751, 39.4387]])
    assert delta_e(one, two) == pytest.approx([2.0425, 2.3669, 27.1492, 1.2644], abs=1e-4)
