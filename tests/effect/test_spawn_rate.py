"""The automatic number of flakes: it suits the size of the fire."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.effect.flakes.tracks import visible_count
from fire_atlas.pipeline.animation.layers import draw
from fire_atlas.recipe.effect import Flakes
from tests.support.clips import campfire, clip_of, looped, open_clip, real
from tests.support.effect import EffectRun, run_effect

_LONG = 5.0
"""Seconds for which births are counted."""


def _births_a_second(effect: EffectRun) -> float:
    return len(effect.analysis.spawns.tick) / (effect.clip.count / effect.clip.fps)


def _shed(clip: Clip) -> float:
    return _births_a_second(run_effect(looped(clip, _LONG), {"timeline": {"loop": "none"}}))


@pytest.mark.parametrize(
    ("candle", "large"), [("candle", "campfire"), real("real_candle_red", "real_firewall_stock")]
)
def test_a_candle_sheds_next_to_nothing_and_a_large_fire_much(candle: str, large: str) -> None:
    few, many = _shed(open_clip(candle)), _shed(open_clip(large))
    assert 0 < few < 2
    assert many > 20


def _small(height: int) -> Clip:
    clip = campfire(height=height)
    return looped(clip, 4.0)


@pytest.mark.parametrize(("height", "most"), [(64, 30), (24, 7), (16, 5)])
def test_small_frames_get_few_flakes_and_tiny_ones_a_handful(height: int, most: int) -> None:
    alive = [len(rows) for rows in run_effect(_small(height)).tracks.frames]
    assert 0 < np.mean(alive) < most


SMALL = ["pixel_art", real("cartoon_tauran_flame_sheet")]
"""Clips of so few pixels that flakes are drawn larger than they are."""


@pytest.mark.parametrize("name", SMALL)
def test_a_sprite_of_few_pixels_is_not_covered_with_flakes(name: str) -> None:
    effect = run_effect(open_clip(name))
    some = range(0, effect.clip.count, max(1, effect.clip.count // 9))
    covered = [np.mean(effect.finished(i)[..., 3] > 0.02) for i in some]
    plain = [np.mean(effect.clip.read(i)[..., 3] > 0.02) for i in some]
    assert np.mean(covered) - np.mean(plain) < 0.15


@pytest.mark.slow
def test_the_number_does_not_depend_on_the_resolution() -> None:
    """Where flakes can be drawn as small as they are."""
    assert _shed(campfire(400)) == pytest.approx(_shed(campfire(320)), rel=0.15)


@pytest.mark.slow
def test_the_same_fire_in_a_larger_frame_sheds_fewer_as_flakes_are_larger_there() -> None:
    clip = campfire(240)

    def in_a_corner(frame: Pixels) -> Pixels:
        return np.pad(frame, ((240, 0), (0, 0), (0, 0)))

    frames = [in_a_corner(clip.read(i)) for i in range(clip.count)]
    assert _shed(clip_of(frames)) < 0.5 * _shed(clip)


def test_of_a_single_picture_all_of_the_flame_counts() -> None:
    fire = campfire(240)
    still, moving = run_effect(clip_of([fire.read(0)])), run_effect(fire)
    assert still.study.moving_area == pytest.approx(moving.study.moving_area, rel=0.5)


def test_a_number_is_taken_as_it_is() -> None:
    keys = {"flakes": {"rate": 300, "bursts": 0}, "timeline": {"loop": "none"}}
    assert _births_a_second(run_effect(looped(campfire(160), _LONG), keys)) == pytest.approx(
        300, rel=0.1
    )


@pytest.mark.slow
@pytest.mark.parametrize(  # every two of them, and those in which "auto" differs
    ("name", "rate", "bursts"),
    [
        ("campfire", 10, 0),
        ("campfire", 120, 0.8),
        ("campfire", 10, "auto"),
        ("campfire", 120, "auto"),
        ("candle", 120, 0),
        ("candle", 10, 0.8),
        ("candle", 120, "auto"),
        ("explosion", 120, 0),
        ("explosion", 120, 0.8),
        ("explosion", 10, "auto"),
    ],
)
def test_the_rate_is_what_is_born_bursts_included(name: str, rate: int, bursts: Any) -> None:
    clip = open_clip(name, 64)
    runs = [
        run_effect(clip, {"seed": seed, "flakes": {"rate": rate, "bursts": bursts}})
        for seed in range(6)
    ]
    assert np.mean([_births_a_second(run) for run in runs]) == pytest.approx(rate, rel=0.1)
    sparks = sum(run.analysis.spawns.kind.sum() for run in runs)
    # By its class, a candle throws no sparks and an explosion throws them at any rate.
    crackles = bursts == "auto" and (rate > 20 or name == "explosion") and name != "candle"
    assert (sparks > 0) == (bursts == 0.8 or crackles)


def test_the_automatic_rate_includes_bursts() -> None:
    clip, runs = looped(campfire(160), _LONG), list[EffectRun]()
    for bursts in (0, 1.5):
        keys = {"flakes": {"bursts": bursts}, "timeline": {"loop": "none"}}
        runs.append(run_effect(clip, keys))
    assert len(runs[0].births) == len(runs[1].births)
    assert runs[1].analysis.spawns.kind.any()


@pytest.mark.parametrize("fps", [24.0, 60.0])
def test_a_short_loop_is_not_crowded(fps: float) -> None:
    """Its flakes fly round and round: as many are alive as in a long one."""
    short = replace(campfire(160), fps=fps, count=6, loop=True)
    alive = np.mean([len(rows) for rows in run_effect(short).tracks.frames])
    assert alive < 100


def test_a_tail_changes_nothing_about_what_is_born() -> None:
    fire = campfire(160, count=12)
    plain, tailed = (
        run_effect(fire, {"timeline": {"loop": "none", "tail": tail}}) for tail in (False, True)
    )
    assert tailed.clip.tail > 0 and len(plain.births)
    assert np.array_equal(plain.births, tailed.births)


def test_a_single_picture_has_flakes_with_a_tail_too() -> None:
    still = clip_of([campfire(160).read(0)])
    assert len(run_effect(still, {"timeline": {"loop": "none", "tail": True}}).births)


def test_without_flakes_there_are_no_bursts() -> None:
    assert not len(run_effect(campfire(160), {"flakes": {"rate": 0}}).births)


@pytest.mark.parametrize("name", ["explosion", real("cartoon_wesnoth_fireball_impact")])
def test_flakes_of_a_fire_that_dies_out_are_cold_when_it_ends(name: str) -> None:
    effect = run_effect(open_clip(name), {"flakes": {"rate": 100}})
    lit = [visible_count(rows) for rows in effect.tracks.frames]
    assert max(lit) > 20 and lit[-1] == 0 and lit[-2] > 0


@pytest.mark.slow
def test_a_fire_burns_on_after_a_flash() -> None:
    frames = [campfire(120).read(i) for i in range(16)]
    frames[2] = np.ones_like(frames[2])
    assert not run_effect(clip_of(frames), {"timeline": {"loop": "none"}}).study.dies_out


@pytest.mark.parametrize("name", SMALL)
def test_in_a_frame_of_few_pixels_sparks_can_be_seen(name: str) -> None:
    """They are drawn wider than they are, and shine through it."""
    effect = run_effect(open_clip(name))
    assert isinstance(effect.recipe.flakes, Flakes)
    brightest = [
        draw(effect.recipe.flakes, rows, effect.clip.height, effect.clip.width).rgb().max()
        for rows in effect.tracks.frames
    ]
    assert np.median(brightest) > 0.2


def test_flakes_of_a_fire_that_burns_on_glow_to_the_end() -> None:
    effect = run_effect(
        campfire(160, count=12), {"timeline": {"loop": "none"}, "flakes": {"rate": 100}}
    )
    assert visible_count(effect.tracks.frames[-1]) > 10
