"""How gas is drawn: hot smoke glows, smoke shades what lies behind it, and it ends in pieces."""

from dataclasses import replace

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.combustion import SMOKE, TEMPERATURE
from fire_atlas.generators.fluid.drawing import Painter, SeenGas
from fire_atlas.generators.fluid.fires import FIRES, Look
from fire_atlas.generators.fluid.recording import record
from fire_atlas.generators.fluid.scene import build_scene
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

COUNT, CELL = 24, 1 / 24
EXPLOSION = FIRES["explosion"].look


def drawn(gas: NDArray[np.float32], look: Look = EXPLOSION) -> SeenGas:
    """Draw gas a px a cube."""
    return Painter(look, 1.0, CELL).draw(gas, gas.shape[1:3], 1.0)


def ball(smoke: float, temperature: float) -> NDArray[np.float32]:
    """Return gas of one temperature with a ball of smoke in its middle."""
    gas = np.zeros((COUNT, COUNT, COUNT, 4), np.float32)
    places = np.indices(gas.shape[:3]) - (COUNT - 1) / 2
    inside = np.sqrt((places**2).sum(axis=0)) < 7
    gas[inside, SMOKE], gas[..., TEMPERATURE] = smoke, temperature
    return gas


def test_opaque_smoke_shines_as_opaque_fuel_of_its_temperature_does() -> None:
    light = [drawn(ball(1.5, hot)).fire[COUNT // 2, COUNT // 2] for hot in (0, 0.8, 1.1, 1.4)]
    assert not light[0].any()
    assert light[1][0] < light[2][0] < light[3][0]
    assert light[1][0] > light[1][1] > light[1][2], "it is red"
    look = replace(EXPLOSION, glow=0.0)
    table = Painter(look, 1.0, CELL).table
    hot = drawn(ball(3.0, 1.1), look).fire[COUNT // 2, COUNT // 2]
    entry = int(1.1 * 0.6 * (table.shape[1] - 1) / 1.5)
    assert np.allclose(hot, table[:, entry], rtol=0.05)


def test_light_comes_from_above_left_and_front() -> None:
    lit = Painter(EXPLOSION, 1.0, CELL).lit_smoke(ball(1.0, 0.0))
    assert lit is not None
    sun = lit.light[..., 0]
    low, middle, high = 5, COUNT // 2, 18
    assert sun[middle, low, middle] > 2 * sun[middle, high, middle]
    assert sun[middle, middle, low] > 2 * sun[middle, middle, high]
    assert sun[low, middle, middle] > 2 * sun[high, middle, middle]


def test_fresh_soot_is_blacker_than_old_but_steam_is_white_however_warm() -> None:
    for look, left in ((EXPLOSION, 0.15), (FIRES["steam"].look, 1.0)):
        painter = Painter(look, 1.0, CELL)
        old, fresh = painter.lit_smoke(ball(1.0, 0.0)), painter.lit_smoke(ball(1.0, 1.2))
        assert old is not None
        assert fresh is not None
        assert np.allclose(fresh.light[..., :2], left * old.light[..., :2], atol=1e-4)


def test_a_shadow_falls_where_the_light_goes() -> None:
    gas = np.zeros((COUNT, COUNT, COUNT, 4), np.float32)
    gas[4:7, 2:5, 4:7, SMOKE] = 3.0
    lit = Painter(replace(EXPLOSION, thin=0.0), 1.0, CELL).lit_smoke(gas)
    assert lit is not None
    layer, column = np.unravel_index(np.argmin(lit.light[:, 15, :, 0]), (COUNT, COUNT))
    # Twelve rows lower, six layers behind and six columns to the right of its middle.
    assert abs(layer - 11) <= 1 and abs(column - 11) <= 1


def test_thin_smoke_is_drawn_thinner_and_dense_smoke_as_it_is() -> None:
    painter = Painter(replace(EXPLOSION, thin=0.4), 1.0, CELL)
    smoke = np.array([[0.0, 0.1, 0.2, 0.4, 1.0]], np.float32)
    assert np.allclose(painter.smoke(smoke), [[0, 0.1 * 0.15625, 0.1, 0.4, 1.0]])


def test_smoke_is_torn_before_it_is_gone() -> None:
    source = FluidSource.model_validate(
        {"kind": "fluid", "fire": "explosion", "resolution": 22, "width": 60, "height": 60}
        | {"radius": 0.14, "blast": 0.5}
    )
    scene = build_scene(source, GenerationSettings(1, Wind(), 24, 24.0, True, Views()))
    with Workers(2) as workers:
        volumes: list[Volume] = []
        record(scene, workers, volumes.append)
    dense = [volume.scalars()[..., SMOKE] > 0.05 for volume in volumes]
    filled = [int(part.sum()) for part in dense]
    pieces = [scipy.ndimage.label(part)[1] for part in dense]
    assert not dense[-1].any()
    assert filled[15] > filled[18] > filled[21] > filled[23]
    assert max(pieces[17:23]) > 3 * pieces[12]
