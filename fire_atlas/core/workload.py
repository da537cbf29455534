"""How much a build takes on: the largest picture, the most frames, and both together."""

from pathlib import Path

from fire_atlas.core.errors import SourceError

MAX_PIXELS = 8192 * 8192
"""Default limit on the pixels of a picture (``--limit-pixels``); each takes about 50 bytes."""

MAX_FRAMES = 10_000
"""Limit on the number of frames; no atlas can hold more."""

_PICTURES = 256
"""Of so many pictures of the largest size the frames of a clip may have the pixels: 17 thousand
million by default, which take a few minutes to decode."""


def check_workload(
    frames: int,
    size: tuple[int, int],
    max_pixels: int,
    fewer: str,
    *,
    path: Path | None = None,
    key: tuple[str, ...] | None = None,
) -> None:
    """Refuse clips that are within the limits on size and number of frames, but not on both.

    Args:
        frames: How many of them the recipe takes.
        size: Their width and height, px.
        max_pixels: Limit on the pixels of a picture.
        fewer: Keys by which the recipe would take fewer.
        path: The file that has these frames, if one has.
        key: The key of the recipe that asks for them, if one does.

    Raises:
        SourceError: With what was found, the limit, and what would allow it.
    """
    pixels = frames * size[0] * size[1]
    if pixels > _PICTURES * max_pixels:
        of = f"{path}: " if path else ""
        raise SourceError(
            f"{of}{frames} frames of {size[0]}x{size[1]} are {pixels / 1e9:.3g} thousand "
            f"million pixels, more than {_PICTURES * max_pixels / 1e9:.3g}; use fewer ({fewer}), "
            f"or allow it: --limit-pixels {-(-pixels // _PICTURES)}",
            key=key,
        )
