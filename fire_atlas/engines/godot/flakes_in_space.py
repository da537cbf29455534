"""Scenes of the flakes of a fire with depth, in three dimensions."""

from collections.abc import Iterator

from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.flake_player import flake_tables, has_several_sets
from fire_atlas.engines.godot.flakes import flake_arrays_in_space
from fire_atlas.engines.godot.names import (
    SPACE_PLAYER,
    SPACE_SCENE,
    SPACE_TABLES,
    node_name,
    stems_of_variants,
    titles,
    uid_of,
)
from fire_atlas.engines.godot.resources import rendered_text, resource, script, script_reference
from fire_atlas.formats.product import Product


def flakes_in_space(product: Product) -> Iterator[OutputFile]:
    """Yield a scene of the flakes of a fire with depth, in three dimensions, and its parts.

    All views have the same flakes: it has those that the front sees.
    """
    flakes = {
        name: product.all_tracks(name)
        for name, tracks in product.tracks.items()
        if tracks.camera is not None and tracks.camera.azimuth == 0
    }
    if not flakes:
        return
    named, (first, *_) = (
        titles(animation.name for animation in product.sheets[0].animations),
        flakes,
    )
    tables = product.name + SPACE_TABLES
    arrays = flake_arrays_in_space(flakes, product.sheets[0].states)
    yield flake_tables(product, SPACE_TABLES, arrays, flakes)
    variants = stems_of_variants(product.sheets[0])
    has_sets = has_several_sets(flakes)
    yield from script(product, SPACE_PLAYER, has_variants=bool(variants), has_sets=has_sets)
    yield resource(
        "flakes_3d.tscn", product.name + SPACE_SCENE, product,
        node=node_name(product.name),
        player=script_reference(product, SPACE_PLAYER),
        tables=(tables, uid_of(product, tables)),
        shader=rendered_text("flakes_3d.gdshader"),
        fps=product.tracks[first].fps,
        first=named[first],
        variants=variants,
    )  # fmt: skip
