"""Export a build to Godot: sprite frames, scene, import settings, flakes, lamp, flipbook."""

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

from fire_atlas.atlas.sheet import DATA_MAPS, AtlasSheet, Region, VectorScale
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH, SPRITE_INTEGRAL
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.engines.godot.flakes import FlakeArrays, flake_arrays, flake_arrays_in_space
from fire_atlas.engines.godot.import_settings import KEEP, import_settings
from fire_atlas.engines.godot.lamp import TEXTURE_SIDE, lamp_of
from fire_atlas.engines.godot.meshes import SURFACE_FORMAT, surface_of
from fire_atlas.engines.godot.names import (
    FRAMES_ENDING,
    IMPORT_ENDING,
    SCENE_ENDING,
    node_name,
    number,
    quoted,
    real,
    title_in_godot,
    titles,
    uid_of,
)
from fire_atlas.engines.godot.particles import particle_settings
from fire_atlas.engines.godot.sprite_frames import FrameBounds, animations_of, pivot, textures_of
from fire_atlas.formats.names import flakes_file
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.output import GodotOptions

_PLAYER, _TRACKS, _TABLES = "_flakes.gd", "_flake_tracks.gd", "_flakes.tres"
_PLAYER_3D, _TABLES_3D, _SCENE_3D = "_flakes_3d.gd", "_flakes_3d.tres", "_flakes_3d.tscn"
_VIEW = re.compile(r"view_\d+")
"""The word for a view in the name of an animation."""

_PARTICLES = "_particles.tscn"
_LAMP, _WIND, _FLIPBOOK = "_light.gd", "_wind.gd", "_motion.gdshader"
_HAZE, _HAZE_PLAYER = "_haze.gdshader", "_haze.gd"
_HEAT, _HEAT_PLAYER = "_heat.gdshader", "_heat.gd"


