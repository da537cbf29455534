"""Random sets of animations, by the sizes of their frames."""

from collections.abc import Sequence

import numpy as np

from fire_atlas.atlas.page_rules import Size


def random_animations(seed: int) -> list[list[Size]]:
    """Return the sizes of the frames of 2 to 12 animations, alike within each of them."""
    chance = np.random.default_rng(seed)
    animations = []
    for _ in range(chance.integers(2, 13)):
        middle = chance.lognormal(4.2, 0.45, 2)
        drawn = chance.normal(middle, 0.08 * middle, (chance.integers(4, 61), 2))
        sizes = np.clip(np.rint(drawn), 8, 300).astype(int)
        animations.append([(width, height) for width, height in sizes.tolist()])
    return animations


def numbered(animations: Sequence[Sequence[object]]) -> list[range]:
    """Return the indices of each animation's frames among those of all."""
    ends = np.cumsum([len(each) for each in animations]).tolist()
    return [range(end - len(each), end) for each, end in zip(animations, ends, strict=True)]
