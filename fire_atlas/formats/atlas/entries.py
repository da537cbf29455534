"""Write and read the entries of TexturePacker's JSON: frames, pages, animations and maps.

All variants of the format share them. The functions that read raise KeyError, TypeError or
ValueError for an entry that is invalid.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

from fire_atlas.atlas.polygon import doubled_area
from fire_atlas.atlas.sheet import (
    CHANNELS,
    AtlasSheet,
    CellGrid,
    GpuTexture,
    Heat,
    Mesh,
    Page,
    Phase,
    Region,
    SheetMap,
    State,
    StateGraph,
    StateTransition,
    stem_of_variant,
)
from fire_atlas.core.checks import MAX_MILLISECONDS, number, one_of, text, whole
from fire_atlas.core.decimals import plain
from fire_atlas.core.named_sprite import Border
from fire_atlas.core.output_file import name_below, plain_name
from fire_atlas.core.version import __version__
from fire_atlas.maps.kinds import KIND
from fire_atlas.maps.maker import maker_of, stated_map
from fire_atlas.recipe.gpu import MAX_MIPS
from fire_atlas.recipe.wind import MAX_LEVEL

_MAX_ANCHOR = 1000.0
"""Maximum distance of a pivot accepted when reading, in sizes of its frame."""

_FORMATS = {8: "RGBA8888", 16: "RGBA16161616"}
"""Names of the channels of a page, by their bits; the first is TexturePacker's."""

_HEAT = "R8"
"""Name of the only channel of a page of heat."""

APP = "fire-atlas (texturepacker format)"
"""Who wrote the file. Some readers take the format from these words."""


def compact(value: Any) -> str:
    """Return strict JSON without spaces."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def frame_entry(region: Region) -> dict[str, Any]:
    """Return the entry of a frame; its sizes are upright even if it is rotated on the page.

    Its pivot stands there twice: PixiJS and Phaser read `anchor`, older readers `pivot`.
    """
    size = {"w": region.width, "h": region.height}
    pivot = {"x": plain(region.anchor[0], 6), "y": plain(region.anchor[1], 6)}
    return {
        "frame": {"x": region.x, "y": region.y, **size},
        "rotated": region.rotated,
        "trimmed": region.trimmed,
        "spriteSourceSize": {"x": region.trim_x, "y": region.trim_y, **size},
        "sourceSize": {"w": region.frame_width, "h": region.frame_height},
        **({"duration": plain(region.duration, 3)} if region.duration else {}),
        "anchor": pivot,
        "pivot": pivot,
        **({} if region.border is None else _border_entries(region, region.border)),
        **({} if region.channel is None else {"channel": region.channel}),
        **({} if region.mesh is None else _mesh_entry(region, region.mesh)),
    }


def _border_entries(region: Region, border: Border) -> dict[str, Any]:
    """Return a border as PixiJS reads it, and the middle that it leaves as Phaser does."""
    return {
        "borders": border._asdict(),
        "scale9Borders": {
            "x": border.left,
            "y": border.top,
            "w": region.frame_width - border.left - border.right,
            "h": region.frame_height - border.top - border.bottom,
        },
    }


def _border_of(entry: dict[str, Any]) -> Border | None:
    """Read the border of a frame; None if it has none."""
    if "borders" not in entry:
        return None
    return Border(*(whole(entry["borders"][side]) for side in Border._fields))


def _mesh_entry(region: Region, mesh: Mesh) -> dict[str, Any]:
    """Return a frame's mesh: vertices in px of the untrimmed frame, and in px of the page."""
    return {
        "vertices": [[x + region.trim_x, y + region.trim_y] for x, y in mesh.vertices],
        "verticesUV": [list(region.on_page(vertex)) for vertex in mesh.vertices],
        "triangles": [list(triangle) for triangle in mesh.triangles],
    }


