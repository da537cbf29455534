"""Make the preview of an atlas: a page that plays it, or a picture."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, TypeAlias

from PIL import ImageColor

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.output_names import flakes_file
from fire_atlas.formats.tracks.tracks_json import read_all_tracks, read_tracks
from fire_atlas.preview.budget import Budget
from fire_atlas.preview.field_data import FieldData
from fire_atlas.preview.field_marks import FieldMarks
from fire_atlas.preview.graph import in_playing_order
from fire_atlas.preview.page import is_preview_page, preview_page
from fire_atlas.preview.pictures import Color, animated_image, contact_sheet, is_preview_picture
from fire_atlas.preview.singles import with_singles_played

PreviewKind: TypeAlias = Literal["page", "gif", "webp", "apng", "sheet"]
"""An HTML page that plays the atlas, an animated picture, or a contact sheet."""


def as_played(atlas: AtlasFile, kind: PreviewKind) -> AtlasFile:
    """Return an atlas as a preview of a kind plays it: with its single sprites one after the other,
    and in a picture with its phases in order."""
    played = with_singles_played(atlas)
    return played if kind == "page" else in_playing_order(played)


def preview_of(
    atlas: AtlasFile,
    kind: PreviewKind,
    background: Color | None,
    clip: Clip | None = None,
    field: Mapping[str, FieldMarks] | None = None,
    budget: Budget | None = None,
) -> bytes:
    """Return the preview of an atlas.

    Args:
        atlas: The atlas, as ``as_played`` returns it.
        kind: What to make.
        background: Colour behind the fire, sRGB 0..255, as from ``color_of``; None leaves an
            animated picture transparent.
        clip: For a contact sheet: the clip of its source, if that is known.
        field: For a page: marks of the analysis, by animation.
        budget: For a page: what a budget was spent on.
    """
    if kind != "page" and kind != "sheet":
        return animated_image(atlas, kind, background)
    assert background is not None
    match kind:
        case "page":
            tracks, marks = read_all_tracks(atlas), FieldData(field or {})
            return preview_page(atlas, tracks, background, marks, budget)
        case "sheet":
            flakes = read_tracks(atlas.path.with_name(flakes_file(atlas.path.stem, "json")))
            return contact_sheet(atlas, flakes, clip, background)


def is_preview(path: Path, kind: PreviewKind) -> bool:
    """Return whether a file is an earlier preview of that kind, which may be replaced."""
    return is_preview_page(path) if kind == "page" else is_preview_picture(path)


TRANSPARENT = "transparent"
"""The word of CSS for no background."""


def color_of(text: str, kind: PreviewKind, what: str) -> Color | None:
    """Return a colour of CSS as sRGB 0..255; None for ``transparent``. ``what`` states it, for
    messages.

    Raises:
        RecipeError: It is none, or a preview of that kind cannot be transparent.
    """
    if text == TRANSPARENT:
        if kind in ("page", "sheet"):
            raise RecipeError(
                f"{what} {text}: is for animated pictures (gif, webp, apng); name a colour"
            )
        return None
    try:
        return ImageColor.getrgb(text)[:3]
    except ValueError:
        raise RecipeError(
            f'{what} {text}: must be a colour like "#101014" or midnightblue'
        ) from None
