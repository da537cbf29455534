"""Show the single sprites of an atlas where animations are shown."""

from dataclasses import replace

from fire_atlas.atlas.sheet import Animation
from fire_atlas.formats.atlas.texture_packer import AtlasFile

_TITLE = "single sprites"
_SHOWN = 500.0
"""How long each is shown, ms."""


def with_singles_played(atlas: AtlasFile) -> AtlasFile:
    """Return an atlas with a last animation that shows its single sprites one after the other; the
    same if it has none."""
    sheet = atlas.sheet
    if not sheet.singles:
        return atlas
    shown = tuple(replace(single, duration=_SHOWN) for single in sheet.singles)
    played = Animation(_TITLE, tuple(single.name for single in shown), loop=False)
    return replace(
        atlas,
        sheet=replace(
            sheet,
            fps=sheet.fps or 1000 / _SHOWN,
            regions=(*sheet.regions, *shown),
            animations=(*sheet.animations, played),
            singles=(),
        ),
    )