def _mesh_of(entry: dict[str, Any]) -> Mesh | None:
    """Read the mesh of a frame, whose vertices lie in its trimmed part; None if it has none."""
    if "vertices" not in entry:
        return None
    trim = entry["spriteSourceSize"]
    left, top = whole(trim["x"]), whole(trim["y"])
    right, bottom = left + whole(trim["w"]), top + whole(trim["h"])
    vertices = tuple(
        (whole(x, left, right) - left, whole(y, top, bottom) - top) for x, y in entry["vertices"]
    )
    last = len(vertices) - 1
    triangles = tuple(
        (whole(a, 0, last), whole(b, 0, last), whole(c, 0, last)) for a, b, c in entry["triangles"]
    )
    if len(vertices) < 3 or doubled_area(vertices) <= 0:
        raise ValueError("the vertices of a mesh are not clockwise around an area")
    return Mesh(vertices, triangles)


def region_of(name: str, page: int, entry: dict[str, Any]) -> Region:
    """Read the entry of frame ``name`` on the page with index ``page``."""
    place, trim, full = entry["frame"], entry["spriteSourceSize"], entry["sourceSize"]
    anchor = entry.get("anchor", {"x": 0.5, "y": 0.5})
    return Region(
        name=text(name),
        page=page,
        x=whole(place["x"]),
        y=whole(place["y"]),
        width=whole(place["w"]),
        height=whole(place["h"]),
        rotated=bool(entry.get("rotated")),
        trim_x=whole(trim["x"]),
        trim_y=whole(trim["y"]),
        frame_width=whole(full["w"], 1),
        frame_height=whole(full["h"], 1),
        anchor=(_anchor(anchor["x"]), _anchor(anchor["y"])),
        duration=number(entry.get("duration", 0), 0, MAX_MILLISECONDS),
        mesh=_mesh_of(entry),
        channel=one_of(entry["channel"], CHANNELS) if "channel" in entry else None,
        border=_border_of(entry),
    )


def _anchor(value: Any) -> float:
    return number(value, -_MAX_ANCHOR, _MAX_ANCHOR)


def _page_format(sheet: AtlasSheet) -> str:
    return _HEAT if sheet.heat and sheet.heat.pixels == "heat" else _FORMATS[sheet.bits]


def page_entry(sheet: AtlasSheet, page: int) -> dict[str, Any]:
    """Return the file, size and scale of a page."""
    return {
        "image": sheet.pages[page].file,
        "format": _page_format(sheet),
        "size": {"w": sheet.pages[page].width, "h": sheet.pages[page].height},
        "scale": f"{sheet.scale:g}",
    }


def meta_entry(sheet: AtlasSheet, page: int, regions: Sequence[Region]) -> dict[str, Any]:
    """Return the ``meta`` block of a page with these frames."""
    return {
        "app": APP,
        "version": __version__,
        **page_entry(sheet, page),
        "frameTags": frame_tags(sheet, regions),
        **({"maps": map_entries(sheet, page)} if sheet.maps else {}),
        **({"gpu": texture_entries(sheet, page)} if sheet.gpu else {}),
        **({"states": states_entry(sheet.states)} if sheet.states and page == 0 else {}),
        "fireAtlas": about_entry(sheet, page),
    }


def bits_of(meta: dict[str, Any]) -> int:
    """Read the bits a channel of a page from its ``meta`` block."""
    if meta.get("format") == _HEAT:
        return 8
    for bits, name in _FORMATS.items():
        if meta.get("format", name) == name:
            return bits
    raise ValueError(f"{meta['format']!r} is no format of pages")


def page_of(meta: dict[str, Any]) -> Page:
    """Read a page from its ``meta`` block."""
    size, safe_mip = meta["size"], meta.get("fireAtlas", {}).get("safeMipLevel")
    return Page(
        file=name_below(meta["image"]),
        width=whole(size["w"], 1),
        height=whole(size["h"], 1),
        safe_mip=None if safe_mip is None else whole(safe_mip, 0, 32),
    )


