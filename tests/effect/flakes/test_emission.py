"""Births: how many, where, and what depends on what."""

from dataclasses import fields, replace

import numpy as np
import pytest

from fire_atlas.core.pixels import Plane
from fire_atlas.effect.flakes import emission
from fire_atlas.effect.flakes.emission import (
    EMBER,
    SPARK,
    TICK,
    EmitterSettings,
    Spawns,
    apart,
    automatic_burst_rate,
    automatic_rate,
    with_bursts_in_rate,
)
from fire_atlas.effect.flame.fires import Fire
from fire_atlas.recipe.effect import Flakes
from fire_atlas.vision.pixel_grid import NOT_ENLARGED
from tests.support.clips import clip_of

FIRE = Fire(share=1.0, epsilon=0.0, alpha=1.0, candidate_count=100.0)
ONE_FIRE = np.zeros((50, 60), np.uint8)
EMITTER = EmitterSettings(
    seed=5, rate=120.0, burst_rate=0.0, burst_sparks=16.0, fires=(FIRE,),
    life=(0.5, 1.5), size=(2.0, 8.0), height=200, fps=24.0, launch_speed=180.0,
)  # fmt: skip


def _strength(candidates: int = 100) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    plane = np.zeros((50, 60), np.float32)
    plane.ravel()[:candidates] = 2.0
    return plane


def _with(**values: float) -> EmitterSettings:
    """Return the emitter, its fire changed."""
    return replace(EMITTER, fires=(replace(FIRE, **values),))


def emit(frame: int, strength: Plane, emitter: EmitterSettings) -> Spawns:
    """Return the flakes of one frame of a single fire."""
    return emission.emit(frame, strength, np.zeros(strength.shape, np.uint8), emitter)


def _all(frames: int, emitter: EmitterSettings, candidates: int = 100) -> Spawns:
    return Spawns.concatenate([emit(i, _strength(candidates), emitter) for i in range(frames)])


def test_as_many_are_born_as_the_rate_says() -> None:
    assert len(_all(600, EMITTER).x) == pytest.approx(600 / 24 * 120, rel=0.05)


def test_births_grow_with_the_number_of_candidates() -> None:
    few, many = _all(300, EMITTER, candidates=50), _all(300, EMITTER, candidates=200)
    assert len(many.x) / len(few.x) == pytest.approx(4, rel=0.1)


def test_a_lower_alpha_gives_more_flakes() -> None:
    plane = np.linspace(0, 4, 3000, dtype=np.float32).reshape(50, 60)
    counts = [
        sum(len(emit(i, plane, _with(alpha=a)).x) for i in range(20)) for a in (0.5, 1.0, 2.0, 3.0)
    ]
    assert counts == sorted(counts, reverse=True) and counts[0] > 2 * counts[-1]


def test_flakes_are_born_on_candidates_only_and_prefer_strong_ones() -> None:
    plane = np.zeros((40, 40), np.float32)
    plane[10, 10], plane[20, 30], plane[30, 5] = 2.0, 6.0, 0.9
    born = [emit(i, plane, _with(candidate_count=1.0)) for i in range(60)]
    at = {(int(y), int(x)) for s in born for x, y in zip(s.x, s.y, strict=True)}
    assert at == {(10, 10), (20, 30)}
    strong = sum(int(np.sum(s.x >= 20)) for s in born)
    assert strong / sum(len(s.x) for s in born) == pytest.approx(0.75, abs=0.05)


def test_births_fall_into_their_frame() -> None:
    for frame in (0, 7, 100):
        ticks = emit(frame, _strength(), replace(EMITTER, rate=2000)).tick
        assert ticks.min() * TICK >= frame / 24 - TICK
        assert ticks.max() * TICK <= (frame + 1) / 24 + TICK


def test_sizes_are_log_normal_between_their_bounds() -> None:
    size = np.log(_all(300, EMITTER).size)
    assert np.exp(size.min()) >= 2.0 - 1e-9 and np.exp(size.max()) <= 8.0 + 1e-9
    assert np.mean(size) == pytest.approx(np.log(4.0), abs=0.03)


def _bursts(rate: float, frames: int = 2000, sparks: float = 16.0) -> list[Spawns]:
    """Return all bursts of a fire that sheds nothing else, each of them alone."""
    emitter = replace(_with(candidate_count=3000.0), rate=0.0, burst_rate=rate, burst_sparks=sparks)
    born = _all(frames, emitter, 3000)
    _, which = np.unique(np.stack([born.tick, born.x, born.y]), axis=1, return_inverse=True)
    return [born.take(np.flatnonzero(which == i)) for i in range(which.max(initial=-1) + 1)]


