"""One fire, seen from many sides."""

import itertools
import math

import numpy as np
import pytest

from fire_atlas.core.pixels import REC709
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.shading import shade_table
from fire_atlas.generators.profile.model import Profile
from fire_atlas.recipe.wind import Wind
from tests.generators.profile.flames import swaying
from tests.support.clips import real
from tests.support.likeness import (
    fire_of,
    generated,
    learnt,
    learnt_from,
    learnt_narrow_and_wide,
    look_at_fire,
    seen,
    settings,
    silhouette,
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["torch", real("sim_unity_flame03")])
def profile(request: pytest.FixtureRequest) -> Profile:
    return learnt_from(request.param)


@pytest.fixture(scope="module")
def fire(profile: Profile) -> GeneratedFire:
    return fire_of(profile, settings(24))


def test_eight_silhouettes_of_a_frame_pass_into_one_another(fire: GeneratedFire) -> None:
    round_ = seen(fire, [45.0 * k for k in range(8)])
    for frame in (0, 11):
        shapes = np.array([silhouette(clip.read(frame)) for clip in round_])
        area, x, y = shapes.T
        step = np.abs(np.roll(shapes, -1, axis=0) - shapes)
        assert (step[:, 0] < 0.35 * area.mean()).all(), area
        assert (step[:, 1] < 0.1 * round_[0].height).all(), x
        assert (step[:, 2] < 0.1 * round_[0].height).all(), y


def test_a_camera_that_goes_round_sees_the_fire_change_little_by_little(
    fire: GeneratedFire,
) -> None:
    fine = seen(fire, [3.0 * k for k in range(6)])
    frames = [clip.read(7) for clip in fine]
    near = [float(np.abs(b - a).sum()) for a, b in itertools.pairwise(frames)]
    far = seen(fire, [90.0])[0].read(7)
    assert max(near) < 0.5 * float(np.abs(frames[0] - far).sum())


def test_from_behind_left_and_right_change_places() -> None:
    leaning = learnt(swaying(lean=12.0, reach=3.0)[0])
    front, back = generated(leaning, settings(24), [0.0, 180.0])
    lean = [float(look_at_fire(clip, 60.0).leans.mean()) for clip in (front, back)]
    assert lean[0] == pytest.approx(-lean[1], abs=2) and lean[0] > 8


@pytest.mark.parametrize(("one", "other"), [((8, 2), (4, 1)), ((8, 0), (1, 0)), ((12, 9), (4, 3))])
def test_a_view_is_the_same_however_many_others_there_are(
    one: tuple[int, int], other: tuple[int, int]
) -> None:
    fire, pair = fire_of(learnt_from("torch"), settings(6)), []
    for count, k in (one, other):
        pair.append(seen(fire, [360.0 * i / count for i in range(count)])[k])
    assert all((pair[0].read(i) == pair[1].read(i)).all() for i in (0, 3, 5))


def test_between_two_views_a_colour_is_one_that_the_clip_has_at_its_light() -> None:
    """Half of a mirrored flame is over half of it: the mean of yellow and nothing is olive."""
    torch = learnt_from("torch")
    front, between = (
        shade_table(torch, math.radians(azimuth)).shades[..., :3] for azimuth in (0, 135)
    )
    light = [shades @ REC709 for shades in (front, between)]
    for low in (0.02, 0.05, 0.1):
        own, mixed = (
            shades[(lit >= low) & (lit < 2 * low)]
            for shades, lit in zip((front, between), light, strict=True)
        )
        greenest = np.quantile(own[:, 1] / own[:, 0], 0.95)
        assert (mixed[:, 1] / mixed[:, 0] > 1.3 * greenest).mean() < 0.05


def test_a_perpendicular_pair_of_clips_is_honoured() -> None:
    clips = generated(learnt_narrow_and_wide(), settings(24), [0.0, 90.0, 45.0])
    front, side, between = (look_at_fire(clip, 60.0).width for clip in clips)
    assert front == pytest.approx(28, rel=0.1)
    assert side == pytest.approx(60, rel=0.1)
    assert 28 < between < 60


def test_from_above_the_fire_is_lower_and_its_foot_rounder(fire: GeneratedFire) -> None:
    level, above = (seen(fire, elevation=elevation)[0] for elevation in (0.0, 50.0))
    threshold = fire.profile.front.threshold
    one, other = look_at_fire(level, threshold), look_at_fire(above, threshold)
    assert 0.55 < other.height / one.height < 0.9
    assert other.width == pytest.approx(one.width, rel=0.25)


def test_wind_from_the_left_blows_away_from_a_camera_on_the_left() -> None:
    profile = learnt_from("torch")
    blows = Wind(level=4.0)
    still = generated(profile, settings(48), [0.0, 90.0, 180.0])
    blown = generated(profile, settings(48, wind=blows), [0.0, 90.0, 180.0])
    more = []
    for before, after in zip(still, blown, strict=True):
        looks = [look_at_fire(clip, profile.front.threshold) for clip in (before, after)]
        more.append(float(looks[1].leans.mean() - looks[0].leans.mean()))
    assert more[0] > 10 and more[2] < -10 and abs(more[1]) < 6