def about_entry(sheet: AtlasSheet, page: int) -> dict[str, Any]:
    """Return the block ``fireAtlas``, an addition to the format: blending, loops, mip levels."""
    return {
        "alpha": sheet.alpha,
        **({"cover": "auto" if sheet.thins else "full"} if sheet.alpha == "premultiplied" else {}),
        "blendSpace": sheet.blend_space,
        **({"fps": plain(sheet.fps, 6)} if sheet.animations else {}),
        "loops": {animation.name: animation.loop for animation in sheet.animations},
        **_variants_entry(sheet),
        "safeMipLevel": sheet.pages[page].safe_mip,
        **({"grid": _grid_entry(sheet.grid)} if sheet.grid else {}),
        **({"heat": _heat_entry(sheet.heat)} if sheet.heat else {}),
    }


def _variants_entry(sheet: AtlasSheet) -> dict[str, Any]:
    """Return which variant of its fire each animation is of, if there are several."""
    numbers = {each.name: each.variant for each in sheet.animations if each.variant is not None}
    return {"variants": numbers} if numbers else {}


def variant_of(about: dict[str, Any], animation: str) -> int | None:
    """Read from the block ``fireAtlas`` which variant of its fire an animation is of; None if that
    has one only."""
    numbers = about.get("variants", {})
    if animation not in numbers:
        return None
    number = whole(numbers[animation])
    stem_of_variant(animation, number)
    return number


def _heat_entry(heat: Heat) -> dict[str, Any]:
    """Return how a client gets colours from heat: ``ramp`` at (heat, row)."""
    return {"pixels": heat.pixels, "ramp": heat.ramp, "rows": list(heat.rows)}


def heat_of(about: dict[str, Any]) -> Heat | None:
    """Read how pages get their colours from the block ``fireAtlas``; None if they have them."""
    entry = about.get("heat")
    if entry is None:
        return None
    return Heat(
        one_of(entry["pixels"], ("heat", "heat4")),
        name_below(entry["ramp"]),
        tuple(text(row) for row in entry["rows"]),
    )


def _grid_entry(grid: CellGrid) -> dict[str, Any]:
    return {
        "columns": grid.columns,
        "rows": grid.rows,
        "cellWidth": grid.cell_width,
        "cellHeight": grid.cell_height,
    }


def grid_of(about: dict[str, Any]) -> CellGrid | None:
    """Read the cell grid of a page from the block ``fireAtlas``; None if there is none."""
    entry = about.get("grid")
    if entry is None:
        return None
    return CellGrid(
        columns=whole(entry["columns"], 1),
        rows=whole(entry["rows"], 1),
        cell_width=whole(entry["cellWidth"], 1),
        cell_height=whole(entry["cellHeight"], 1),
    )


def animations_on(sheet: AtlasSheet, regions: Sequence[Region]) -> dict[str, list[str]]:
    """Return the names of each animation's frames that are among ``regions``, those of one page.

    PixiJS looks up frames on their own page only and fails for other names. Clients join the parts
    of an animation that spans several pages; frame names sort in playing order:
    ``[sheet, ...sheet.linkedSheets].flatMap((page) => page.animations.campfire ?? [])`` and
    ``.sort((a, b) => (a.label < b.label ? -1 : 1))``.
    """
    here = {region.name for region in regions}
    parts = {
        animation.name: [frame for frame in animation.frames if frame in here]
        for animation in sheet.animations
    }
    return {animation: frames for animation, frames in parts.items() if frames}


def frame_tags(sheet: AtlasSheet, regions: Sequence[Region]) -> list[dict[str, Any]]:
    """Return Aseprite's tags: the indices of the first and the last frame of each animation.

    An animation whose frames are not consecutive in ``regions`` has no tag.
    """
    number = {region.name: i for i, region in enumerate(regions)}
    tags = []
    for animation in sheet.animations:
        played = [number[name] for name in animation.frames if name in number]
        if played and played == list(range(played[0], played[-1] + 1)):
            tag = {"name": animation.name, "from": played[0], "to": played[-1]}
            once = {} if animation.loop else {"repeat": "1"}
            tags.append({**tag, "direction": "forward", **once})
    return tags


