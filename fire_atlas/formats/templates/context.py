"""Describe an atlas to templates in plain text, numbers and lists; lengths in px, y down."""

from typing import Any

from fire_atlas.atlas.sheet import Animation, AtlasSheet, Region
from fire_atlas.core.decimals import plain
from fire_atlas.core.version import __version__
from fire_atlas.formats.atlas.entries import states_entry
from fire_atlas.maps.motion import strengths
from fire_atlas.maps.vectors.encoding import motion_encoding


def context_of(sheet: AtlasSheet) -> dict[str, Any]:
    """Return the context of a sheet; ``fire-atlas inspect --context`` prints it.

    name, title: File stem of the outputs, with and without a scale such as ``@0.5x``.
    scale: Size of the pages, 1 at full size.
    fps: Frames per second; 0 without an animation.
    alpha, blend_space: As in the recipe.
    version: Version of fire-atlas.
    pages: Each with ``file``, ``width``, ``height``, ``safe_mip``, its ``maps`` (their files by
        kind) and its ``frames``, single sprites and those of textures of flakes among them.
    frames: All frames in playing order, then single sprites, which no animation plays, and the
        cells of textures of flakes; see ``_frame``.
    animations: Each with ``name``, ``loop``, ``duration`` (ms) and its ``frames``.
    grid: None without a grid, or ``columns``, ``rows``, ``cell_width``, ``cell_height``.
    motion: None, or how motion vectors are decoded; see ``_motion``.
    states: None, or which animation may follow which, as ``meta.states`` of the JSON.
    """
    frames = {region.name: _frame(sheet, i, region) for i, region in enumerate(sheet.placed)}
    grid = sheet.grid
    return {
        "name": sheet.name,
        "title": sheet.title,
        "scale": plain(sheet.scale, 4),
        "fps": plain(sheet.fps, 6),
        "alpha": sheet.alpha,
        "blend_space": sheet.blend_space,
        "version": __version__,
        "pages": [_page(sheet, i, frames) for i in range(len(sheet.pages))],
        "frames": list(frames.values()),
        "animations": [_animation(animation, frames) for animation in sheet.animations],
        "grid": grid and {
            "columns": grid.columns, "rows": grid.rows,
            "cell_width": grid.cell_width, "cell_height": grid.cell_height,
        },
        "motion": _motion(sheet),
        "states": sheet.states and states_entry(sheet.states),
    }  # fmt: skip


def _motion(sheet: AtlasSheet) -> dict[str, Any] | None:
    """Return how motion vectors are decoded, as ``meta.maps`` of the JSON; None without them.

    ``pixels``, ``cell_uv``, ``cell_uv_per_second``: the motion [x, y] that a decoded 1 means.
    """
    motion = sheet.motion
    if motion is None:
        return None
    encoding, strength = motion_encoding(motion.engine), strengths(motion, sheet.fps)
    return {
        "engine": encoding.engine,
        "green": encoding.green,
        "neutral": encoding.neutral,
        "decode": encoding.decode,
        "this": encoding.this,
        "next": encoding.following,
        "unit": encoding.unit,
        "scale": plain(motion.scale, 9),
        "pixels": strength["pixels"],
        "cell_uv": strength["cellUv"],
        "cell_uv_per_second": strength["cellUvPerSecond"],
        "reach": [plain(length, 3) for length in motion.longest],
        "gutter": motion.gutter and list(motion.gutter),
    }


def _frame(sheet: AtlasSheet, index: int, region: Region) -> dict[str, Any]:
    """Return a frame: ``x``, ``y``, ``width``, ``height`` is the box of its trimmed pixels.

    The size is upright; on the page a ``rotated`` frame is turned 90° clockwise.
    ``trim_x``, ``trim_y`` is the top-left corner of these pixels in the untrimmed frame, whose size
    is ``source_width`` × ``source_height``; ``anchor_x``, ``anchor_y`` the pivot in 0..1 of that.
    ``duration`` is 0 of a single sprite. ``border`` is None, or [left, top, right, bottom] of a
    nine-patch, px. ``mesh`` is None, or the ``vertices`` [x, y] of what is drawn, px of the trimmed
    pixels, and its ``triangles`` of three indices.
    """
    mesh = region.mesh
    return {
        "name": region.name,
        "index": index,
        "page": region.page,
        "file": sheet.pages[region.page].file,
        "x": region.x,
        "y": region.y,
        "width": region.width,
        "height": region.height,
        "rotated": region.rotated,
        "trimmed": region.trimmed,
        "trim_x": region.trim_x,
        "trim_y": region.trim_y,
        "source_width": region.frame_width,
        "source_height": region.frame_height,
        "anchor_x": plain(region.anchor[0], 6),
        "anchor_y": plain(region.anchor[1], 6),
        "duration": plain(region.duration, 3),
        "border": region.border and list(region.border),
        "mesh": mesh and {
            "vertices": [list(vertex) for vertex in mesh.vertices],
            "triangles": [list(triangle) for triangle in mesh.triangles],
        },
    }  # fmt: skip


def _page(sheet: AtlasSheet, index: int, frames: dict[str, Any]) -> dict[str, Any]:
    page = sheet.pages[index]
    return {
        "index": index,
        "file": page.file,
        "width": page.width,
        "height": page.height,
        "safe_mip": page.safe_mip,
        "maps": {sheet_map.kind: sheet_map.files[index] for sheet_map in sheet.maps},
        "frames": [frames[region.name] for region in sheet.regions_of(index)],
    }


def _animation(animation: Animation, frames: dict[str, Any]) -> dict[str, Any]:
    played = [frames[name] for name in animation.frames]
    return {
        "name": animation.name,
        "loop": animation.loop,
        "duration": plain(sum(frame["duration"] for frame in played), 3),
        "frames": played,
    }
