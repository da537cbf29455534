"""The preview page: one HTML file that plays an atlas in a browser, without other files.

Its parts are in ``templates/preview``. The files of pages are embedded unchanged, so that the
browser blends the same bytes that a client loads.
"""

import base64
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from fire_atlas.atlas.sheet import Animation, Region, VectorScale, common_canvas
from fire_atlas.core.files import open_file
from fire_atlas.core.pixels import srgb_to_hex
from fire_atlas.core.shipped import shipped
from fire_atlas.core.version import __version__
from fire_atlas.effect.flakes.statistics import Figure, flake_figures
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.pages.page_file import read_page_file
from fire_atlas.formats.templates.jinja import environment
from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.preview.budget import Budget
from fire_atlas.preview.cut_frames import cells_named, colour_pages, shown_alpha, shown_page
from fire_atlas.preview.field_data import FieldData
from fire_atlas.preview.figures import page_use, range_text, safe_mip, span, value_text
from fire_atlas.preview.graph import (
    OUT,
    graph_data,
    has_phases,
    levels_of,
    nothing_of,
    vanishes,
)
from fire_atlas.preview.lamps import dark, has_light_tracks, lamps_of
from fire_atlas.preview.loops import figures_of_loops
from fire_atlas.preview.more import More, more_than
from fire_atlas.preview.pictures import Color
from fire_atlas.preview.pixel_art import is_pixel_art
from fire_atlas.preview.ramp_pictures import ramp_pictures
from fire_atlas.preview.views import choices_of, fires_together, kind_of

_SCRIPTS = (
    "film.js", "program.js", "scene.js", "flake_painter.js", "painter.js", "marks.js",
    "field_marks.js",
    "state.js", "passing.js", "graph_picture.js", "stage.js", "words.js", "controls.js", "page.js",
)  # fmt: skip

_DRAWN = ["id", "x", "y", "size", "stretch", "rotation", "tail", "r", "g", "b", "a"]
"""Columns of the tracks that the page draws, and after them the cell of a texture, or -1;
``flake_painter.js`` relies on their order."""

_FORMULAS = {
    "straight": "rgb · a + background · (1 − a)",
    "premultiplied": "rgb + background · (1 − a)",
    "additive": "rgb + background",
}

_SPACES = {"srgb": "sRGB values", "linear": "linear light"}

_BACKGROUNDS = {"Black": "#000000", "Grey": "#5b5b5b", "Day": "#8fb8de", "White": "#ffffff"}
"""Backgrounds to choose from, besides that of the command line, a scene and a checkerboard."""

_LAYERS = {"composed": "Composed", "flame": "Flame", "flakes": "Flakes"}
"""Layers to choose from: the pages, and flame or flakes alone if ``maps`` has them."""

_KEYBOARD = {
    "play or pause": ("space",),
    "step back, step on": ("←", "→"),
    "half a step back, on": (",", "."),
    "first, last frame": ("Home", "End"),
    "play, seam, page": ("1", "2", "3"),
    "zoom in, out, fit": ("+", "−", "0"),
    "slower, faster": ("[", "]"),
    "between frames: hold, blend, vectors": ("m",),
    "layers: composed, flame, flakes": ("l",),
    "all views or variants, one": ("v",),
    "next background": ("b",),
    "flakes: off, marks, light": ("f",),
    "analysis: off, features ...": ("a",),
    "seam: overlaid, difference": ("d",),
    "outline, trim and pivot": ("o",),
    "square pixels": ("p",),
    "repeat": ("r",),
    "next wind": ("w",),
    "put the fire out, light it": ("e",),
}


_GENERATOR = b'<meta name="generator" content="fire-atlas '
"""Identifies a preview page: ``templates/preview/page.html.j2`` has it near the beginning."""


def is_preview_page(path: Path) -> bool:
    """Return whether a file is a page that ``preview_page`` made, in this version or another."""
    try:
        with open_file(path) as file:
            return _GENERATOR in file.read(1024)
    except OSError:
        return False


