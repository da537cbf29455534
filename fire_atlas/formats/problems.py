"""Limits of file formats and of the clients that read them, checked before a build starts.

Imports nothing heavy, because ``check`` must be quick.
"""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec

from fire_atlas.maps.kinds import kinds_in
from fire_atlas.recipe.gpu import blocks_of, channels_of, page_channels
from fire_atlas.recipe.output import (
    Atlas,
    Export,
    ExportName,
    Maps,
    MovieName,
    export_name,
    exports_called,
)
from fire_atlas.recipe.problem import Problem


def page_limits(atlas: Atlas) -> Iterator[Problem]:
    """Yield a problem for each setting that the image files of pages cannot hold."""
    if atlas.format == "png" and atlas.quality != "lossless":
        yield Problem(
            ("atlas", "quality"),
            f"PNG is always lossless; set atlas.format to webp for quality {atlas.quality}, or "
            f"leave it out (compression: small makes PNGs smaller)",
        )
    if atlas.format == "webp" and atlas.bits == 16:
        yield Problem(
            ("atlas", "bits"),
            "a WebP has 8 bits a channel; set atlas.format to png, or leave bits out",
        )
    if atlas.max_size > atlas.largest_size:
        yield Problem(
            ("atlas", "max_size"),
            f"a WebP has at most {atlas.largest_size} px a side; got {atlas.max_size}",
        )


def gpu_limits(atlas: Atlas, maps: Maps) -> Iterator[Problem]:
    """Yield a problem for each compressed texture that has no image to show, or loses its alpha."""
    written = {page_channels(atlas.pixels), *(kind.channels for kind in kinds_in(maps))}
    for i, format_ in enumerate(atlas.gpu):
        blocks = blocks_of(format_)
        if blocks == "bc1" and (needs := _what_needs_alpha(atlas, maps)):
            yield Problem(
                ("atlas", "gpu", i),
                f"{format_} has no alpha, which {needs}: use bc7 or bc3, or alpha: additive "
                f"without smoke",
            )
        if channels_of(blocks) not in {4, *written}:
            held = "one channel" if channels_of(blocks) == 1 else "two channels, for vectors"
            colours = "bc7" if blocks.startswith("bc") else "etc2"
            yield Problem(
                ("atlas", "gpu", i),
                f"{format_} holds {held}, and this recipe writes no such image: use {colours} for "
                f"colours",
            )


def _what_needs_alpha(atlas: Atlas, maps: Maps) -> str | None:
    """Return which images have an alpha that clients read; None if none has."""
    if atlas.pixels == "heat4":
        return "heat4 needs for a frame"
    if maps.smoke:
        return "maps.smoke needs"
    return None if atlas.alpha == "additive" else f"pages with alpha {atlas.alpha} need"


def movie_limits(movies: Sequence[MovieName], atlas: Atlas) -> Iterator[Problem]:
    """Yield a problem for each movie whose file would have the name of a page."""
    for i, movie in enumerate(movies):
        if movie == atlas.format:
            yield Problem(
                ("movies", i),
                f"the page has the name that this movie needs, with the ending .{movie}; set "
                f"atlas.format to png, or use apng here",
            )


def missing_extra(atlas: Atlas, maps: Maps) -> str | None:
    """Return an error message if a package that pages or maps need is not installed, else None."""
    if maps.emission == "exr" and not find_spec("OpenEXR"):
        return "maps.emission: exr needs OpenEXR: pip install 'fire-atlas[exr]', or leave it out"
    if (atlas.format, atlas.compression) == ("png", "small") and not find_spec("oxipng"):
        return (
            "atlas.compression: small needs oxipng for PNG pages: pip install "
            "'fire-atlas[small]', or set atlas.compression to fast, or atlas.format to webp"
        )
    if atlas.gpu and not (find_spec("etcpak") and find_spec("astc_encoder")):
        return (
            "atlas.gpu needs etcpak and astc-encoder-py: pip install 'fire-atlas[gpu]', or leave "
            "atlas.gpu out"
        )
    if atlas.supercompression == "zstd" and not find_spec("zstandard"):
        return (
            "atlas.supercompression: zstd needs zstandard: pip install 'fire-atlas[gpu]', or leave "
            "atlas.supercompression out"
        )
    return None


def description_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield a problem for each export whose clients cannot show such pages correctly."""
    if atlas.pixels != "color":
        yield from _heat_limits(atlas, exports)
    yield from upright_only(atlas, exports, "phaser", "aseprite", "css", "tpsheet")
    if (atlas.alpha, atlas.blend_space) == ("straight", "srgb"):
        return
    for path, _ in exports_called(exports, "css"):
        yield Problem(
            path,
            f"css cannot be combined with atlas.alpha {atlas.alpha} and blend_space "
            f"{atlas.blend_space}: browsers blend images with straight alpha in sRGB",
        )


def _heat_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield a problem for each export whose clients look no colours up."""
    if atlas.quality != "lossless":
        yield Problem(
            ("atlas", "quality"), "heat is data, which is always lossless; leave quality out"
        )
    for path, export in exports_called(exports, "css", "tpsheet", "aseprite"):
        yield Problem(
            path,
            f"{export_name(export)} has no shader for atlas.pixels {atlas.pixels} and would show "
            f"grey; use godot, unity, json, json-array or a template, or set atlas.pixels to color",
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
