"""Limits of file formats and of the clients that read them, checked before a build starts.

Imports nothing heavy, because ``check`` must be quick.
"""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec

from fire_atlas.recipe.output import (
    Atlas,
    Export,
    ExportName,
    MovieName,
    export_name,
    exports_called,
)
from fire_atlas.recipe.problem import Problem

_MAX_WEBP_SIDE = 16383
"""Maximum side of a WebP, px: its header stores it in 14 bits."""


def page_limits(atlas: Atlas) -> Iterator[Problem]:
    """Yield a problem for each setting that the image files of pages cannot hold."""
    if atlas.format == "png" and atlas.quality != "lossless":
        yield Problem(
            ("atlas", "quality"),
            f"PNG is always lossless; set atlas.format to webp for quality {atlas.quality}, or "
            f"leave it out (compression: small makes PNGs smaller)",
        )
    if atlas.format == "webp" and atlas.max_size > _MAX_WEBP_SIDE:
        yield Problem(
            ("atlas", "max_size"),
            f"a WebP has at most {_MAX_WEBP_SIDE} px a side; got {atlas.max_size}",
        )


def movie_limits(movies: Sequence[MovieName], atlas: Atlas) -> Iterator[Problem]:
    """Yield a problem for each movie whose file would have the name of another one."""
    for i, movie in enumerate(movies):
        if movie in movies[:i]:
            yield Problem(("movies", i), f"{movie} is listed twice; once is enough")
        if movie == atlas.format:
            yield Problem(
                ("movies", i),
                f"the page has the name that this movie needs, with the ending .{movie}; set "
                f"atlas.format to png, or use apng here",
            )


def missing_extra(atlas: Atlas, movies: Sequence[MovieName]) -> str | None:
    """Return an error message if a package that pages or movies need is not installed, else
    None."""
    if (atlas.format, atlas.compression) == ("png", "small") and not find_spec("oxipng"):
        return (
            "atlas.compression: small needs oxipng for PNG pages: pip install "
            "'fire-atlas[small]', or set atlas.compression to fast, or atlas.format to webp"
        )
    videos = [movie for movie in movies if movie in ("webm", "mp4")]
    if videos and not find_spec("av"):
        return (
            f"movies: {' and '.join(videos)} need PyAV: pip install 'fire-atlas[video]', or use "
            f"webp, apng or gif"
        )
    return None


def description_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield a problem for each export whose clients cannot show such pages correctly."""
    yield from upright_only(atlas, exports, "phaser", "aseprite", "css", "tpsheet")
    if (atlas.alpha, atlas.blend_space) == ("straight", "srgb"):
        return
    for path, _ in exports_called(exports, "css"):
        yield Problem(
            path,
            f"css cannot be combined with atlas.alpha {atlas.alpha} and blend_space "
            f"{atlas.blend_space}: browsers blend images with straight alpha in sRGB",
        )


def upright_only(atlas: Atlas, exports: Sequence[Export], *names: ExportName) -> Iterator[Problem]:
    """Yield a problem for each export in ``names`` if frames may be rotated on their page."""
    if not atlas.rotate:
        return
    for path, export in exports_called(exports, *names):
        yield Problem(
            path,
            f"{export_name(export)} cannot be combined with atlas.rotate: its clients show frames "
            f"as they lie on the page; set atlas.rotate to false",
        )
