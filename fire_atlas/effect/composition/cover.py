"""How much of what is behind it a picture of fire hides, where clients may add its light.

A flame hides little of what is behind it: it adds its light. A page that covers as much as it
shines darkens a bright background wherever the flame is thin: brown rings around embers, a veil on
wisps. One that covers nothing turns the whole flame white by day, and its edges pale. Premultiplied
pages state light and cover apart. Light covers as much as leaves a bright sky as bright as it is,
its own luminance relative to the sky's; but never more than the coverage F that it needs to be
shown by itself, as no page is brighter than its coverage, and at least F². Fire that is not thin
hides all the more: of a dense one no sky would be left, and through one that is neither, its blue
and the fire's red were pink. Over black nothing changes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.picture import Picture, as_light, brightest_shown, where_covered
from fire_atlas.core.pixels import REC709, Plane, as_plane, light_added

SKY_LUMINANCE = {"srgb": 0.88, "linear": 0.68}
"""Luminance of a bright sky, in the encoding in which a client blends."""

THIN, DENSE = 0.25, 1.0
"""Coverage F up to which fire is thin, and from which on it hides as much as it covers."""

_ROUNDING = np.float32(1.5 / 255)
"""Difference of coverage and light that is that of their bytes."""

_MIN_CLEAR = np.float32(1e-6)
"""Minimum share of what is behind, not hidden, that is divided by."""


class FireOverSmoke(NamedTuple):
    """A fire whose smoke is a layer of its own.

    Attributes:
        whole: (H, W, 4), the flame with its smoke.
        smoke: (H, W) 0..1, coverage of the smoke.
    """

    whole: Picture
    smoke: Plane


def cover_of_light(
    coverage: NDArray[np.float32],
    shown: NDArray[np.float32],
    blend_space: str,
    behind: NDArray[np.float32] | float = 0.0,
) -> NDArray[np.float32]:
    """Return what light that needs ``coverage`` (...) hides, (...) 0..1.

    Args:
        coverage: (...) 0..1.
        shown: (..., 3), the light in the encoding in which the client blends.
        blend_space: That encoding.
        behind: (...) 0..1, what smoke and things behind it hide of the sky already.
    """
    red, green, blue = (shown[..., channel] for channel in range(3))
    luminance = red * REC709[0] + green * REC709[1] + blue * REC709[2]
    allowed = luminance / np.float32(SKY_LUMINANCE[blend_space])
    left = (allowed - behind) / np.maximum(1 - behind, _MIN_CLEAR)
    thin = np.maximum(coverage * coverage, np.minimum(left, coverage))
    dense = smooth_step((coverage - THIN) / (DENSE - THIN)) * (1 - behind)
    return as_plane(thin + (coverage - thin) * dense)


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


def thin_cover(
    picture: Picture, hidden: Plane, blend_space: str, fire: FireOverSmoke | None = None
) -> Plane:
    """Return how much of what is behind it a picture (H, W, 4) of light covers, (H, W) 0..1.

    Args:
        picture: The flame with its flakes.
        hidden: (H, W) 0..1, how much of what is behind it things hide, however much light there
            is: smoke, wood.
        blend_space: Encoding in which the client blends.
        fire: What the picture is a part of, if its smoke is apart; None: it is whole.
    """
    cover, covered = hidden.copy(), where_covered(picture)
    if not picture[covered].size:
        return cover
    pixels, hides = as_light(np.ascontiguousarray(picture[covered])), hidden[covered]
    coverage = np.clip(pixels[..., 3], hides, 1)
    needed = as_plane((coverage - hides) / np.maximum(1 - hides, _MIN_CLEAR))
    behind = hides
    if fire is not None:
        pixels = as_light(np.ascontiguousarray(fire.whole[covered]))
        behind = fire.smoke[covered]
    light = cover_of_light(needed, light_added(pixels, blend_space), blend_space, behind)
    cover[covered] = 1 - (1 - hides) * (1 - light)
    return cover