def preview_page(
    atlas: AtlasFile,
    tracks: Mapping[str, Tracks],
    background: Color,
    field: FieldData,
    budget: Budget | None = None,
) -> bytes:
    """Return the page as HTML.

    Args:
        atlas: The atlas to play.
        tracks: Flakes of each animation that has any, by its name.
        background: The first colour in the choice of backgrounds.
        field: Marks of the analysis.
        budget: What a budget was spent on; None without one.

    Raises:
        SourceError: The file of a page or map is missing, or is not as the atlas states.
    """
    folder = shipped("templates") / "preview"
    parts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}
    first = srgb_to_hex(background)
    loops = figures_of_loops(atlas)
    ramps, has_heat = ramp_pictures(atlas), atlas.sheet.heat is not None
    fires, names = fires_together(atlas.sheet), [each.name for each in atlas.sheet.animations]
    lamps, choices = lamps_of(atlas), choices_of(atlas.sheet, fires)
    kinds = [kind_of(animation) for animation in atlas.sheet.animations]
    if vanishes(atlas.sheet):
        choices[str(len(names))] = OUT
        lamps.append(dark(lamps[0]))
        names.append(OUT)
        kinds.append("")
    of_animations = [
        {
            "field": field.of(name),
            "light": lamp,
            "together": next((fire for fire in fires if number in fire), None),
            "kind": kind,
        }
        for number, (name, lamp, kind) in enumerate(zip(names, lamps, kinds, strict=True))
    ]
    more = _more(atlas, tracks, fires, field)
    has_hard_pixels = is_pixel_art(atlas)
    atlas, files = colour_pages(atlas)
    motion, sheets = atlas.sheet.motion, _sheets(atlas, files)
    data = _data(atlas, tracks, sheets, of_animations)
    html = environment().from_string(parts["page.html.j2"]).render(
        version=__version__,
        title=atlas.sheet.name,
        style=parts["page.css"],
        script="\n".join(parts[name] for name in _SCRIPTS),
        animations=[
            _animation_text(
                animation,
                frames,
                loops.get(animation.name, []),
                tracks.get(animation.name),
            )
            for animation, frames in _played(atlas)
        ],
        choices=choices,
        field=field.choices(names),
        pages=[_page(atlas, i) for i in range(len(atlas.sheet.pages))],
        levels=levels_of(atlas.sheet),
        has_phases=has_phases(atlas.sheet),
        sheets=sheets,
        layers={layer: word for layer, word in _LAYERS.items() if layer in sheets},
        ramps=ramps,
        ramp_key=f"{'atlas' if has_heat else 'composite'}: {{ramp: ...}}",
        motion=motion,
        encoding=motion and motion_encoding(motion.engine),
        alpha=shown_alpha(atlas.sheet),
        space=_SPACES[atlas.sheet.blend_space],
        formula=_FORMULAS[shown_alpha(atlas.sheet)],
        shades={first: first, **{k: v for k, v in _BACKGROUNDS.items() if v != first}},
        budget=budget,
        keyboard=_KEYBOARD,
        more=more,
        data=_json_in_html({**data, "isPixelArt": has_hard_pixels}),
    )  # fmt: skip
    return html.encode()


def _json_in_html(value: Any) -> str:
    """Return JSON that is safe inside an HTML element: no text in it can close the element."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _played(atlas: AtlasFile) -> list[tuple[Animation, list[Region]]]:
    """Return the animations that the page plays, and their frames: those of the atlas and, if its
    fire vanishes, one that shows nothing."""
    regions = {region.name: region for region in atlas.frames}
    played = [
        (animation, [regions[name] for name in animation.frames])
        for animation in atlas.sheet.animations
    ]
    if vanishes(atlas.sheet):
        nothing = nothing_of(played[0][1][0])
        played.append((Animation(OUT, (nothing.name,), loop=False), [nothing]))
    return played


def _more(
    atlas: AtlasFile, tracks: Mapping[str, Tracks], fires: Sequence[object], field: FieldData
) -> list[More]:
    """Return what the page would show of another recipe."""
    sheet = atlas.sheet
    had = {
        "tracks": bool(tracks),
        "light": has_light_tracks(atlas),
        "ramps": bool(sheet.heat or sheet.states or len(fires or sheet.animations) > 1),
        "views": bool(fires or sheet.states),
        "wind": bool(sheet.states or fires),
        "phases": not sheet.animations[0].loop or len(sheet.animations) > 1,
        "field": bool(field.marks),
    }
    return more_than(sheet, [name for name, is_had in had.items() if is_had])


def _data(
    atlas: AtlasFile,
    tracks: Mapping[str, Tracks],
    sheets: Mapping[str, list[str]],
    of_animations: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Return the data that the script plays; ``of_animations`` has more of each animation."""
    motion = atlas.sheet.motion
    return {
        "alpha": shown_alpha(atlas.sheet),
        "blendSpace": atlas.sheet.blend_space,
        "scale": atlas.sheet.scale,
        "hasCells": atlas.sheet.grid is not None,
        "motion": motion and _vectors(motion),
        "graphs": graph_data(atlas.sheet),
        "sheets": list(sheets),
        "pages": [
            {
                "file": page.file,
                "type": f"image/{atlas.sheet.image_format}",
                "width": page.width,
                "height": page.height,
            }
            for page in atlas.sheet.pages
        ],
        "animations": [
            {
                **_animation_data(animation, frames, tracks.get(animation.name), atlas.sheet.cells),
                **more,
            }
            for (animation, frames), more in zip(_played(atlas), of_animations, strict=True)
        ],
    }


def _animation_data(
    animation: Animation, frames: list[Region], tracks: Tracks | None, cells: Sequence[Region]
) -> dict[str, Any]:
    """Return the rectangles of an animation's frames, on their pages and on the common canvas.

    ``cells`` are those of all textures of flakes.
    """
    size, places = common_canvas(frames)
    return {
        "name": animation.name,
        "loop": animation.loop,
        "variant": animation.variant,
        "size": size,
        "frames": [
            {
                "name": frame.name,
                "page": frame.page,
                "x": frame.x,
                "y": frame.y,
                "width": frame.width,
                "height": frame.height,
                "rotated": frame.rotated,
                "trim": (frame.trim_x, frame.trim_y),
                "source": (frame.frame_width, frame.frame_height),
                "stage": place,
                "pivot": (
                    frame.anchor[0] * frame.frame_width,
                    frame.anchor[1] * frame.frame_height,
                ),
                "duration": frame.duration,
            }
            for frame, place in zip(frames, places, strict=True)
        ],
        "flakes": tracks
        and {
            "rounds": tracks.rounds,
            "counts": [len(rows) for rows in tracks.frames],
            **_texture_data(tracks, cells),
        },
    }


