"""The scene of each scale, and the one that adds up the light of flame and flakes."""

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet, Phase, StateGraph
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.flake_player import (
    flake_shader,
    played_cells,
    played_flakes,
    tables_reference,
)
from fire_atlas.engines.godot.flakes import FlakeArrays
from fire_atlas.engines.godot.heat import heat_of
from fire_atlas.engines.godot.lamp import TEXTURE_SIDE, lamp_of
from fire_atlas.engines.godot.names import (
    FILM_SCENE,
    FLAKE_PLAYER,
    FRAMES_ENDING,
    LAMP,
    PHASES,
    SCENE_ENDING,
    START,
    WIND,
    node_name,
    stems_of_variants,
    title_in_godot,
    titles,
    uid_of,
    without_view,
)
from fire_atlas.engines.godot.resources import (
    image_uid,
    rendered_text,
    resource,
    script,
    script_reference,
)
from fire_atlas.engines.godot.smoke import smoke_of
from fire_atlas.engines.godot.sprite_frames import FrameBounds, pivots
from fire_atlas.formats.product import Product

_PHASES: Mapping[str, Phase] = {"burn": "burn", "ignition": "ignite", "extinction": "extinguish"}
"""Which phase is shown by the animation that a property of a scene's script names."""


def scene(product: Product, sheet: AtlasSheet, flakes: Collection[str]) -> OutputFile:
    """Return the scene of a scale, which plays the fire with what it has; ``flakes`` are the
    animations whose flakes it flies."""
    return resource(
        "scene.tscn",
        sheet.name + SCENE_ENDING,
        product,
        **_played(product, sheet),
        glows=bool(product.tracks or product.lights),
        tables=tables_reference(product) if flakes else None,
        hidden=product.baked.issuperset(flakes),
        lamp=_lamp(product, sheet) if product.lights else None,
        smoke=smoke_of(product, sheet),
        heat=heat_of(product, sheet),
        lamp_script=script_reference(product, LAMP),
        texture=TEXTURE_SIDE,
        views=_views(product, sheet),
        shader=flake_shader("flakes", product, sheet, adds_up=False),
    )


def summed_scene(product: Product, sheet: AtlasSheet, arrays: FlakeArrays) -> Iterator[OutputFile]:
    """Yield the scene that adds up the light of flame and flakes and shows it as film does, where
    pages of colours lack flakes."""
    if sheet.heat is not None or product.baked.issuperset(played_flakes(product)):
        return
    shaders = {
        name: flake_shader(template, product, sheet, adds_up=True)
        for name, template in (("flame", "film_flame"), ("flakes", "flakes"), ("film", "film"))
    }
    yield resource(
        "film.tscn", sheet.name + FILM_SCENE, product,
        **_played(product, sheet),
        tables=tables_reference(product),
        film=FrameBounds.of(sheet.regions).enlarged(arrays.bounds, sheet.scale),
        shaders=shaders,
    )  # fmt: skip


def scene_scripts(product: Product) -> Iterator[OutputFile]:
    """Yield the scripts of lamps, and of what plays."""
    sheet = product.sheets[0]
    if product.lights:
        yield from script(product, LAMP, alpha=sheet.alpha)
    if sheet.animations:
        has_variants = bool(stems_of_variants(sheet))
        yield from script(product, _player_of(sheet), has_variants=has_variants)


def _played(product: Product, sheet: AtlasSheet) -> dict[str, Any]:
    """Return what the template of any scene needs of the frames that it plays."""
    frames = sheet.name + FRAMES_ENDING
    cells = played_cells(product, sheet)
    page = sheet.pages[cells[0].page].file if cells else None
    return {
        "node": node_name(product.name),
        "sheet": sheet,
        "frames": (frames, uid_of(product, frames)),
        "first": next(iter(titles(animation.name for animation in sheet.animations).values())),
        "bounds": FrameBounds.of(sheet.regions),
        "pixel_art": product.pixel_art,
        "player": script_reference(product, FLAKE_PLAYER),
        "texture_page": page and (page, image_uid(product, page)),
        "script": script_reference(product, _player_of(sheet)),
        "properties": _properties(sheet),
    }


def _properties(sheet: AtlasSheet) -> str:
    """Return the properties of the script of a scene: its variants, and the graph of its states."""
    graph, variants = sheet.states or StateGraph((), ()), stems_of_variants(sheet)
    first, *_ = *graph.of_each_variant(), graph
    named = titles(animation.name for animation in sheet.animations)
    loops = [state.animation for state in first.states if state.wind is not None]
    phases = {
        name: named[main] for name, phase in _PHASES.items() for main in first.of_phase(phase)[:1]
    }
    ways = graph.transitions
    return rendered_text(
        "fire.properties",
        variants=variants,
        levels=graph.winds,
        loops=[named[loop] for loop in loops],
        phases=phases,
        befores=[named[way.before] for way in ways],
        leaves=[way.frame for way in ways],
        afters=[named[way.after] for way in ways],
        entries=[way.entry for way in ways],
    )


def _player_of(sheet: AtlasSheet) -> str:
    """Return what ends the name of the script that plays a sheet: it leads from state to state, or
    begins a loop at a moment of its own."""
    if sheet.states is None:
        return START
    return WIND if sheet.states.winds else PHASES


def _views(product: Product, sheet: AtlasSheet) -> list[dict[str, Any]]:
    """Return what a node in space needs of the views of fires with depth, by animation: whose view
    it is; azimuth and elevation of its camera, degrees; and where the middle of the fire on the
    ground is seen, px of this scale from the pivot, y down."""
    named = titles(animation.name for animation in sheet.animations)
    places = pivots(product.sheets[0])
    views = []
    for name, camera in product.cameras.items():
        off = [at - by for at, by in zip(camera.origin, places[name], strict=True)]
        views.append({
            "title": named[name],
            "fire": title_in_godot(without_view(name)) or product.name,
            "azimuth": math.degrees(camera.azimuth),
            "elevation": math.degrees(camera.elevation),
            "foot": [length * sheet.scale for length in off],
        })  # fmt: skip
    return views


def _lamp(product: Product, sheet: AtlasSheet) -> dict[str, Any]:
    """Return what the template of a scene needs of its lamp; lengths are in px of this scale."""
    named = titles(animation.name for animation in sheet.animations)
    lamp = lamp_of(product.lights, pivots(product.sheets[0]), sheet.blend_space, sheet.states)
    return {
        "animations": [named[animation] for animation in product.lights],
        "begins": lamp.begins,
        "loops": lamp.loops,
        "energies": [row[0] for row in lamp.rows],
        "colours": [row[1:4] for row in lamp.rows],
        "places": [(row[4] * sheet.scale, row[5] * sheet.scale) for row in lamp.rows],
        "spread": lamp.spread * sheet.scale,
    }