def states_entry(graph: StateGraph) -> dict[str, Any]:
    """Return the graph of states: ``meta.states``, in which a game finds its way between loops."""
    return {
        "states": {state.animation: _state_entry(state) for state in graph.states},
        "transitions": [
            {
                "from": transition.before,
                "frame": transition.frame,
                "to": transition.after,
                "entry": transition.entry,
            }
            for transition in graph.transitions
        ],
    }


def _state_entry(state: State) -> dict[str, Any]:
    phase: dict[str, Any] = {} if state.phase is None else {"phase": state.phase}
    if state.variant is not None:
        phase["variant"] = state.variant
    if not state.is_loop:
        return {**phase, "next": state.following}
    wind = {} if state.wind is None else {"wind": plain(state.wind, 6)}
    return {**phase, "loop": True, **wind}


def states_of(entry: dict[str, Any], frames: Mapping[str, int]) -> StateGraph:
    """Read a graph of states; ``frames`` has the number of frames of each animation."""
    names = tuple(frames)
    states = tuple(
        _state_of(one_of(name, names), state, names) for name, state in entry["states"].items()
    )
    graph = StateGraph(states, ())
    winds = list(graph.winds)
    if not any(state.phase == "burn" for state in states) and (
        len(winds) < 2 or winds != sorted(winds)
    ):
        raise ValueError("the winds of its states are not two or more that increase")
    transitions = tuple(
        StateTransition(
            before := one_of(transition["from"], names),
            whole(transition["frame"], 0, frames[before] - 1),
            after := one_of(transition["to"], names),
            whole(transition["entry"], 0, frames[after] - 1),
        )
        for transition in entry["transitions"]
    )
    return replace(graph, transitions=transitions)


def _state_of(name: str, entry: dict[str, Any], names: Sequence[str]) -> State:
    phase = one_of(entry["phase"], get_args(Phase)) if "phase" in entry else None
    state = State(
        name, phase=phase, variant=whole(entry["variant"]) if "variant" in entry else None
    )
    if phase == "burn":
        return state
    if phase is None and "next" not in entry:
        return replace(state, wind=number(entry["wind"], 0, MAX_LEVEL))
    following = entry["next"]
    is_end = phase is not None and following is None
    return replace(state, following=None if is_end else one_of(following, names))


def map_entries(sheet: AtlasSheet, page: int) -> list[dict[str, Any]]:
    """Return the entries of the maps beside a page: ``meta.maps``."""
    return [
        {
            "kind": sheet_map.kind,
            "image": sheet_map.files[page],
            **maker_of(KIND[sheet_map.kind]).entry(sheet_map, sheet),
        }
        for sheet_map in sheet.maps
    ]


def texture_entries(sheet: AtlasSheet, page: int) -> list[dict[str, Any]]:
    """Return the entries of the compressed textures of a page and its maps: ``meta.gpu``."""
    return [
        {"file": texture.file, "image": image, "format": texture.blocks, "levels": texture.levels}
        for image in sheet.images(page)
        for texture in sheet.textures_of(image)
    ]


def textures_of(pages: Sequence[Sequence[dict[str, Any]]]) -> tuple[GpuTexture, ...]:
    """Read the compressed textures of all pages from their entries."""
    return tuple(
        GpuTexture(
            plain_name(entry["file"]),
            name_below(entry["image"]),
            text(entry["format"]),
            whole(entry["levels"], 1, MAX_MIPS),
        )
        for page in pages
        for entry in page
    )


def maps_of(pages: Sequence[Sequence[dict[str, Any]]]) -> tuple[SheetMap, ...]:
    """Read the maps beside the pages from their entries; all pages have the same kinds."""
    found = []
    for i, entry in enumerate(pages[0]):
        kind = KIND[one_of(entry["kind"], [*KIND])]
        files = tuple(name_below(page[i]["image"]) for page in pages)
        found.append(maker_of(kind).read(stated_map(kind, files), entry))
    return tuple(found)