def _texture_data(tracks: Tracks, cells: Sequence[Region]) -> dict[str, Any]:
    """Return where the cells of the texture of some flakes are, all on one page."""
    texture = tracks.texture
    shown = [] if texture is None else cells_named(texture.frames, cells)
    return {
        "tinted": texture is not None and texture.tinted,
        "page": shown[0].page if shown else 0,
        "cells": [
            {
                "x": cell.x,
                "y": cell.y,
                "width": cell.width,
                "height": cell.height,
                "rotated": cell.rotated,
            }
            for cell in shown
        ],
    }


def _animation_text(
    animation: Animation,
    frames: list[Region],
    loop: list[Figure],
    tracks: Tracks | None,
) -> dict[str, Any]:
    """Return the text about an animation, and the rows of its flakes as base64."""
    figures = {"Loop": loop, "Embers": flake_figures(tracks) if tracks else []}
    seconds = sum(frame.duration for frame in frames) / 1000
    plays = "in a loop" if animation.loop else "once"
    sizes = f"{span(f.frame_width for f in frames)} × {span(f.frame_height for f in frames)} px"
    rate = f"{len(frames) / seconds:.4g} fps" if seconds else "no time"
    text = f"{len(frames)} frames · {rate} · {seconds:.2f} s {plays} · {sizes}"
    is_empty = all(frame.width == 0 for frame in frames)
    return {
        "name": animation.name,
        "text": "nothing is drawn" if is_empty else text,
        "figures": {title: _figures(known) for title, known in figures.items() if known},
        "rows": _rows(tracks) if tracks else "",
    }


def _figures(figures: list[Figure]) -> list[dict[str, Any]]:
    return [
        {
            "name": f.name,
            "text": value_text(f),
            "wanted": range_text(f.low, f.high),
            "good": f.is_in_range,
        }
        for f in figures
    ]


def _rows(tracks: Tracks) -> str:
    """Return the drawn columns of all rows, frame after frame, as base64 of float32."""
    rows = np.concatenate(tracks.frames)[:, [COLUMNS.index(name) for name in _DRAWN]]
    cells = np.full(len(rows), -1)
    if tracks.texture is not None:
        cells = np.concatenate(tracks.texture.cells)
    rows = np.column_stack([rows, cells])
    return base64.b64encode(rows.astype("<f4").tobytes()).decode()


def _vectors(motion: VectorScale) -> dict[str, Any]:
    """Return how R and G are decoded: (byte - zero) / span, times px to the right and down."""
    encoding, (across, along) = motion_encoding(motion.engine), motion.pixels
    return {
        "zero": encoding.zero,
        "span": encoding.span,
        "pixels": (across, encoding.green_of_down * along),
    }


_SHOWN_MAPS = ("motion", "flame", "flakes")
"""Kinds of maps that the page shows."""


def _sheets(atlas: AtlasFile, composed: Sequence[bytes]) -> dict[str, list[str]]:
    """Return the files of all pages as base64, by layer: ``composed`` or the kind of a map."""
    read = {"composed": list(composed)}
    for sheet_map in atlas.sheet.maps:
        if sheet_map.kind in _SHOWN_MAPS:
            pages = zip(atlas.sheet.pages, sheet_map.files, strict=True)
            read[sheet_map.kind] = [
                read_page_file(atlas.path.parent / file, page.width, page.height)
                for page, file in pages
            ]
    if any(sheet_map.kind == "smoke" for sheet_map in atlas.sheet.maps):
        read["composed"] = [_page_over_smoke(atlas, index) for index in range(len(composed))]
    return {kind: [base64.b64encode(file).decode() for file in read[kind]] for kind in read}


def _page_over_smoke(atlas: AtlasFile, index: int) -> bytes:
    """Return a file of the page's format that shows the page over its smoke."""
    file = io.BytesIO()
    image = Image.fromarray(shown_page(atlas, index))
    image.save(file, atlas.sheet.image_format, lossless=True, exact=True)
    return file.getvalue()


def _page(atlas: AtlasFile, index: int) -> dict[str, Any]:
    """Return the text about a page of the atlas."""
    page, use = atlas.sheet.pages[index], page_use(atlas, index)
    size = (atlas.path.parent / page.file).stat().st_size
    places = f" in {use.places} places" if use.places < use.frames else ""
    stored = f"{size / 1e6:.2f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"
    return {
        "file": page.file,
        "width": page.width,
        "height": page.height,
        "text": f"{use.frames} frames{places} · {stored}",
        "covered": f"{100 * use.occupancy:.1f} %",
        "safe_mip": safe_mip(page.safe_mip),
    }
