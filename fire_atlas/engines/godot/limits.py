"""What Godot cannot show or import, checked before any work is done."""

from collections.abc import Iterator, Sequence

from fire_atlas.formats.limits import upright_only
from fire_atlas.recipe.output import Atlas, Export, GodotExport, TrackName, exports_called
from fire_atlas.recipe.problem import Problem


def godot_limits(
    atlas: Atlas, exports: Sequence[Export], tracks: Sequence[TrackName]
) -> Iterator[Problem]:
    """Yield the exports for Godot that cannot show such pages, or that such tracks would break."""
    yield from upright_only(atlas, exports, "godot")
    for path, export in exports_called(exports, "godot"):
        if isinstance(export, GodotExport) and export.godot.version == 3:
            for message in _of_godot_3(atlas, tracks):
                yield Problem(path, message)


def _of_godot_3(atlas: Atlas, tracks: Sequence[TrackName]) -> Iterator[str]:
    """Yield messages about what version 4 can do and version 3 cannot."""
    if atlas.blend_space == "linear":
        yield (
            "Godot 3 draws its 2D in sRGB, so that pages cannot have atlas.blend_space linear; "
            "use srgb, or version 4 in a project with HDR 2D"
        )
    if atlas.pixels != "color":
        yield (
            f"only Godot 4 has a shader for atlas.pixels {atlas.pixels}; set version: 4, or "
            f"atlas.pixels to color"
        )
    if "csv" in tracks:
        yield (
            "Godot 3 takes every CSV file for translations and fails to import it; leave csv out "
            "of tracks, which the scene does not need"
        )
