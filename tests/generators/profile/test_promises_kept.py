"""What is learnt of a clip is seen in what is generated: flicker, rise, colours of both sides, the
lean that the wind asks for, points where they were moved."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.rendering import ProfileRendering, renderings
from fire_atlas.generators.profile.generate.skeleton import skeletons
from fire_atlas.generators.profile.model import Profile
from fire_atlas.recipe.wind import Wind
from tests.generators.profile.flames import clip_of, kite, painted, swaying
from tests.support.likeness import (
    Array,
    generated,
    learnt,
    learnt_from,
    learnt_kite,
    look_at_fire,
    settings,
)


def _pulsing(hertz: float, fps: float = 24.0, count: int = 48) -> Clip:
    """Return a flame of one shape, whose light pulses by a quarter; each half of it a little in
    its own way."""
    chance = np.random.default_rng(1)
    leans, frames = swaying(count, reach=3.0)[1], []
    ripple = chance.normal(0, 0.06, (count, 2))
    for i in range(count):
        mask = kite(leans[i])
        columns = np.arange(mask.shape[1]) > mask.shape[1] / 2
        light = 0.5 * (1 + 0.25 * math.sin(2 * math.pi * hertz * i / fps))
        frame = painted(mask)
        frame[..., :3] *= light * (1 + np.where(columns, *ripple[i]))[None, :, None]
        frames.append(frame.astype(np.float32))
    return clip_of(frames, fps)


def _contrast(light: Array) -> float:
    """Return the standard deviation of the light of frames, relative to its mean."""
    return float(light.std() / light.mean())


@pytest.mark.slow
@pytest.mark.parametrize("hertz", [1.0, 2.0, 3.0, 4.0, 6.0, 8.0])
def test_the_flicker_of_the_whole_flame_is_kept(hertz: float) -> None:
    """Slices that lag by up to a quarter of a second combed out 2 and 6 Hz."""
    clip = _pulsing(hertz)
    [fire] = generated(learnt(clip), settings(48, loop=False))
    seen = [
        np.array([float(each.read(i)[..., :3].sum()) for i in range(48)]) for each in (clip, fire)
    ]
    filmed, drawn = map(_contrast, seen)
    assert drawn == pytest.approx(filmed, rel=0.15)


def _rendering(profile: Profile, azimuth: float = 0.0, **keys: float) -> ProfileRendering:
    fire = GeneratedFire.of(profile, settings(24, loop=True, **keys))  # type: ignore[arg-type]
    return renderings(fire, [azimuth], 0.0, None)[0]


@pytest.mark.parametrize("speed", [0.5, 1.0, 1.6, 3.0])
def test_particles_rise_as_fast_as_the_profile_says(speed: float) -> None:
    view = _rendering(replace(learnt_kite(), rise_speed=speed), detail=0.0)
    skeleton = skeletons(view.fire.planes, 0.0, 0.0).moved
    # As many lie in a band of the zone as are born while one crosses it.
    shares = np.concatenate([view.cloud.places(skeleton, float(t))[1] for t in range(24)])
    band = np.mean((shares > 0.3) & (shares < 0.8)) * len(shares) / 24
    born = len(view.fire.particles.birth) / view.fire.particles.period * 24
    assert born * 0.5 / band == pytest.approx(speed, rel=0.1)


@pytest.mark.slow
def test_a_fire_of_two_clips_has_the_colours_of_each_from_its_side() -> None:
    orange, blue = (
        clip_of([painted(kite(lean), colour) for lean in swaying()[1]])
        for colour in ((255, 140, 40), (40, 140, 255))
    )
    profile = learnt(orange, blue)
    for detail in (0.0, 1.0):
        fires = generated(profile, settings(8, detail=detail), [0.0, 90.0, 45.0])
        front, side, between = (fire.read(4)[..., :3].reshape(-1, 3).sum(axis=0) for fire in fires)
        assert front[0] > 3 * front[2] and side[2] > 3 * side[0]
        assert 0.3 < between[0] / between[2] < 3


def test_the_wind_asks_for_the_lean_whatever_the_clips_own_is() -> None:
    """By the line fitted to the flame, which leans less than that to its top: its foot stays."""
    leaning = learnt(swaying(lean=20.0, reach=3.0)[0])
    leans = []
    for direction in ("right", "left"):
        blows = Wind.model_validate({"level": 5, "direction": direction})
        [fire] = generated(leaning, settings(48, wind=blows))
        leans.append(float(look_at_fire(fire, leaning.front.threshold).leans.mean()))
    assert leans[0] == pytest.approx(-leans[1], abs=4)
    assert 20 < leans[0] < 32


def _moved(profile: Profile, name: str, by: tuple[float, float]) -> Profile:
    points = tuple(
        each._replace(**{name: tuple(np.add(getattr(each, name), by))})
        for each in profile.front.points
    )
    return replace(profile, front=replace(profile.front, points=points))


@pytest.mark.parametrize("detail", [0.0, 1.0])
@pytest.mark.parametrize(
    ("name", "by"),
    [("top", (0.0, -40.0)), ("top", (50.0, 0.0)), ("bottom", (0.0, 10.0)), ("left", (-25.0, 0.0))],
)
def test_a_fire_whose_points_were_moved_stays_in_its_frame(
    name: str, by: tuple[float, float], detail: float
) -> None:
    view = _rendering(_moved(learnt_kite(), name, by), detail=detail)
    alpha = view.frame(5)[..., 3]
    edges = alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]
    assert max(float(edge.max()) for edge in edges) < 0.1


def test_a_point_that_comes_near_its_neighbour_does_not_bend_the_rest() -> None:
    """A natural spline through points nearly above each other swings out: by 17 px."""
    profile = learnt_kite()
    lowest = []
    for by in ((0.0, 0.0), (8.0, 0.0)):
        view = _rendering(_moved(profile, "mid_right", by), detail=1.0)
        rows = np.flatnonzero((view.frame(5)[..., 3] > 0.5).any(axis=1))
        lowest.append(rows[-1] - view.camera.origin[1])
    assert abs(lowest[1] - lowest[0]) <= 1


@pytest.mark.slow
def test_the_median_spark_of_a_torch_in_wind_is_where_its_fire_is() -> None:
    """Seen from every side, also from above: births lie in the flame, in depth as in the frame."""
    fire = GeneratedFire.of(learnt_from("torch"), settings(16, wind=Wind(level=4.0), loop=False))
    azimuths = [45.0 * k for k in range(8)]
    views = renderings(fire, azimuths, 30.0, 240)
    front = views[0].front
    level = views[0].seen_by(front)
    alpha = level.frame(10)[..., 3]
    rows, columns = np.nonzero(alpha > 0.3)
    x, y = (each.astype(np.float64) + 0.5 for each in (columns, rows))
    depth = level.fire_depth(10, x, y, np.full(len(x), 0.5))
    world = front.unproject(np.stack([x, y, depth / -front.scale], axis=-1))
    for view in views:
        seen = view.camera.project(world)
        middle = np.median(seen[:, :2], axis=0).astype(int)
        around = view.frame(10)[..., 3][
            middle[1] - 6 : middle[1] + 7, middle[0] - 6 : middle[0] + 7
        ]
        assert around.max() > 0.3, view.camera.azimuth
