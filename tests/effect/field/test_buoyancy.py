"""The terms of equation 12 against analytic solutions."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from fire_atlas.core.noise import PlaneWaves
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.buoyancy import (
    BuoyancyField,
    advect,
    diffuse,
    effective_step,
    project,
)
from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.forcing import grid_shape

SHAPE = (60, 80)


def _plane(value: float) -> Plane:
    return np.full(SHAPE, value, np.float32)


@pytest.mark.parametrize(("side", "cells"), [(640, 160), (391, 98), (1, 1), (400, 100)])
def test_the_grid_rounds_up_as_in_table_1(side: int, cells: int) -> None:
    assert grid_shape(side, side, 4) == (cells, cells)


def test_a_uniform_field_advects_a_blob_of_heat_by_v_dt() -> None:
    y, x = np.mgrid[:60, :80].astype(np.float32)

    def blob(cx: float, cy: float) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
        return np.asarray(np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / 60), np.float32)

    field = advect(BuoyancyField(_plane(40.0), _plane(-20.0), blob(40, 30)), dt=0.5, cell=4)
    assert np.abs(field.heat - blob(45, 27.5)).max() < 0.01  # 40·0.5/4 = 5 cells, 20·0.5/4 = 2.5


def test_a_slow_field_still_advects() -> None:
    heat = np.tile(np.arange(80, dtype=np.float32), (60, 1))
    moved = advect(BuoyancyField(_plane(0.01 * 24), _plane(0.0), heat), dt=1 / 24, cell=1).heat
    assert np.allclose(moved[:, 5:-5], heat[:, 5:-5] - 0.01, atol=2e-4)


def test_a_shear_field_is_advected_as_the_analytic_solution() -> None:
    y, x = np.mgrid[:60, :80].astype(np.float32)
    shear = (y - 30) * 0.8  # u(y): v = 0, so u itself is unchanged by its own advection
    heat = np.sin(x / 9).astype(np.float32)
    field = advect(BuoyancyField(shear, _plane(0.0), heat), dt=0.5, cell=1)
    assert np.allclose(field.u, shear, atol=1e-4)
    wanted = np.sin((x - shear * 0.5) / 9)
    assert np.abs(field.heat - wanted)[:, 16:-16].max() < 3e-3


def test_viscosity_spreads_a_jet_as_the_heat_equation_does() -> None:
    y = np.mgrid[:120, :20][0].astype(np.float32)

    def jet(variance: float) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
        profile = np.exp(-((y - 60) ** 2) / (2 * variance)) / math.sqrt(variance)
        return np.asarray(profile, np.float32)

    zero = np.zeros_like(y)
    field = diffuse(BuoyancyField(jet(16), zero, zero), viscosity=40.0, dt=0.5, cell=2)
    # variance grows by 2 ν t = 40 px², which is 10 cells²
    assert np.abs(field.u - jet(26)).max() < 0.01 * jet(26).max()


def _relaxed(value: float, force: float, target: float, rate: float, dt: float) -> Plane:
    """dw/dt = force + rate (target − w), from w = ``value`` on."""
    slope = _plane(force) + _plane(rate) * (_plane(target) - _plane(value))
    return _plane(value) + slope * effective_step(_plane(rate), dt)


def test_drag_halves_speed_after_its_half_life() -> None:
    drag = 2.5
    half = _relaxed(80, 0, 0, drag, math.log(2) / drag)
    assert np.allclose(half, 40, rtol=1e-6)


def test_a_force_without_drag_gives_v_equal_a_t() -> None:
    assert np.allclose(_relaxed(5, 30, 0, 0, 0.25), 12.5)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 1.0, 1e6, 1e30])
@pytest.mark.parametrize("dt", [1e-6, 0.04, 1e3])
def test_relaxing_never_overshoots(rate: float, dt: float) -> None:
    value = _relaxed(100, 0, -50, rate, dt)
    assert np.isfinite(value).all() and (value <= 100).all() and (value >= -50.001).all()


def test_huge_speeds_advect_without_nan() -> None:
    field = advect(BuoyancyField(_plane(1e30), _plane(-1e30), _plane(1.0)), dt=10.0, cell=1)
    assert all(np.isfinite(p).all() for p in (field.u, field.v, field.heat))


def _divergence(
    u: np.ndarray[tuple[int, int], np.dtype[np.float32]],
    v: np.ndarray[tuple[int, int], np.dtype[np.float32]],
) -> float:
    along_x = (u[1:-1, 2:] - u[1:-1, :-2]) / 2
    along_y = (v[2:, 1:-1] - v[:-2, 1:-1]) / 2
    return float(np.sqrt(np.mean((along_x + along_y) ** 2)))


def test_projection_removes_the_divergence_of_a_source_and_keeps_a_vortex() -> None:
    y, x = np.mgrid[:64, :64].astype(np.float32)
    dx, dy = x - 31.5, y - 31.5
    near = np.exp(-(dx**2 + dy**2) / 80)
    u, v = (dx * near).astype(np.float32), (dy * near).astype(np.float32)
    assert _divergence(*project(u, v)) < 0.03 * _divergence(u, v)
    vortex = project(-v, u)
    assert np.abs(vortex[0] + v).max() < 0.02 * np.abs(v).max()


def test_eddies_are_divergence_free_and_as_fast_as_asked() -> None:
    speeds, divergences = [], []
    for seed in range(12):
        u, v = Eddies.random(seed, 160, speed=30.0).velocity(0.7, (160, 120))
        speeds.append(np.mean(u.astype(np.float64) ** 2 + v**2))
        divergences.append(_divergence(u, v))
    assert math.sqrt(np.mean(speeds)) == pytest.approx(30.0, rel=0.15)
    assert max(divergences) < 0.1


def test_eddies_of_one_wave_match_the_formula() -> None:
    waves = PlaneWaves(*(np.array([value]) for value in (0.3, 0.4, 2.0, 0.5, 7.0 / 0.5)))
    eddies = Eddies(waves)
    u, v = eddies.velocity(1.5, (5, 6))
    wave = math.sin(0.3 * 4 + 0.4 * 3 + 0.5 + 2.0 * 1.5) * 7.0
    assert u[3, 4] == pytest.approx(wave * 0.4 / 0.5, rel=1e-4)
    assert v[3, 4] == pytest.approx(-wave * 0.3 / 0.5, rel=1e-4)


def test_the_sides_of_a_tile_are_open_to_one_another() -> None:
    """Whatever acts on a field that tiles, acts on it alike wherever it begins."""
    chance = np.random.default_rng(5)
    u, v, heat = (chance.normal(0, 30, SHAPE).astype(np.float32) for _ in range(3))

    def around(plane: Plane) -> Plane:
        return np.roll(plane, 31, axis=1)

    field = BuoyancyField(u, v, heat)
    aside = BuoyancyField(around(u), around(v), around(heat))
    terms: tuple[Callable[[BuoyancyField], BuoyancyField], ...] = (
        lambda state: advect(state, 0.5, 4, tiles=True),
        lambda state: diffuse(state, 40.0, 0.5, 2, tiles=True),
        lambda state: BuoyancyField(*project(state.u, state.v, tiles=True), state.heat),
    )
    for term in terms:
        for name in ("u", "v", "heat"):
            one, other = getattr(term(field), name), getattr(term(aside), name)
            assert np.abs(around(one) - other).max() < 1e-3 * np.abs(one).max()
    smooth = diffuse(field, 40.0, 0.5, 2, tiles=True)
    free = project(smooth.u, smooth.v, tiles=True)
    assert _divergence(*free) < 0.1 * _divergence(smooth.u, smooth.v)


def test_eddies_of_a_tile_go_on_over_its_sides() -> None:
    u, v = Eddies.random(3, 60, 30.0, columns=80).velocity(0.7, (60, 240))
    for plane in (u, v):
        assert np.abs(plane[:, :160] - plane[:, 80:]).max() < 0.1 < plane.std()
