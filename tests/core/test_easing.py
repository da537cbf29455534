import numpy as np

from fire_atlas.core.easing import saturated


def test_what_saturates_is_as_exact_near_0_as_far_from_it() -> None:
    amount = np.logspace(-7, 2, 200).astype(np.float32)
    exact = -np.expm1(-amount.astype(np.float64))
    assert saturated(amount).dtype == np.float32
    assert np.allclose(saturated(amount), exact, rtol=1e-6, atol=0)
    assert saturated(np.zeros(1)) == 0
