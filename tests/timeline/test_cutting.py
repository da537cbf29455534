"""Where clips are cut, and which are not."""

import cv2
import numpy as np
import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import Pixels
from fire_atlas.vision.flat_art import is_flat_art
from tests.support.clips import SAMPLES, campfire, clip_of, open_clip, piece, real
from tests.timeline.moving import (
    Notes,
    arranged,
    blob,
    circling,
    moving,
    ramp_fire,
    steps,
    turbulent,
)

ONE_SHOTS = ["explosion", *map(real, ("cartoon_freedoom_fire", "cartoon_wesnoth_fireball_impact"))]
REAL_CLOSED = (
    "sim_unity_flame02", "sim_unity_flame03", "cartoon_fluent_fire", "cartoon_tauran_flame_sheet",
    "cartoon_wesnoth_campfire", "real_fireplace_gif",
)  # fmt: skip
CLOSED = [*(name for name in SAMPLES if name != "explosion"), *map(real, REAL_CLOSED)]


@pytest.mark.parametrize("period", [17, 24])
def test_a_periodic_clip_is_cut_at_its_period_or_twice_that(period: int) -> None:
    clip = circling(period, 2 * period + 11)
    loop = arranged(clip)
    assert loop.loop and loop.count % period == 0
    assert steps(loop).max() < 1.05 * np.median(steps(loop))


@pytest.mark.parametrize("count", [8, 11, 12, 15, 23])
def test_a_short_clip_keeps_at_least_half_of_its_frames(count: int) -> None:
    """Though its best seam would keep fewer."""
    for seed in range(3):
        loop = arranged(turbulent(count, seed=seed))
        assert loop.loop and loop.count >= count / 2
    assert arranged(turbulent(count), frames=4).count == 4, "unless fewer are asked for"


@pytest.mark.parametrize(
    "name",
    [
        "campfire", "candle", "torch",
        *map(real, ("real_candle_red", "real_firewall_stock", "sim_unity_flame02")),
    ],
)  # fmt: skip
def test_short_pieces_of_clips_keep_at_least_half_of_their_frames(name: str) -> None:
    for start in (0, 9, 18):
        assert arranged(piece(open_clip(name), start, 11)).count >= 6


def test_a_length_near_the_period_is_exactly_as_long_as_the_recipe_says() -> None:
    for frames in (20, 24, 30):
        assert arranged(circling(24, 60), frames=frames).count == frames


@pytest.mark.slow
def test_a_clip_that_closes_can_be_cut_to_any_length() -> None:
    """Where the best piece of it begins near its end as well."""
    clip = circling(24, 24)
    # Every length up to that of the clip; beyond it, where it is played on, every third.
    for frames in (*range(4, 25), *range(27, 49, 3)):
        loop = arranged(clip, frames=frames)
        assert loop.loop and loop.count == frames


@pytest.mark.parametrize("frames", [5, 20, 31, 47])
def test_the_sample_is_cut_to_the_length_asked_for(frames: int) -> None:
    assert arranged(campfire(96), frames=frames).count == frames


def test_a_clip_that_closes_is_left_as_it_is() -> None:
    clip, progress = circling(24, 24), Notes()
    loop = arranged(clip, progress)
    assert loop.loop and loop.count == 24 and loop.picture is clip.picture
    (note,) = progress.notes
    assert note.startswith("the clip loops as it is: ") and "is 1.00 times the median step" in note


@pytest.mark.parametrize("name", CLOSED)
def test_clips_that_close_come_through_untouched(name: str) -> None:
    clip = open_clip(name)
    loop = arranged(clip)
    assert loop.loop and loop.count == clip.count
    assert all(np.array_equal(loop.read(i), clip.read(i)) for i in range(clip.count))


def test_a_flash_plays_once_and_the_build_says_why() -> None:
    light = [0.05, 0.6, 1.0, 0.8, 0.5, 0.3, 0.15, 0.08, 0.03, 0.0]
    progress = Notes()
    clip = arranged(clip_of([blob(48, 48, light=v) for v in light]), progress)
    assert not clip.loop and clip.count == 10
    (note,) = progress.notes
    assert "flares up from nothing and fades to nothing" in note and "plays once" in note


def test_a_fire_that_flickers_to_darkness_and_back_is_no_one_shot() -> None:
    light = [1.0 - 0.95 * (i % 8 == 7) for i in range(40)]
    assert arranged(clip_of([blob(48, 48, light=v) for v in light])).loop


def test_a_lit_room_whose_light_drifts_is_no_one_shot() -> None:
    chance = np.random.default_rng(3)
    room = chance.uniform(0.1, 0.3, (64, 64, 3))
    frames: list[Pixels] = []
    for i in range(30):
        light = room * (1 - 0.006 * i)
        light[20:40, 20:40] += 0.3 + 0.1 * np.sin(i * 1.7)
        frames.append(np.dstack([light, np.ones((64, 64))]).astype(np.float32))
    assert arranged(clip_of(frames, matte="none")).loop


