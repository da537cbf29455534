"""Flakes of a fire that is lit and put out: those of its loop, born as its fuel burns."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.effect.flakes.phase import dying_flakes, lit_flakes, passing_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.timeline.phase_change import extinction, ignition
from tests.support.clips import open_clip
from tests.support.effect import run_effect

X, Y, A = (COLUMNS.index(name) for name in "xya")

COUNT = 36


@pytest.fixture(scope="module")
def loop() -> Tracks:
    keys = {"flakes": {"rate": 200, "rounds": 1}}
    return run_effect(open_clip("campfire", 160), keys).tracks


def places(tracks: Tracks, frame: int) -> dict[tuple[float, float], float]:
    """Return the opacity of the flakes of a frame by their places."""
    return {(row[X], row[Y]): row[A] for row in tracks.frames[frame].tolist()}


def alive(tracks: Tracks) -> NDArray[np.intp]:
    return np.array([np.count_nonzero(rows[:, A] > 0.02) for rows in tracks.frames])


def test_those_of_a_fire_that_is_lit_lead_into_its_loop(loop: Tracks) -> None:
    frames = ignition(len(loop.frames), COUNT)
    lit = lit_flakes(loop, frames.shown, frames.fuel)
    assert alive(lit)[:4].mean() < 0.1 * alive(loop).mean()
    shown, whole = places(lit, COUNT - 1), places(loop, len(loop.frames) - 1)
    assert shown.keys() == whole.keys()
    assert all(shown[place] > 0.9 * whole[place] - 0.005 for place in whole)


def test_more_are_born_the_more_fuel_burns(loop: Tracks) -> None:
    frames = ignition(len(loop.frames), COUNT)
    lit = lit_flakes(loop, frames.shown, frames.fuel)
    first, last = (alive(lit)[part].sum() for part in (slice(0, 12), slice(12, 24)))
    assert last > 2 * first


def test_those_that_fly_when_the_fire_is_put_out_fly_on_and_all_go_out(loop: Tracks) -> None:
    frames = extinction(len(loop.frames), COUNT)
    dying = dying_flakes(loop, frames.shown, frames.fuel)
    was = {*loop.flights[-1].tolist()} & {*loop.flights[0].tolist()}
    still = {
        (row[X], row[Y])
        for row, flight in zip(loop.frames[0].tolist(), loop.flights[0].tolist(), strict=True)
        if flight in was
    }
    assert len(still) > 10
    assert still <= places(dying, 0).keys()
    assert alive(dying)[-1] == 0
    assert alive(dying)[-8:].max() < 0.5 * alive(loop).mean()


def test_what_collapses_throws_a_puff_of_sparks(loop: Tracks) -> None:
    frames = extinction(len(loop.frames), COUNT)
    dying = dying_flakes(loop, frames.shown, frames.fuel)
    of_loop = alive(loop)[frames.shown]
    assert (alive(dying)[: COUNT // 3] - of_loop[: COUNT // 3]).max() > 0.15 * of_loop.mean()


def test_those_of_an_entry_pass_from_the_loop_into_what_is_put_out(loop: Tracks) -> None:
    count = len(loop.frames)
    frames = extinction(count, COUNT)
    dying = dying_flakes(loop, frames.shown, frames.fuel)
    shown, share = (20 + np.arange(6)) % count, np.linspace(0.05, 0.95, 6)
    passing = passing_flakes(loop, shown, frames.fuel, dying, share)
    first, last = places(passing, 0), places(passing, 5)
    assert places(dying, 5).keys() <= last.keys()
    assert all(last[place] > 0.9 * was - 0.005 for place, was in places(dying, 5).items())
    of_loop = places(loop, 20)
    assert len(first.keys() & of_loop.keys()) > 0.8 * len(of_loop)
    ids = [rows[:, 0].tolist() for rows in passing.frames]
    assert all(numbers == sorted({*numbers}) for numbers in ids)
    assert {number for numbers in ids for number in numbers} <= {*passing.spawns[:, 0].tolist()}
