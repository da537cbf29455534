"""Frames whose longer side is stated, as by ``source.size``, hold the fire and have its shape."""

import numpy as np
import pytest

from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.rendering import (
    ProfileRendering,
    renderings,
    renderings_in_wind,
)
from fire_atlas.recipe.wind import Wind
from tests.support.likeness import learnt_from, learnt_kite, settings


def kite_in(wind: float) -> GeneratedFire:
    return GeneratedFire.of(learnt_kite(), settings(12, wind=Wind(level=wind)))


def edge_of(view: ProfileRendering) -> float:
    """Return the largest alpha on the sides of some frames."""
    frames = [view.frame(i)[..., 3] for i in (0, 6)]
    return max(float(e.max()) for a in frames for e in (a[0], a[-1], a[:, 0], a[:, -1]))


@pytest.mark.parametrize("side", [192, 384, 512])
@pytest.mark.parametrize(("wind", "is_wide"), [(0.0, False), (5.0, True)])
def test_a_frame_has_the_stated_longer_side_and_the_shape_of_the_fire(
    side: int, wind: float, is_wide: bool
) -> None:
    fire = kite_in(wind)
    [usual], [view] = (renderings(fire, [0.0], 0.0, None, longer) for longer in (None, side))
    camera, shape = view.camera, usual.camera.width / usual.camera.height
    assert (camera.width if is_wide else camera.height) == side
    assert max(camera.width, camera.height) == side
    # The empty px around the fire are as many at any size.
    assert camera.width / camera.height == pytest.approx(shape, rel=0.05)
    assert edge_of(view) < 0.1


def test_of_a_tall_fire_the_longer_side_is_its_height() -> None:
    fire = kite_in(0.0)
    [by_side] = renderings(fire, [0.0], 0.0, None, 192)
    [by_height] = renderings(fire, [0.0], 0.0, 192)
    assert by_side.camera == by_height.camera
    assert np.array_equal(by_side.frame(3), by_height.frame(3))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["candle", "torch"])
def test_loops_in_several_winds_share_a_frame_of_the_stated_side(name: str) -> None:
    profile = learnt_from(name)
    fires = [
        GeneratedFire.of(profile, settings(12, wind=Wind(level=level))) for level in (0.0, 4.0, 5.0)
    ]
    views = renderings_in_wind(fires, 0.0, None, 192)
    assert {max(view.camera.width, view.camera.height) for view in views} == {192}
    assert len({(view.camera.width, view.camera.height, view.camera.scale) for view in views}) == 1
    assert max(edge_of(view) for view in views) < 0.05