@pytest.mark.parametrize("name", ONE_SHOTS)
def test_one_shots_play_once(name: str) -> None:
    assert not arranged(open_clip(name)).loop


@pytest.mark.parametrize(
    ("name", "count"), [("explosion", 32), real("cartoon_wesnoth_fireball_impact", 16)]
)
def test_a_one_shot_cannot_go_on(name: str, count: int) -> None:
    reason = f"{count} frames of this clip, but the fire fades to nothing"
    with pytest.raises(RecipeError, match=reason):
        arranged(open_clip(name), frames=40)


def test_pixel_art_gets_no_new_colours() -> None:
    frames = []
    for i in range(24):
        frame = np.zeros((32, 32, 4), np.float32)
        frame[8 + i % 9 : 28, 10 : 20 + i % 5] = [1.0, 0.2, 0.0, 1.0]
        frame[12 + i % 9 : 28, 12 : 18 + i % 5] = [1.0, 0.7, 0.1, 1.0]
        frames.append(frame)
    clip = clip_of(frames)
    own = {tuple(c) for f in frames for c in f.reshape(-1, 4).tolist()}
    for keys in ({}, {"frames": 40}, {"fps": 60.0}, {"fps": 10.0}):
        made = arranged(clip, **keys)
        shown = {tuple(c) for i in range(made.count) for c in made.read(i).reshape(-1, 4).tolist()}
        assert shown <= own


@pytest.mark.parametrize("smooth_edges", [False, True])
def test_flat_art_that_closes_nowhere_is_played_there_and_back(smooth_edges: bool) -> None:
    art = ramp_fire([(0.3, 0, 0), (1, 0.2, 0), (1, 0.8, 0.1)], 24, size=256, steps=3)
    frames = [art.read(i) for i in range(24)]
    if smooth_edges:
        frames = [np.asarray(cv2.GaussianBlur(frame, (3, 3), 0.5)) for frame in frames]
    progress = Notes()
    loop = arranged(clip_of(frames), progress)
    assert loop.loop and loop.count == 46
    shown = [loop.read(i) for i in range(46)]
    assert all(any(np.array_equal(each, frame) for frame in frames) for each in shown)
    assert "forwards and backwards" in progress.notes[0] and "too few colours" in progress.notes[0]


def test_a_smooth_flame_is_no_flat_art() -> None:
    for name in ("campfire", "candle", "torch", "fireball"):
        assert not is_flat_art(open_clip(name))
    for name in ("cartoon", "pixel_art"):
        assert is_flat_art(open_clip(name))


@pytest.mark.parametrize("name", [
    real("real_candle_red"), real("real_firewall_stock"), real("real_fireplace_gif"),
    real("sim_unity_flame02"), real("sim_unity_flame03"), real("cartoon_fluent_fire"),
    real("cartoon_tauran_flame_sheet"), real("cartoon_wesnoth_campfire"),
])  # fmt: skip
def test_filmed_and_painted_fire_is_no_flat_art(name: str) -> None:
    assert not is_flat_art(open_clip(name))


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize("loop", ["auto", "none", "crossfade", "pingpong"])
def test_clips_of_a_few_frames_are_played_or_refused_with_advice(count: int, loop: str) -> None:
    clip = moving(lambda i: (30 + 6.0 * i, 48), count)
    if (count, loop) in {(1, "crossfade"), (2, "crossfade"), (1, "pingpong")}:
        with pytest.raises(RecipeError, match=r"timeline\."):
            arranged(clip, loop=loop)
    else:
        assert 1 <= arranged(clip, loop=loop).count <= max(count, 2 * count - 2)


def test_the_worker_count_changes_nothing() -> None:
    clip = turbulent(40)
    for keys in ({}, {"frames": 90}, {"fps": 60.0}):
        one, two = (arranged(clip, jobs=jobs, **keys) for jobs in (1, 2))
        assert one.count == two.count
        assert all(np.array_equal(one.read(i), two.read(i)) for i in range(one.count))


def test_an_overlap_longer_than_half_the_clip_is_refused_with_the_most_there_can_be() -> None:
    with pytest.raises(RecipeError, match="at most 20 can overlap"):
        arranged(turbulent(40), overlap=30)


def test_a_crossfade_of_more_frames_than_there_are_is_refused_with_advice() -> None:
    with pytest.raises(RecipeError, match="loop: auto for a longer loop"):
        arranged(turbulent(40), loop="crossfade", frames=40)


def test_campfire_still_closes() -> None:
    assert arranged(campfire(120)).count == 48
