"""Scenes of the engine's own particles, in the manner of the flakes."""

from collections.abc import Iterator

from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.flake_player import flake_shader
from fire_atlas.engines.godot.names import PARTICLES_SCENE, node_name, without_view
from fire_atlas.engines.godot.particles import particle_settings
from fire_atlas.engines.godot.resources import resource
from fire_atlas.engines.godot.sprite_frames import pivots
from fire_atlas.formats.product import Product


def particle_scenes(product: Product) -> Iterator[OutputFile]:
    """Yield a scene of particles for the flakes of each fire, of which views share one."""
    sheet, states = product.sheets[0], product.sheets[0].states
    shader = flake_shader("flakes", product, sheet, adds_up=False, particles=True)
    loops = {state.animation for state in states.states if state.is_loop} if states else {}
    for name, tracks in product.tracks.items():
        is_front = tracks.camera is None or tracks.camera.azimuth == 0
        if not is_front or (states and name not in loops):
            continue
        sparks = particle_settings(tracks, pivots(sheet)[name])
        if sparks is not None:
            stem = product.stem(without_view(name)) if without_view(name) else product.name
            yield resource(
                "particles.tscn", stem + PARTICLES_SCENE, product,
                node=f"{node_name(stem)}Sparks",
                shader=shader,
                sparks=sparks,
                levels=[[level] * 3 for level in sparks.look.brightness],
            )  # fmt: skip
