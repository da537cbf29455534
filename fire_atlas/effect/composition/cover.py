"""How much of what is behind it a picture of fire hides, where clients may add its light.

A flame hides little of what is behind it: it adds its light. A page that covers as much as it
shines darkens a bright background wherever the flame is thin: brown rings around embers, a veil on
wisps. One that covers nothing turns the whole flame white by day. Premultiplied pages state light
and cover apart. Light that needs the coverage F to be shown by itself, as no page is brighter than
its coverage, covers F² there: next to nothing where it is thin, all where it is dense and white.
Over black nothing changes.
"""

import numpy as np

from fire_atlas.core.picture import Picture, as_light, brightest_shown, where_covered
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.composition.smoke import Smoke

_ROUNDING = np.float32(1.5 / 255)
"""Difference of coverage and light that is that of their bytes."""

_MIN_CLEAR = np.float32(1e-6)
"""Minimum share of what is behind, not hidden, that is divided by."""


def hidden_by_smoke(flame: Picture, blend_space: str) -> Plane:
    """Return what smoke hides, (H, W) 0..1, in a picture (H, W, 4) whose coverage is its own."""
    hidden, covered = np.zeros(flame.shape[:2], np.float32), where_covered(flame)
    if flame[covered].size:
        pixels = as_light(np.ascontiguousarray(flame[covered]))
        hidden[covered] = Smoke.of(pixels, blend_space).coverage
    return hidden


def hidden_by_coverage(flame: Picture) -> Plane:
    """Return what a picture (H, W, 4) hides that covers more than its light needs, (H, W) 0..1: of
    fire on black, the things in it."""
    hidden, covered = np.zeros(flame.shape[:2], np.float32), where_covered(flame)
    if flame[covered].size:
        pixels = as_light(np.ascontiguousarray(flame[covered]))
        needed, coverage = np.minimum(brightest_shown(pixels), 1), np.clip(pixels[..., 3], 0, 1)
        more = (coverage - needed) / np.maximum(1 - needed, _MIN_CLEAR)
        hidden[covered] = np.where(coverage - needed > _ROUNDING, np.clip(more, 0, 1), 0)
    return hidden


def thin_cover(picture: Picture, hidden: Plane) -> Plane:
    """Return how much of what is behind it a picture (H, W, 4) of light covers, (H, W) 0..1.

    Args:
        picture: The flame with its flakes.
        hidden: (H, W) 0..1, how much of what is behind it things hide, however much light there
            is: smoke, wood.
    """
    coverage = np.clip(as_light(picture)[..., 3], hidden, 1)
    light = (coverage - hidden) / np.maximum(1 - hidden, _MIN_CLEAR)
    return as_plane(1 - (1 - hidden) * (1 - light * light))
