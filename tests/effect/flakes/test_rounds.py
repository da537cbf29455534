"""Flakes that repeat after several rounds of a loop."""

from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.effect.flakes.rounds import rounds_of
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.recipe.effect import Flakes
from tests.support.any_tracks import flights_of
from tests.support.clips import campfire
from tests.support.effect import VX, VY, EffectRun, X, Y, run_effect

COUNT = 8
"""Frames of the loop: a third of a second, in which no ember burns out."""


def short_loop(count: int = COUNT) -> Clip:
    return replace(campfire(96), count=count, loop=True)


def flown(rounds: int | str, **flakes: object) -> EffectRun:
    stated = {"bake": False, "rate": 150, "bursts": 1, "rounds": rounds, **flakes}
    return run_effect(short_loop(), {"flakes": stated})


@pytest.mark.parametrize(
    ("life", "fps", "frames", "rounds"),
    [(2.6, 24, 8, 8), (2.6, 24, 63, 1), (2.6, 24, 62, 2), (2.0, 24, 48, 1), (60, 24, 2, 64)],
)
def test_tracks_are_as_long_as_the_longest_life(
    life: float, fps: float, frames: int, rounds: int
) -> None:
    clip = replace(short_loop(frames), fps=fps)
    assert rounds_of(Flakes(bake=False, life=(0.1, life)), clip, in_pages=False) == rounds


def test_pages_and_clips_that_play_once_have_one_round() -> None:
    assert rounds_of(Flakes(), short_loop(), in_pages=True) == 1
    flakes, once = Flakes(bake=False, rounds=3), replace(short_loop(), loop=False)
    assert rounds_of(flakes, short_loop(), in_pages=False) == 3
    assert rounds_of(flakes, once, in_pages=False) == 1


@pytest.mark.parametrize(
    "keys", [{"flakes": {}}, {"flakes": {"bake": False}, "maps": {"flakes": True}}]
)
def test_where_pages_show_flakes_tracks_have_one_round(keys: dict[str, object]) -> None:
    assert len(run_effect(short_loop(), keys).tracks.frames) == COUNT


@pytest.mark.parametrize("rounds", [1, 2, 3, 7])
def test_tracks_cover_so_many_rounds_and_close_exactly(rounds: int) -> None:
    tracks = flown(rounds).tracks
    assert (len(tracks.frames), tracks.rounds, tracks.round_frames) == (
        rounds * COUNT, rounds, COUNT,
    )  # fmt: skip
    rows, after = np.concatenate(tracks.frames), tracks.following_rows()
    crosses = (tracks.frame_numbers == len(tracks.frames) - 1) & (after >= 0)
    assert np.count_nonzero(crosses) > 20
    here, there = rows[crosses], rows[after[crosses]]
    way = here[:, [VX, VY]] / tracks.fps
    assert np.abs(there[:, [X, Y]] - here[:, [X, Y]] - way).max() < 1e-6
    assert flights_of(tracks)  # whose frames follow one another over the end


def test_a_round_has_flakes_of_its_own_but_as_many() -> None:
    effect = flown(6, bursts=0)
    births = np.bincount(effect.analysis.spawns.tick * 24 // 60 // COUNT, minlength=6)
    assert births.sum() == pytest.approx(150 * 6 * COUNT / 24, rel=0.05)
    mean = births.mean()
    assert np.abs(births - mean).max() < 3 * np.sqrt(mean), "they are Poisson distributed"
    starts = {effect.births[i].tobytes() for i in range(len(effect.births))}
    assert len(starts) == len(effect.births), "no round repeats another"


def twice_in_sight(tracks: Tracks) -> int:
    """Return how many flakes are in sight beside their own repetition."""
    return sum(len(flights) - len(np.unique(flights)) for flights in tracks.flights)


def test_by_default_no_flake_is_in_sight_beside_its_repetition() -> None:
    assert twice_in_sight(flown(1).tracks) > 100
    assert twice_in_sight(flown("auto").tracks) == 0


def test_a_single_round_is_as_before_the_others_were_added() -> None:
    """The births of the first round are those of one round: random numbers go by the frame."""
    alone, several = flown(1, bursts=0).births, flown(3, bursts=0).births
    np.testing.assert_array_equal(alone, several[: len(alone)])


def test_the_limit_of_flakes_alive_holds_over_all_rounds() -> None:
    tracks = flown(4, max=40).tracks
    alive = [len(rows) for rows in tracks.frames]
    assert max(alive) <= 40
    assert min(alive) > 20
