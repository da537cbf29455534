"""What a scene needs to fly the flakes of the tracks: their tables, scripts and shader."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.composition.cover import DENSE, SKY_LUMINANCE, THIN
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.engines.godot.flakes import FlakeArrays, flake_arrays
from fire_atlas.engines.godot.names import (
    FLAKE_PLAYER,
    FLAKE_TABLES,
    FLAKE_TRACKS,
    titles,
    uid_of,
)
from fire_atlas.engines.godot.resources import rendered_text, resource, script, script_reference
from fire_atlas.engines.godot.sprite_frames import pivots
from fire_atlas.formats.product import Product

_THINNER = """\
	float thin = dot(colour, vec3(0.2126, 0.7152, 0.0722)) / {sky};
	thin = max(covered * covered, min(covered, thin));
	covered = mix(thin, covered, smoothstep({thin}, {dense}, covered));"""
"""Lines of a shader that lessen what light ``covered`` hides; see ``cover_of_light``."""


def flake_player(product: Product, arrays: FlakeArrays) -> Iterator[OutputFile]:
    """Yield the tables of the flakes that the scene plays, and the scripts that fly them."""
    flakes = played_flakes(product)
    yield flake_tables(product, FLAKE_TABLES, arrays, flakes)
    textured, has_sets = bool(arrays.cells), has_several_sets(flakes)
    for ending in (FLAKE_TRACKS, FLAKE_PLAYER):
        yield from script(product, ending, textured=textured, has_sets=has_sets)


def played_arrays(product: Product) -> FlakeArrays | None:
    """Return the tables of the flakes that the scene plays; None if there are none."""
    flakes, sheet = played_flakes(product), product.sheets[0]
    names = [cell.name for cell in played_cells(product, sheet)]
    return flake_arrays(flakes, pivots(sheet), names, sheet.states) if flakes else None


def played_flakes(product: Product) -> dict[str, tuple[Tracks, ...]]:
    """Return the flakes that the scene plays, all sets of each animation: those that the pages do
    not show, or else all."""
    not_baked = [name for name in product.tracks if name not in product.baked]
    return {name: product.all_tracks(name) for name in not_baked or product.tracks}


def has_several_sets(flakes: Mapping[str, Sequence[Tracks]]) -> bool:
    """Return whether an animation has more than one set of flakes."""
    return any(len(sets) > 1 for sets in flakes.values())


def played_cells(product: Product, sheet: AtlasSheet) -> tuple[Region, ...]:
    """Return the cells of textures that the scene draws flakes with: those of one page."""
    one_page = len({cell.page for cell in sheet.cells}) == 1
    return sheet.cells if one_page and product.tracks else ()


def _cells_of(product: Product, sheet: AtlasSheet) -> list[dict[str, Any]]:
    """Return what a shader needs of the cells: place on the page, and whether each is a mask."""
    textures = [flown.texture for flown in product.tracks.values() if flown.texture is not None]
    masks = {name for texture in textures if texture.tinted for name in texture.frames}
    return [
        {"place": (cell.x, cell.y, cell.width, cell.height), "tinted": cell.name in masks}
        for cell in played_cells(product, sheet)
    ]


def flake_shader(
    template: str, product: Product, sheet: AtlasSheet, *,
    adds_up: bool, particles: bool = False,
) -> str:  # fmt: skip
    """Return a shader that a scene holds.

    ``adds_up``: whether it adds up the light of flame and flakes, to be shown as film does;
    ``particles``: whether it draws particles of the engine, which show no cells of textures.
    """
    return rendered_text(
        f"{template}.gdshader",
        alpha=sheet.alpha,
        thins=sheet.thins,
        thinner=_THINNER.format(sky=SKY_LUMINANCE[sheet.blend_space], thin=THIN, dense=DENSE),
        blend_space=sheet.blend_space,
        film=adds_up,
        particles=particles,
        cells=() if particles else _cells_of(product, sheet),
    )


def flake_tables(
    product: Product,
    ending: str,
    arrays: FlakeArrays,
    flakes: Mapping[str, Sequence[Tracks]],
) -> OutputFile:
    """Return the resource with ``flakes``, of which ``arrays`` are made."""
    named = titles(animation.name for animation in product.sheets[0].animations)
    return resource(
        "flakes.tres",
        f"{product.name}{ending}",
        product,
        script=script_reference(product, FLAKE_TRACKS),
        animations=[named[animation] for animation, sets in flakes.items() for _ in sets],
        flakes=arrays,
    )


def tables_reference(product: Product) -> tuple[str, str]:
    """Return the name and the uid of the resource with the flakes."""
    name = product.name + FLAKE_TABLES
    return name, uid_of(product, name)


def why_texture_is_not_played(product: Product) -> str | None:
    """Return advice if flakes have a texture, but the scene draws them without."""
    sheet = product.sheets[0]
    if not sheet.cells or played_cells(product, sheet):
        return None
    return (
        "flakes.texture: the scene draws flakes as soft streaks: the textures of its recipes are "
        "on several pages; raise atlas.max_size, or bake the flakes"
    )