@pytest.mark.parametrize("mean", [1.0, 4.0, 16.0])
def test_a_burst_throws_small_sparks_from_one_point_at_one_moment(mean: float) -> None:
    bursts = _bursts(3.0, sparks=mean)
    sizes = np.array([len(born.x) for born in bursts])
    assert len(bursts) == pytest.approx(250, rel=0.2)
    assert np.mean(sizes) == pytest.approx(mean, rel=0.1)
    # 1 + a negative binomial number of shape 4
    assert np.var(sizes) == pytest.approx(mean - 1 + (mean - 1) ** 2 / 4, rel=0.4, abs=1e-9)
    for born in bursts:
        assert (born.kind == SPARK).all()


def test_sparks_are_a_standard_deviation_smaller_than_embers() -> None:
    sparks = Spawns.concatenate(_bursts(3.0))
    smaller = np.log(np.median(sparks.size) / 4)
    assert smaller / (np.log(4) / 4) == pytest.approx(-1, abs=0.1)


def test_sparks_of_a_burst_fly_apart_at_widely_spread_speeds() -> None:
    sparks = Spawns.concatenate(_bursts(3.0))
    velocity = np.stack([sparks.launch_x, sparks.launch_y]) / EMITTER.height
    mean = velocity.mean(axis=1)
    spread = np.sqrt(np.square(velocity - mean[:, None]).sum(axis=0).mean())
    assert abs(mean[0]) < 0.05 and mean[1] < -0.3, "they fly up rather than down"
    assert spread > 1.5 * np.hypot(*mean)
    speed = np.log(np.hypot(velocity[0], velocity[1] - mean[1]))
    assert 0.5 < np.std(speed) < 0.8 and abs(np.median(speed) - np.log(0.9)) < 0.15


def test_embers_are_not_thrown() -> None:
    born = _all(20, EMITTER)
    assert (born.kind == EMBER).all() and not born.launch_x.any() and not born.launch_y.any()


@pytest.mark.parametrize(
    ("keys", "bursts", "sparks"),
    [
        ({"rate": 80}, 80 / 60, 16.0),
        ({"rate": 80, "bursts": 2}, 2.0, 16.0),
        ({"rate": 80, "bursts": 50}, 5.0, 16.0),
        ({"rate": 80, "sparks": 0.4}, 2.0, 16.0),
        ({"rate": 80, "sparks": 0.4, "bursts": 4}, 4.0, 8.0),
        ({"rate": 80, "sparks": 0.4, "bursts": 0}, 32.0, 1.0),
        ({"rate": 80, "sparks": 0.0, "bursts": 2}, 0.0, 1.0),
        ({"rate": 80, "sparks": 0.0}, 0.0, 16.0),
        ({"rate": 0}, 0.0, 16.0),
    ],
)
def test_a_given_share_of_sparks_is_kept(
    keys: dict[str, float], bursts: float, sparks: float
) -> None:
    emitter = EmitterSettings.of(
        Flakes.model_validate(keys),
        clip_of([np.zeros((20, 20, 4), np.float32)]),
        moving_area=0.3, fires=(FIRE,), seed=1, art=NOT_ENLARGED,
    )  # fmt: skip
    assert (emitter.burst_rate, emitter.burst_sparks) == pytest.approx((bursts, sparks))


def test_sparks_of_bursts_take_the_place_of_single_flakes() -> None:
    single, crackling = _all(600, EMITTER), _all(600, replace(EMITTER, burst_rate=4.0))
    both = with_bursts_in_rate(crackling, ONE_FIRE, EMITTER.seed)
    assert len(both.x) == len(single.x) < len(crackling.x)
    assert both.kind.sum() == crackling.kind.sum() > 0.2 * len(single.x)
    assert np.isin(both.x, crackling.x).all() and (np.diff(both.tick) >= 0).all()


def test_single_flakes_make_way_for_bursts_evenly_over_the_clip() -> None:
    both = with_bursts_in_rate(_all(2400, replace(EMITTER, burst_rate=4.0)), ONE_FIRE, EMITTER.seed)
    quarters = np.histogram(both.tick[both.kind == EMBER], 4, (0, 6000))[0]
    assert quarters.min() > 0.9 * quarters.max()


def test_bursts_alone_are_never_more_than_the_rate() -> None:
    crackling = _all(600, replace(EMITTER, rate=10.0, burst_rate=4.0))
    both = with_bursts_in_rate(crackling, ONE_FIRE, EMITTER.seed)
    assert (both.kind == SPARK).all() and len(both.x) == pytest.approx(250, rel=0.05)


def test_the_sparks_of_a_burst_are_born_on_candidates() -> None:
    plane = np.zeros((40, 40), np.float32)
    plane[10, 10], plane[12, 13], plane[11, 11], plane[30, 5] = 2.0, 6.0, 0.9, 3.0
    emitter = replace(_with(candidate_count=3.0), rate=0.0, burst_rate=240.0)
    born = Spawns.concatenate([emit(i, plane, emitter) for i in range(60)])
    at = {(int(y), int(x)) for x, y in zip(born.x, born.y, strict=True)}
    assert at == {(10, 10), (12, 13), (30, 5)}


