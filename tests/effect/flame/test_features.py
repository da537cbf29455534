"""Equations 1-3 against answers known in closed form."""

import math

import cv2
import numpy as np
import pytest

from fire_atlas.effect.flame.features import (
    Box,
    difference_of_gaussians,
    feature_vectors,
    gradient,
    kappa,
    refine,
)

UP = (0.0, -1.0)
IMAGE = Box(0, 0, 99, 99)


def _normal_cdf(x: float, sigma: float) -> float:
    return 0.5 * (1 + math.erf(x / (sigma * math.sqrt(2))))


def test_dog_of_a_flat_picture_is_zero_everywhere() -> None:
    flat = np.full((40, 50), 137.0, np.float32)
    assert np.abs(difference_of_gaussians(flat, (1.0, 1.6), "unit")).max() < 1e-3


@pytest.mark.parametrize(
    ("sigma", "tolerance"),
    [((1.0, 1.6), 0.06), ((2.0, 3.5), 0.02)],  # σ = 1 px is coarse on a pixel grid
)
def test_dog_of_a_step_is_the_difference_of_two_normal_distributions(
    sigma: tuple[float, float], tolerance: float
) -> None:
    step = np.zeros((60, 80), np.float32)
    step[:, 40:] = 200.0
    found = difference_of_gaussians(step, sigma, "unit")[30]
    edge = 39.5  # the step lies between columns 39 and 40
    wanted = [
        200 * (_normal_cdf(x - edge, sigma[1]) - _normal_cdf(x - edge, sigma[0])) for x in range(80)
    ]
    assert np.abs(found - wanted).max() < tolerance * max(wanted)


def test_features_lead_out_of_the_light_as_the_printed_kernel_does() -> None:
    """Its prefactor does not normalise, but it decides the sign."""
    narrow, wide = 1.0, 1.6
    y, x = np.mgrid[-8:9, -8:9].astype(np.float64)
    square = x * x + y * y
    printed = (
        np.exp(-square / (2 * narrow**2)) / narrow - np.exp(-square / (2 * wide**2)) / wide
    ) / math.sqrt(2 * math.pi)
    y, x = np.mgrid[-44:45, -44:45].astype(np.float32)
    ball = np.where(np.hypot(x, y) < 20, 220, 0).astype(np.float32)
    edges = np.asarray(cv2.filter2D(ball, cv2.CV_32F, printed), np.float32)
    everywhere = np.ones_like(ball)
    for gx, gy in (
        gradient(edges),
        feature_vectors(ball, (narrow, wide), "unit", 40.0, everywhere),
    ):
        outward = (gx * x + gy * y) / np.maximum(np.hypot(x, y), 1)
        strongest = np.abs(outward) > 0.8 * np.abs(outward).max()
        assert outward[strongest].min() > 0
        assert outward.sum() > 0


def test_sobel_multiplies_the_slope_of_a_plane_by_eight() -> None:
    y, x = np.mgrid[:30, :40].astype(np.float32)
    gx, gy = gradient(3 * x - 2 * y)
    assert np.allclose(gx[1:-1, 1:-1], 24) and np.allclose(gy[1:-1, 1:-1], -16)


@pytest.mark.parametrize(("n", "middle"), [(1.0, 0.5), (5.0, 1 / 32), (0.0, 1.0)])
def test_kappa_runs_from_bottom_to_top(n: float, middle: float) -> None:
    k = kappa((101, 7), Box(0, 0, 6, 100), UP, n)
    assert k[0].tolist() == [1.0] * 7
    assert k[50, 3] == pytest.approx(middle)
    assert k[100, 0] == (1.0 if n == 0 else 0.0)


def test_kappa_over_a_flame_box_is_clipped_outside_it() -> None:
    k = kappa((101, 5), Box(0, 40, 4, 80), UP, 1.0)
    assert k[20, 0] == 1.0 and k[90, 0] == 0.0 and k[60, 0] == pytest.approx(0.5)


def test_kappa_follows_a_sideways_lift() -> None:
    k = kappa((20, 101), Box(0, 0, 100, 19), (-1.0, 0.0), 1.0)
    assert k[3, 0] == 1.0 and k[3, 100] == 0.0 and k[3, 25] == pytest.approx(0.75)


def test_weak_gradients_are_no_features() -> None:
    soft = np.tile(np.linspace(0, 20, 100, dtype=np.float32), (100, 1))
    fx, fy = feature_vectors(soft, (1.0, 1.6), "unit", 40.0, kappa((100, 100), IMAGE, UP, 5))
    assert not fx.any() and not fy.any()


def test_refined_vectors_on_a_plane_are_those_of_equation_3() -> None:
    fx, fy = np.full((4, 4), 3.0, np.float32), np.full((4, 4), 4.0, np.float32)
    rx, ry = refine(fx, fy, UP, beta=0.02)
    assert np.allclose(rx, 3.0) and np.allclose(ry, 4.0 - 5.0 * 0.02)


def test_clamp_drops_short_vectors_and_keeps_long_ones() -> None:
    fx = np.array([[1.9, 2.5]], np.float32)
    rx, _ = refine(fx, np.zeros_like(fx), UP, beta=0.0, clamp=2.0)
    assert rx.tolist() == [[0.0, 2.5]]
