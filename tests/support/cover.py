"""What light hides on premultiplied pages (``effect/composition/cover.py``)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def hidden_by_light(
    needed: ArrayLike, luminance: ArrayLike, behind: float = 0.0
) -> NDArray[np.float64]:
    """Return what light hides that needs a coverage, and has a luminance, in sRGB 0..1.

    ``behind`` is what things behind it hide already.
    """
    coverage = np.asarray(needed, np.float64)
    left = (np.asarray(luminance) / 0.88 - behind) / max(1 - behind, 1e-6)
    thin = np.maximum(coverage**2, np.minimum(coverage, left))
    dense = np.clip((coverage - 0.25) / 0.75, 0, 1)
    return np.asarray(thin + (coverage - thin) * dense**2 * (3 - 2 * dense) * (1 - behind))