def test_what_has_to_be_cold_by_the_end_lives_no_longer() -> None:
    born = _all(48, EMITTER)
    cold = born.cooled_by(2.0)
    ends = cold.tick * TICK + cold.life
    assert np.all(ends <= 2.0 + TICK) and np.all(cold.life > 0)
    assert np.array_equal(cold.life[born.tick * TICK < 0.5], born.life[born.tick * TICK < 0.5])
    assert np.array_equal(cold.x, born.x)


def test_a_frames_births_depend_on_seed_and_frame_alone() -> None:
    one, two = emit(4, _strength(), EMITTER), emit(4, _strength(), EMITTER)
    other = emit(4, _strength(), replace(EMITTER, seed=6))
    for f in fields(Spawns):
        assert np.array_equal(getattr(one, f.name), getattr(two, f.name))
    assert not np.array_equal(one.x, other.x)


def test_nothing_is_born_where_there_is_no_fire() -> None:
    assert len(emit(0, np.zeros((20, 20), np.float32), EMITTER).x) == 0


def test_twice_the_fire_sheds_twice_as_many() -> None:
    assert automatic_rate(0.6, 1.0, 60) == pytest.approx(2 * automatic_rate(0.3, 1.0, 60))


def test_the_smallest_fire_sheds_next_to_nothing_and_does_not_burst() -> None:
    rate = automatic_rate(0.03, 1.0, np.inf)
    assert 0 < rate < 2 and automatic_burst_rate(rate) == 0
    assert automatic_burst_rate(automatic_rate(1.0, 1.0, 60)) > 0


def test_where_flakes_cannot_be_drawn_as_small_as_they_are_there_are_fewer() -> None:
    assert automatic_rate(0.5, 0.25, 60) < automatic_rate(0.5, 1.0, 60) / 2
    assert automatic_rate(0.5, 3.0, 60) == automatic_rate(0.5, 1.0, 60)


def test_the_shortest_clip_sheds_a_few_and_a_loop_no_more_than_its_fire_does() -> None:
    assert automatic_rate(0.0, 1.0, 0.1) * 0.1 > 3
    assert automatic_rate(0.2, 1.0, np.inf) == automatic_rate(0.2, 1.0, 3600)


@pytest.mark.parametrize("mean", [0.3, 4.0, 60.0])
def test_the_births_of_a_frame_are_poisson_distributed(mean: float) -> None:
    """Of any one frame, over many seeds."""
    counts = [
        len(emit(3, _strength(), replace(EMITTER, rate=24 * mean, seed=seed)).x)
        for seed in range(1500)
    ]
    assert np.mean(counts) == pytest.approx(mean, abs=4 * (mean / 1500) ** 0.5)
    assert np.var(counts) == pytest.approx(mean, rel=0.15)


@pytest.mark.parametrize("seed", range(8))
def test_a_small_fire_sheds_in_every_second(seed: int) -> None:
    emitter = replace(EMITTER, rate=8.0, seed=seed)
    counts = [len(emit(i, _strength(), emitter).x) for i in range(240)]
    assert all(2 <= sum(counts[i : i + 24]) <= 14 for i in range(216))


def _tried(x: list[list[float]], ticks: list[int], kind: int = EMBER) -> list[Spawns]:
    """Return flakes born in ``ticks``, in each of the places tried: x px, and y 0."""
    born = Spawns.concatenate([_all(12, EMITTER).take(np.arange(len(ticks)))])
    born = replace(born, tick=np.array(ticks), kind=np.full(len(ticks), kind), y=0 * born.y)
    return [replace(born, x=np.array(places)) for places in x]


def test_an_ember_is_born_in_the_first_place_that_is_apart_from_those_before_it() -> None:
    tried = _tried([[50, 51, 150], [0, 54, 0], [0, 90, 0], [0, 130, 0]], [0, 1, 2])
    assert apart(tried, 200, np.inf).x.tolist() == [50, 90, 150]


def test_an_ember_without_such_a_place_is_born_in_the_farthest() -> None:
    tried = _tried([[50, 51], [0, 46], [0, 53]], [0, 1])
    assert apart(tried, 200, np.inf).x.tolist() == [50, 46]


def test_embers_long_after_one_another_may_be_born_in_one_place() -> None:
    tried = _tried([[50, 50], [0, 90]], [0, 30])
    assert apart(tried, 200, np.inf).x.tolist() == [50, 50]


def test_the_end_of_a_loop_is_apart_from_its_beginning() -> None:
    tried = _tried([[50, 50], [0, 90]], [0, 58])
    assert apart(tried, 200, 1.0).x.tolist() == [50, 90]
    assert apart(tried, 200, 2.0).x.tolist() == [50, 50]


def test_sparks_of_a_burst_stay_in_its_place() -> None:
    tried = _tried([[50, 50], [0, 90]], [0, 0], SPARK)
    assert apart(tried, 200, np.inf).x.tolist() == [50, 50]


def test_flakes_tried_in_one_place_stay_as_they_are() -> None:
    (born,) = _tried([[50, 50]], [0, 0])
    assert apart([born], 200, np.inf) is born
