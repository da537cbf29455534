"""Bursts, seen in the tracks: sparks are born together and fly apart, whatever the gas does."""

import numpy as np
import pytest

from fire_atlas.effect.flakes.emission import SPARK, TICK
from tests.support.clips import looped, open_clip, real
from tests.support.effect import AGE, ID, KIND, VX, VY, Array, EffectRun, X, Y, run_effect

CLIPS = ["campfire", "explosion", real("real_fireplace_gif"), real("sim_unity_flame02")]
YOUNG = 0.12
"""Age, s, at which sparks are looked at: all have been seen, and hardly one has left the frame."""


def _run(name: str, **flakes: float) -> EffectRun:
    return run_effect(
        looped(open_clip(name), 6.0),
        {"flakes": {"rate": 60, **flakes}, "timeline": {"loop": "none"}},
    )


@pytest.fixture(scope="module", params=CLIPS)
def bursting(request: pytest.FixtureRequest) -> tuple[str, EffectRun]:
    """Name of a clip, and embers over it that come in two bursts a second."""
    return request.param, _run(request.param, bursts=2)


def _bursts(effect: EffectRun) -> list[Array]:
    """Return the rows of each burst in the last frame in which its sparks are young."""
    found = list[Array]()
    spawns = effect.analysis.spawns
    for rows in effect.tracks.frames:
        last = (rows[:, AGE] < YOUNG) & (rows[:, AGE] >= YOUNG - 1 / effect.clip.fps)
        sparks = rows[(rows[:, KIND] == SPARK) & last]
        tick, place = (column[sparks[:, ID].astype(np.intp)] for column in (spawns.tick, spawns.x))
        for burst in np.unique(np.stack([tick, place]), axis=1).T:
            members = sparks[(tick == burst[0]) & (place == burst[1])]
            if len(members) >= 4:
                found.append(members)
    return found


def test_sparks_of_a_burst_fly_apart(bursting: tuple[str, EffectRun]) -> None:
    bursts = _bursts(bursting[1])
    assert len(bursts) >= 4
    coherence, spread = list[float](), list[float]()
    for rows in bursts:
        place, velocity = rows[:, [X, Y]], rows[:, [VX, VY]]
        out, own = place - place.mean(axis=0), velocity - velocity.mean(axis=0)
        cosines = (out * own).sum(axis=1) / np.hypot(*out.T) / np.hypot(*own.T)
        coherence.append(float(cosines.mean()))
        spread.append(float(np.hypot(*own.T).std() / np.hypot(*velocity.mean(axis=0))))
    assert np.median(coherence) > 0.9
    assert np.median(spread) > 0.5


def test_births_come_in_clusters(bursting: tuple[str, EffectRun]) -> None:
    """Variance of the births in a quarter of a second over their mean: 1 if they were single."""
    name, twice_a_second = bursting
    for effect in (_run(name), twice_a_second):
        end = effect.clip.count / effect.clip.fps
        counts, _ = np.histogram(effect.analysis.spawns.tick * TICK, np.arange(0, end, 0.25))
        assert counts.var() / counts.mean() > 3


def test_without_bursts_births_come_evenly() -> None:
    """As the flame swells and shrinks, and no more."""
    effect = _run("campfire", bursts=0)
    counts, _ = np.histogram(effect.analysis.spawns.tick * TICK, np.arange(0, 6, 0.25))
    assert counts.var() / counts.mean() < 2


def test_sparks_of_an_explosion_travel_far() -> None:
    effect = _run("explosion", bursts=2)
    flights = [f for f in effect.flights(4) if f[0, KIND] == SPARK]
    way = [np.hypot(*(f[-1, [X, Y]] - f[0, [X, Y]])) / effect.clip.height for f in flights]
    assert np.median(way) > 0.2 and np.quantile(way, 0.8) > 1 / 3


@pytest.mark.parametrize("share", [0.0, 0.2, 0.6])
def test_as_many_flakes_are_sparks_as_the_recipe_says(share: float) -> None:
    runs = [
        run_effect(
            looped(open_clip("campfire", 120), 6.0),
            {"seed": seed, "flakes": {"rate": 800, "sparks": share}, "timeline": {"loop": "none"}},
        )
        for seed in range(2)
    ]
    kinds = np.concatenate([run.analysis.spawns.kind for run in runs])
    assert np.mean(kinds == SPARK) == pytest.approx(share, abs=0.1)