def export_godot(product: Product, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield sprite frames and scene of each scale, the flakes and lamp that all scales share, and
    import settings."""
    flakes = _played_flakes(product)
    names = [cell.name for cell in _played_cells(product, product.sheets[0], options)]
    arrays = flake_arrays(flakes, _pivots(product.sheets[0]), names) if flakes else None
    for sheet in product.sheets:
        yield from _page_settings(product, sheet, options)
        yield _frames(product, sheet, options)
        yield _scene(product, sheet, flakes, options)
        if arrays and _is_summed(product, flakes, options):
            yield _summed_scene(product, sheet, arrays, options)
        yield from _flipbook(product, sheet, options)
        if _has_haze(product, options):
            yield from _haze(product, sheet, options)
    if arrays:
        yield _flake_tables(product, _TABLES, arrays, list(flakes), options)
        for ending in (_TRACKS, _PLAYER):
            yield from _script(product, ending, options, textured=bool(arrays.cells))
    if options.version == 4:
        yield from _flakes_in_space(product, options)
        yield from _particles(product, options)
    if _is_lit(product, options):
        yield from _script(product, _LAMP, options, alpha=product.sheets[0].alpha)
    if _changes_wind(product, options):
        yield from _script(product, _WIND, options)
    if any(_played_motion(sheet, options) for sheet in product.sheets):
        yield from _script(product, _FLIPBOOK, options)
    if _has_haze(product, options):
        yield from _script(product, _HAZE, options)
        yield from _script(product, _HAZE_PLAYER, options)
    yield from _heat_files(product, options)
    if "csv" in product.track_formats and options.version == 4:
        for animation in product.tracks:
            # Godot would import every CSV as translations.
            table = flakes_file(product.stem(animation), "csv")
            yield OutputFile(table + IMPORT_ENDING, "import", KEEP)


def _played_flakes(product: Product) -> dict[str, Tracks]:
    """Return the flakes that the scene plays: those that the pages do not show, or else all."""
    not_baked = {name: each for name, each in product.tracks.items() if name not in product.baked}
    return not_baked or dict(product.tracks)


def _is_summed(product: Product, flakes: dict[str, Tracks], options: GodotOptions) -> bool:
    """Return whether a scene adds up the light of flame and flakes, as film does."""
    has_colours = product.sheets[0].heat is None
    return options.version == 4 and has_colours and not product.baked.issuperset(flakes)


def _played_cells(product: Product, sheet: AtlasSheet, options: GodotOptions) -> tuple[Region, ...]:
    """Return the cells of textures that the scene draws flakes with: in Godot 4, of one page."""
    one_page = len({cell.page for cell in sheet.cells}) == 1
    return sheet.cells if one_page and options.version == 4 and product.tracks else ()


def why_texture_is_not_played(product: Product, options: GodotOptions) -> str | None:
    """Return advice if flakes have a texture, but the scene draws them without."""
    sheet = product.sheets[0]
    if not sheet.cells or _played_cells(product, sheet, options):
        return None
    reason = "only Godot 4 has a shader for it; set version: 4"
    if options.version == 4:
        reason = "the textures of its recipes are on several pages; raise atlas.max_size"
    return f"flakes.texture: the scene draws flakes as soft streaks: {reason}, or bake the flakes"


def why_meshes_are_not_drawn(product: Product, options: GodotOptions) -> str | None:
    """Return advice if frames have meshes, but the scene draws their rectangles."""
    if options.version == 4 or not product.sheets[0].has_meshes:
        return None
    return "atlas.mesh: the scene draws rectangles: only Godot 4 draws meshes right; set version: 4"


def why_haze_is_not_drawn(product: Product, options: GodotOptions) -> str | None:
    """Return advice if there is haze, but no scene that shows it."""
    if options.version == 4 or not product.sheets[0].has_map("haze"):
        return None
    return (
        f"maps.haze: no {product.name}_haze.tscn bends what is behind: only Godot 4 has a shader "
        f"for it; set version: 4"
    )


def _has_haze(product: Product, options: GodotOptions) -> bool:
    """Return whether scenes show the haze; Godot 3 has no shader for it."""
    return product.sheets[0].has_map("haze") and options.version == 4


def _cells_of(product: Product, sheet: AtlasSheet, options: GodotOptions) -> list[dict[str, Any]]:
    """Return what a shader needs of the cells: place on the page, and whether each is a mask."""
    textures = [each.texture for each in product.tracks.values() if each.texture is not None]
    masks = {name for texture in textures if texture.tinted for name in texture.frames}
    return [
        {"place": (cell.x, cell.y, cell.width, cell.height), "tinted": cell.name in masks}
        for cell in _played_cells(product, sheet, options)
    ]


def _is_lit(product: Product, options: GodotOptions) -> bool:
    """Return whether the scene has a lamp; Godot 3 has no texture for it that a scene can hold."""
    return bool(product.lights) and options.version == 4


def _changes_wind(product: Product, options: GodotOptions) -> bool:
    """Return whether the scene passes from loop to loop as the wind changes, as Godot 4 can."""
    return product.sheets[0].states is not None and options.version == 4


def _page_settings(
    product: Product, sheet: AtlasSheet, options: GodotOptions
) -> Iterator[OutputFile]:
    for file in sheet.files:
        name = file + IMPORT_ENDING
        # Motion vectors are data: they must not be changed, as premultiplied light must not.
        is_data = any(file in each.files for each in sheet.maps if each.kind in DATA_MAPS)
        alpha = "premultiplied" if is_data else sheet.alpha
        data = import_settings(product.existing(name), alpha, _image_uid(product, file), options)
        yield OutputFile(name, "import", data)


def _image_uid(product: Product, file: str) -> str:
    return uid_of(product, file, stated_in=file + IMPORT_ENDING)


def _played_motion(sheet: AtlasSheet, options: GodotOptions) -> VectorScale | None:
    """Return the motion vectors along which a shader can play a sheet: those of a grid on one page,
    of one animation; None without."""
    is_one = len(sheet.pages) == len(sheet.animations) == 1 and sheet.grid is not None
    is_one = is_one and sheet.heat is None
    is_played = is_one and sheet.motion is not None and sheet.motion.engine == "godot"
    return sheet.motion if is_played and options.version == 4 else None


def why_motion_is_not_played(product: Product, options: GodotOptions) -> str | None:
    """Return advice if there are motion vectors for Godot, but no scene that plays along them."""
    sheet = product.sheets[0]
    if sheet.motion is None or sheet.motion.engine != "godot" or _played_motion(sheet, options):
        return None
    if options.version != 4:
        reason = "only Godot 4 has a shader for them; set version: 4"
    elif sheet.heat is not None:
        reason = "it shows colours alone; set atlas.pixels: color"
    elif sheet.grid is None:
        reason = "its frames are packed, and it needs cells of one size; set atlas.layout: grid"
    elif len(sheet.animations) > 1:
        reason = f"it plays one animation of {len(sheet.animations)}; give each its own recipe"
    else:
        reason = (
            f"it plays one page of {len(sheet.pages)}; set a larger atlas.max_size or a smaller "
            "source.height"
        )
    return f"maps.motion: no {sheet.name}_motion.tscn plays along the vectors: {reason}"


def _flipbook(product: Product, sheet: AtlasSheet, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield the material that plays a sheet along its motion vectors, and a scene of a sprite."""
    motion = _played_motion(sheet, options)
    if motion is None:
        return
    (vectors,), (animation,), first = sheet.map("motion").files, sheet.animations, sheet.regions[0]
    material, count = f"{sheet.name}_motion.tres", len(sheet.regions)
    yield _resource(
        "motion.tres", material, product, options,
        sheet=sheet,
        shader=_script_reference(product, _FLIPBOOK),
        vectors=(vectors, _image_uid(product, vectors)),
        scale=motion.scale,
    )  # fmt: skip
    last, seconds = count if animation.loop else count - 1, first.duration / 1000
    x, y = pivot(first)
    yield _resource(
        "motion.tscn", f"{sheet.name}_motion.tscn", product, options,
        node=node_name(product.name),
        sheet=sheet,
        page=(sheet.pages[0].file, _image_uid(product, sheet.pages[0].file)),
        material=(material, uid_of(product, material)),
        animation=animation,
        title=title_in_godot(animation.name),
        length=count * seconds,
        last=(last * seconds, last),
        offset=(first.trim_x - first.x - x, first.trim_y - first.y - y),
        pixel_art=product.pixel_art,
    )  # fmt: skip


def _haze(product: Product, sheet: AtlasSheet, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield a scene of the fire before its haze, and the frames of the haze."""
    haze, scene = sheet.map("haze"), sheet.name + SCENE_ENDING
    assert haze.vectors is not None
    frames = _haze_frames(product, sheet, options)
    yield frames
    yield _resource(
        "haze.tscn", f"{sheet.name}_haze.tscn", product, options,
        node=node_name(product.name),
        scene=(scene, uid_of(product, scene)),
        frames=(frames.name, uid_of(product, frames.name)),
        shader=_script_reference(product, _HAZE),
        script=_script_reference(product, _HAZE_PLAYER),
        scale=haze.vectors.scale,
        first=next(iter(titles(animation.name for animation in sheet.animations).values())),
        bounds=FrameBounds.of(sheet.regions),
    )  # fmt: skip


def _haze_frames(product: Product, sheet: AtlasSheet, options: GodotOptions) -> OutputFile:
    """Return the sprite frames of the haze. Meshes fit the flame, so it is drawn in rectangles."""
    textures, texture_of_frame = textures_of(sheet, draws_meshes=False)
    return _resource(
        "frames.tres", f"{sheet.name}_haze.tres", product, options,
        pages=[(file, _image_uid(product, file)) for file in sheet.map("haze").files],
        textures=[(texture, None) for texture in textures],
        animations=animations_of(sheet, texture_of_frame, options),
    )  # fmt: skip


def _frames(product: Product, sheet: AtlasSheet, options: GodotOptions) -> OutputFile:
    name = sheet.name + FRAMES_ENDING
    pages = [(page.file, _image_uid(product, page.file)) for page in sheet.pages]
    draws_meshes = options.version == 4 and sheet.heat is None
    textures, texture_of_frame = textures_of(sheet, draws_meshes=draws_meshes)
    bounds = FrameBounds.of(sheet.regions)
    surfaces = [
        surface_of(each, each.mesh, sheet.pages[each.page], bounds) if each.mesh else None
        for each in textures
    ]
    return _resource(
        "frames.tres", name, product, options,
        pages=pages,
        textures=list(zip(textures, surfaces, strict=True)),
        surface_format=SURFACE_FORMAT,
        animations=animations_of(sheet, texture_of_frame, options),
    )  # fmt: skip


def _scene(
    product: Product, sheet: AtlasSheet, flakes: dict[str, Tracks], options: GodotOptions
) -> OutputFile:
    return _resource(
        "scene.tscn",
        sheet.name + SCENE_ENDING,
        product,
        options,
        **_played(product, sheet, options),
        glows=bool(product.tracks or product.lights),
        tables=_tables_reference(product) if flakes else None,
        hidden=product.baked.issuperset(flakes),
        lamp=_lamp(product, sheet) if _is_lit(product, options) else None,
        smoke=_smoke(product, sheet, options),
        heat=_heat(product, sheet),
        lamp_script=_script_reference(product, _LAMP),
        texture=TEXTURE_SIDE,
        views=_views(product, sheet) if options.version == 4 else (),
        shader=_shader("flakes", product, sheet, options, adds_up=False),
    )


def _smoke(product: Product, sheet: AtlasSheet, options: GodotOptions) -> dict[str, Any] | None:
    """Return what the template of a scene needs of the smoke under the fire; None if the scene
    shows none."""
    files = [file for each in sheet.maps if each.kind == "smoke" for file in each.files]
    if len(files) != 1 or options.version != 4 or sheet.heat is not None:
        return None
    unshaded = bool(product.tracks or product.lights)
    shader = _text(
        "smoke.gdshader", alpha=sheet.alpha, pixel_art=product.pixel_art, unshaded=unshaded
    )
    return {"image": (files[0], _image_uid(product, files[0])), "shader": shader}


def why_smoke_is_not_shown(product: Product, options: GodotOptions) -> str | None:
    """Return advice if there is smoke, but the scene shows the fire without it."""
    sheet = product.sheets[0]
    if not any(each.kind == "smoke" for each in sheet.maps) or _smoke(product, sheet, options):
        return None
    reason = "only Godot 4 has a shader for it; set version: 4"
    if sheet.heat is not None:
        reason = "the shader of heat has no smoke; set atlas.pixels: color"
    elif options.version == 4:
        reason = f"its shader has one page of {len(sheet.pages)}; raise atlas.max_size"
    return f"maps.smoke: the scene shows the fire without its smoke: {reason}"


def _heat(product: Product, sheet: AtlasSheet) -> dict[str, Any] | None:
    """Return what the template of a scene needs of pages of heat; None if they have colours."""
    if sheet.heat is None:
        return None
    return {
        "ramp": (sheet.heat.ramp, _image_uid(product, sheet.heat.ramp)),
        "shader": _script_reference(product, _HEAT),
        "script": _script_reference(product, _HEAT_PLAYER),
        "four_in_one": sheet.heat.pixels == "heat4",
    }


def _heat_files(product: Product, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield the shader and script of pages of heat, and how the ramp is imported."""
    heat = product.sheets[0].heat
    if heat is None:
        return
    unshaded = bool(product.tracks or product.lights)
    yield from _script(product, _HEAT, options, pixel_art=product.pixel_art, unshaded=unshaded)
    yield from _script(product, _HEAT_PLAYER, options)
    name, uid = heat.ramp + IMPORT_ENDING, _image_uid(product, heat.ramp)
    settings = import_settings(product.existing(name), "premultiplied", uid, options)
    yield OutputFile(name, "import", settings)


def why_heat_is_drawn_alone(product: Product, options: GodotOptions) -> str | None:
    """Return advice if pages of heat leave out what pages of colours have."""
    sheet = product.sheets[0]
    if sheet.heat is None:
        return None
    lost = ["meshes (the scene draws rectangles)"] if sheet.has_meshes else []
    if product.tracks and not product.baked.issuperset(_played_flakes(product)):
        lost.append(f"{product.name}_film.tscn")
    return f"atlas.pixels: in Godot, heat has no {' and no '.join(lost)}" if lost else None


def _views(product: Product, sheet: AtlasSheet) -> list[dict[str, Any]]:
    """Return what a node in space needs of the views of fires with depth, by animation: whose view
    it is; azimuth and elevation of its camera, degrees; and where the middle of the fire on the
    ground is seen, px of this scale from the pivot, y down."""
    named = titles(animation.name for animation in sheet.animations)
    pivots = _pivots(product.sheets[0])
    views = []
    for name, camera in product.cameras.items():
        off = [at - by for at, by in zip(camera.origin, pivots[name], strict=True)]
        views.append({
            "title": named[name],
            "fire": title_in_godot(_fire(name)) or product.name,
            "azimuth": math.degrees(camera.azimuth),
            "elevation": math.degrees(camera.elevation),
            "foot": [length * sheet.scale for length in off],
        })  # fmt: skip
    return views


def _fire(animation: str) -> str:
    """Return the name of an animation without the word for its view; empty if it has no other."""
    return "/".join(word for word in animation.split("/") if not _VIEW.fullmatch(word))


def _summed_scene(
    product: Product, sheet: AtlasSheet, flakes: FlakeArrays, options: GodotOptions
) -> OutputFile:
    """Return the scene that adds up the light of flame and flakes and shows it as film does."""
    shaders = {
        name: _shader(template, product, sheet, options, adds_up=True)
        for name, template in (("flame", "film_flame"), ("flakes", "flakes"), ("film", "film"))
    }
    return _resource(
        "film.tscn",
        f"{sheet.name}_film.tscn",
        product,
        options,
        **_played(product, sheet, options),
        tables=_tables_reference(product),
        film=FrameBounds.of(sheet.regions).enlarged(flakes.bounds, sheet.scale),
        shaders=shaders,
    )


def _played(product: Product, sheet: AtlasSheet, options: GodotOptions) -> dict[str, Any]:
    """Return what the template of any scene needs of the frames that it plays."""
    frames = sheet.name + FRAMES_ENDING
    cells = _played_cells(product, sheet, options)
    page = sheet.pages[cells[0].page].file if cells else None
    return {
        "node": node_name(product.name),
        "sheet": sheet,
        "frames": (frames, uid_of(product, frames)),
        "first": next(iter(titles(animation.name for animation in sheet.animations).values())),
        "bounds": FrameBounds.of(sheet.regions),
        "pixel_art": product.pixel_art,
        "player": _script_reference(product, _PLAYER),
        "texture_page": page and (page, _image_uid(product, page)),
        "graph": _graph(product, sheet) if _changes_wind(product, options) else None,
    }


def _graph(product: Product, sheet: AtlasSheet) -> dict[str, Any]:
    """Return what the template of a scene needs of the graph of states."""
    assert sheet.states is not None
    named = titles(animation.name for animation in sheet.animations)
    winds = [(each.wind, each.animation) for each in sheet.states.states if each.wind is not None]
    ways = sheet.states.transitions
    properties = _text(
        "wind.properties",
        levels=[wind for wind, _ in winds],
        loops=[named[animation] for _, animation in winds],
        befores=[named[way.before] for way in ways],
        leaves=[way.frame for way in ways],
        afters=[named[way.after] for way in ways],
        entries=[way.entry for way in ways],
    )
    return {"script": _script_reference(product, _WIND), "properties": properties.rstrip()}


def _tables_reference(product: Product) -> tuple[str, str]:
    """Return the name and the uid of the resource with the flakes."""
    name = f"{product.name}{_TABLES}"
    return name, uid_of(product, name)


def _shader(
    template: str, product: Product, sheet: AtlasSheet, options: GodotOptions, *,
    adds_up: bool, particles: bool = False,
) -> str:  # fmt: skip
    """Return a shader that a scene holds.

    ``adds_up``: whether it adds up the light of flame and flakes, to be shown as film does;
    ``particles``: whether it draws particles of the engine, which show no cells of textures.
    """
    return _text(
        f"{template}.gdshader",
        version=options.version,
        alpha=sheet.alpha,
        blend_space=sheet.blend_space,
        film=adds_up,
        particles=particles,
        cells=() if particles else _cells_of(product, sheet, options),
    )


def _particles(product: Product, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield a scene of particles for the flakes of each fire, of which views share one."""
    sheet, states = product.sheets[0], product.sheets[0].states
    shader = _shader("flakes", product, sheet, options, adds_up=False, particles=True)
    loops = {state.animation for state in states.states if state.wind is not None} if states else {}
    for name, tracks in product.tracks.items():
        is_front = tracks.camera is None or tracks.camera.azimuth == 0
        if not is_front or (states and name not in loops):
            continue
        sparks = particle_settings(tracks, _pivots(sheet)[name])
        if sparks is not None:
            stem = product.stem(_fire(name)) if _fire(name) else product.name
            yield _resource(
                "particles.tscn", f"{stem}{_PARTICLES}", product, options,
                node=f"{node_name(stem)}Sparks",
                shader=shader,
                sparks=sparks,
                levels=[[level] * 3 for level in sparks.look.brightness],
            )  # fmt: skip


def _flakes_in_space(product: Product, options: GodotOptions) -> Iterator[OutputFile]:
    """Yield a scene of the flakes of a fire with depth, in three dimensions, and its parts.

    All views have the same flakes: it has those that the front sees.
    """
    flakes = {
        name: tracks
        for name, tracks in product.tracks.items()
        if tracks.camera is not None and tracks.camera.azimuth == 0
    }
    if not flakes:
        return
    named, (first, *_) = titles(each.name for each in product.sheets[0].animations), flakes
    tables = f"{product.name}{_TABLES_3D}"
    arrays = flake_arrays_in_space(flakes)
    yield _flake_tables(product, _TABLES_3D, arrays, list(flakes), options)
    yield from _script(product, _PLAYER_3D, options)
    yield _resource(
        "flakes_3d.tscn", f"{product.name}{_SCENE_3D}", product, options,
        node=node_name(product.name),
        player=_script_reference(product, _PLAYER_3D),
        tables=(tables, uid_of(product, tables)),
        shader=_text("flakes_3d.gdshader"),
        fps=flakes[first].fps,
        first=named[first],
    )  # fmt: skip


def _flake_tables(
    product: Product,
    ending: str,
    arrays: FlakeArrays,
    animations: Sequence[str],
    options: GodotOptions,
) -> OutputFile:
    named = titles(animation.name for animation in product.sheets[0].animations)
    return _resource(
        "flakes.tres",
        f"{product.name}{ending}",
        product,
        options,
        script=_script_reference(product, _TRACKS),
        animations=[named[animation] for animation in animations],
        flakes=arrays,
    )


def _pivots(sheet: AtlasSheet) -> dict[str, tuple[float, float]]:
    regions = {region.name: region for region in sheet.regions}
    return {each.name: pivot(regions[each.frames[0]]) for each in sheet.animations}


def _lamp(product: Product, sheet: AtlasSheet) -> dict[str, Any]:
    """Return what the template of a scene needs of its lamp; lengths are in px of this scale."""
    named = titles(animation.name for animation in sheet.animations)
    lamp = lamp_of(product.lights, _pivots(product.sheets[0]), sheet.blend_space)
    return {
        "animations": [named[animation] for animation in product.lights],
        "begins": lamp.begins,
        "loops": lamp.loops,
        "energies": [row[0] for row in lamp.rows],
        "colours": [row[1:4] for row in lamp.rows],
        "places": [(row[4] * sheet.scale, row[5] * sheet.scale) for row in lamp.rows],
        "spread": lamp.spread * sheet.scale,
    }


def _script(
    product: Product, ending: str, options: GodotOptions, **context: Any
) -> Iterator[OutputFile]:
    """Yield a script or a shader, and for Godot 4.4 and later the file of its uid."""
    name, uid = _script_reference(product, ending)
    text = _text(ending.removeprefix("_"), version=options.version, **context)
    yield OutputFile(name, "script", text.encode())
    if options.version == 4:
        yield OutputFile(f"{name}.uid", "import", f"{uid}\n".encode())


def _script_reference(product: Product, ending: str) -> tuple[str, str]:
    """Return the name and the uid of a script or a shader, by which resources refer to it."""
    name = f"{product.name}{ending}"
    return name, uid_of(product, name, stated_in=f"{name}.uid")


def _resource(
    template: str, name: str, product: Product, options: GodotOptions, **context: Any
) -> OutputFile:
    """Return a scene or resource; its parts are marked by strings in Godot 4, by numbers in 3."""
    text = _text(
        template,
        version=options.version,
        uid=uid_of(product, name),
        mark=lambda i: f'"{i}"' if options.version == 4 else i,
        **context,
    )
    return OutputFile(name, "scene", text.encode())


def _text(template: str, **context: Any) -> str:
    """Return a rendered template; all know how embers are drawn, as several draw them."""
    embers = {
        "halo_light": HALO_LIGHT,
        "halo_width": HALO_WIDTH,
        "flake_integral": 4 * SPRITE_INTEGRAL,
    }
    return rendered(f"godot/{template}.j2", (number, real, quoted), **embers, **context)
