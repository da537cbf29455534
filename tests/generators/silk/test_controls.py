"""Keys that change while a fire burns: pressure, oxygen, lift, gravity, turbulence."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.silk.controls import Controls
from fire_atlas.generators.silk.sheet_textures import SheetTextures
from fire_atlas.generators.silk.simulation import Recording
from tests.generators.silk.small_fires import camera, fire, recorded, source

UP_AND_DOWN = {"keyframes": [{"t": 0, "value": 1}, {"t": 0.5, "value": 3}, {"t": 1, "value": 1}]}


def ramp(first: float, last: float) -> dict[str, Any]:
    return {"keyframes": [{"t": 0, "value": first}, {"t": 1, "value": last}]}


def test_gas_that_speeds_up_goes_the_integral_of_its_speed() -> None:
    """Gas is as fast as the root of pressure times oxygen."""
    controls = Controls.of(source(pressure=ramp(1, 4), oxygen=2.0))
    # The integral of the root of 2 (1 + 3t) from 0 to 1.
    assert controls.gas_time(1.0) == pytest.approx(math.sqrt(2) * 2 / 9 * (8 - 1), rel=1e-4)
    assert controls.gas_time(2.0) - controls.gas_time(1.5) == pytest.approx(0.5 * math.sqrt(8))
    assert controls.gas_time(-1.0) == pytest.approx(-math.sqrt(2))
    steady = Controls.of(source(pressure=4.0))
    assert [steady.gas_time(t) for t in (-1.0, 0.0, 2.5)] == pytest.approx([-2.0, 0.0, 5.0])


@pytest.mark.parametrize("key", ["pressure", "oxygen", "lift", "gravity", "turbulence"])
def test_a_key_that_changes_begins_as_at_its_first_value(key: str) -> None:
    """And is where it stays after the last keyframe, as if it had always been there."""
    frames = 48
    keyframes: list[dict[str, Any]] = [{"t": 0, "value": 0.6}, {"t": 0.4, "value": 2}]
    keys: tuple[dict[str, Any], ...] = ({key: {"keyframes": keyframes}}, {key: 0.6}, {key: 2.0})
    changing, before, after = (recorded(frames, loops=False, **each) for each in keys)
    assert np.abs(changing.x[0] - before.x[0]).max() < 0.01

    def height(made: Recording) -> NDArray[np.float64]:
        return np.asarray(made.x[..., -1, :, 2].mean(axis=(1, 2)), np.float64)

    def pace(made: Recording) -> NDArray[np.float64]:
        return np.asarray(made.rate.mean(axis=1), np.float64)

    figure = pace if key in ("oxygen", "turbulence") else height
    low, high, found = (figure(made)[30:].mean() for made in (before, after, changing))
    assert abs(found - high) < 0.2 * abs(high - low)


def test_oxygen_that_comes_brightens_the_fire_by_what_it_would_shed_in_it() -> None:
    changing = fire(25, loops=False, oxygen=ramp(0.5, 2.0), sheets={"count": 2})
    light = [changing.draw(i, camera()).light.sum() for i in (0, 1, 23, 24)]
    poor, rich = (fire(25, loops=False, oxygen=o, sheets={"count": 2}) for o in (0.5, 2.0))
    expected = poor.draw(0, camera()).light.sum(), rich.draw(24, camera()).light.sum()
    assert light[0] == pytest.approx(expected[0], rel=0.4)
    assert light[-1] == pytest.approx(expected[1], rel=0.4)
    assert sum(light[2:]) > 2 * sum(light[:2])


def hottest_row(textures: SheetTextures, i: int) -> float:
    """Height of the flame, 0..1 of the sheet, in the mean of the sheets."""
    sheets = range(len(textures.texture_index))
    tops = []
    for sheet in sheets:
        lit = textures.image(i, sheet)[..., 0].max(axis=1) > 0.2
        tops.append(1 - np.flatnonzero(lit)[0] / len(lit))
    return float(np.mean(tops))


def test_pressure_that_falls_lowers_the_flame_on_its_sheet() -> None:
    """To about what it would be there had the pressure always been low."""
    keyframes = [{"t": 0, "value": 1.6}, {"t": 1, "value": 0.3}]
    made = fire(48, loops=False, pressure={"keyframes": keyframes}, sheets={"count": 6})
    low = fire(48, loops=False, pressure=0.3, sheets={"count": 6})
    first, last = range(0, 6), range(30, 48)
    tall, found, wanted = (
        np.mean([hottest_row(each.textures, i) for i in frames])
        for each, frames in ((made, first), (made, last), (low, last))
    )
    assert found == pytest.approx(wanted, rel=0.1)
    assert wanted < 0.8 * tall


def test_a_loop_in_which_a_key_comes_back_closes() -> None:
    made = fire(24, pressure=UP_AND_DOWN, oxygen=UP_AND_DOWN)
    first, again = (made.draw(i, camera()).light for i in (0, 24))
    assert np.array_equal(first, again)


@pytest.mark.parametrize("key", ["pressure", "oxygen", "lift", "gravity", "turbulence"])
def test_a_loop_in_which_a_key_would_jump_is_refused_with_the_way_out(key: str) -> None:
    message = rf"source\.{key}: begins at 1 but is 2 after 1 s.*back to 1 by then.*loop: none"
    keys: dict[str, Any] = {key: ramp(1, 2)}
    with pytest.raises(RecipeError, match=message):
        fire(24, **keys)
    assert len(recorded(4, loops=False, **keys).x) == 4


@pytest.mark.parametrize(
    ("value", "advice"),
    [
        (ramp(1, 9), r"the value at 1 s must be from 0\.2 to 5; got 9"),
        ({"keyframes": []}, "at least 1"),
        ({"keyframes": [{"t": 1, "value": 1}, {"t": 0, "value": 1}]}, "in order of t"),
        ("high", "must be a number or {keyframes"),
    ],
)
def test_keyframes_that_cannot_be_are_refused(value: Any, advice: str) -> None:
    with pytest.raises(ValueError, match=advice):
        source(pressure=value)
