"""Equation 13 against its closed-form distribution."""

import numpy as np
import pytest

from fire_atlas.effect.flakes.flight import scatter_rotations, scattering_cosine


def _share_below(cosine: float, k: float) -> float:
    """P(cosθ <= c), by solving eq. 13 for ξ: ξ = (1 − k)(1 + c) / (2 (1 − k c))."""
    return (1 - k) * (1 + cosine) / (2 * (1 - k * cosine))


@pytest.mark.parametrize("k", [-0.9, -0.3, 0.0, 0.4, 0.9, 0.98])
def test_cosines_follow_the_closed_form_distribution(k: float) -> None:
    cos, _ = scatter_rotations(3, 17, np.arange(60000), k)
    for c in (-0.8, -0.2, 0.1, 0.6, 0.95):
        found = np.mean(cos <= c)
        assert found == pytest.approx(_share_below(c, k), abs=0.01)


def test_k_one_is_no_scattering_at_all() -> None:
    cos, sin = scatter_rotations(0, 5, np.arange(100), 1.0)
    assert (cos == 1).all() and not sin.any()
    assert scattering_cosine(np.array([0.0, 0.5]), 1.0).tolist() == [1.0, 1.0]


def test_k_minus_one_turns_back() -> None:
    cos, sin = scatter_rotations(0, 5, np.arange(100), -1.0)
    assert np.allclose(cos, -1) and np.allclose(sin, 0)


def test_both_turns_are_equally_likely() -> None:
    cos, sin = scatter_rotations(1, 2, np.arange(50000), 0.5)
    assert np.mean(sin > 0) == pytest.approx(0.5, abs=0.01)
    assert np.allclose(cos**2 + sin**2, 1)


def test_a_flakes_jitter_does_not_depend_on_which_others_are_alive() -> None:
    together = scatter_rotations(9, 4, np.array([3, 70, 800]), 0.7)
    alone = scatter_rotations(9, 4, np.array([70]), 0.7)
    assert [part[0] for part in alone] == [part[1] for part in together]
