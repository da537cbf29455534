"""What image files cannot hold, and what has to be installed to write them."""

from collections.abc import Iterator
from importlib.util import find_spec

from fire_atlas.recipe.output import Atlas
from fire_atlas.recipe.problem import Problem

_WEBP_SIDE = 16383
"""Largest side of a WebP, px: its header has 14 bits for it."""


def page_limits(atlas: Atlas) -> Iterator[Problem]:
    """Yield what the files of such pages cannot hold."""
    if atlas.format == "webp" and atlas.max_size > _WEBP_SIDE:
        yield Problem(
            ("atlas", "max_size"),
            f"a WebP has at most {_WEBP_SIDE} px a side; got {atlas.max_size}",
        )


def missing_extra(atlas: Atlas) -> str | None:
    """Return what has to be installed before such pages can be written, and how; None if all is
    there."""
    if (atlas.format, atlas.compression) != ("png", "small") or find_spec("oxipng"):
        return None
    return (
        "atlas.compression: small needs oxipng for PNG pages: pip install 'fire-atlas[small]', or "
        "set atlas.compression to fast, or atlas.format to webp"
    )
