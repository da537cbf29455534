"""Examine a recipe's inputs before a build: refuse all that it could not use, but decode no frame.

``check`` and ``--dry-run`` do no more; a build begins with it.
"""

from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.errors import RecipeError, about
from fire_atlas.core.named_sprite import refuse_equal_names
from fire_atlas.core.workers import Workers
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.engines.engine import ENGINES, engine
from fire_atlas.outputs.dependencies import inputs_of
from fire_atlas.pipeline.animation.prepare import check_length
from fire_atlas.pipeline.input.check import CheckedRecipe
from fire_atlas.pipeline.input.open import source_key
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.located import located
from fire_atlas.recipe.output import TemplateExport, export_name
from fire_atlas.recipe.phases import NEEDS_LOOP
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.source import FramesSource, SpritesSource
from fire_atlas.sources.registry import examine_source
from fire_atlas.sources.sprite_names import SpriteList
from fire_atlas.timeline.arrange import check_timeline


def examine(
    loaded: CheckedRecipe, workers: Workers, max_pixels: int = MAX_PIXELS
) -> tuple[str, ...]:
    """Refuse what a build of a recipe could not use, as far as no frame has to be decoded.

    Args:
        loaded: The recipe.
        workers: Pool of threads.
        max_pixels: Limit on the pixels of a picture.

    Returns:
        What is to be noted about the inputs, for the user.

    Raises:
        FireAtlasError: An input is missing, damaged or does not suit the recipe, with its place.
    """
    inputs_of(loaded.tree)
    notes, sprites = list[str](), list[SpriteList]()
    for part in loaded.parts:
        found, named = _examine_part(part, workers, max_pixels)
        notes += found
        sprites += named
    with located(loaded.tree):
        _refuse_names(loaded, sprites)
        for key, path in loaded.heat_ramps.items():
            _examine_ramp(key, path, max_pixels)
        for i, export in enumerate(loaded.recipe.exports):
            if isinstance(export, TemplateExport):
                from fire_atlas.formats.templates.export import check_template

                with about(("exports", i)):
                    check_template(export, loaded.templates[export.template])
    return tuple(notes)


def examine_alone(loaded: CheckedRecipe, max_pixels: int = MAX_PIXELS) -> tuple[str, ...]:
    """Examine a recipe's inputs outside of a build; see ``examine``."""
    with Workers(1) as workers:
        return examine(loaded, workers, max_pixels)


def _examine_part(
    part: LoadedRecipe, workers: Workers, max_pixels: int
) -> tuple[tuple[str, ...], list[SpriteList]]:
    """Examine the texture of flakes and the source of a recipe; return what is to be noted, and the
    sprites if it packs any."""
    flakes, recipe = part.recipe.flakes, part.recipe
    if flakes != "none" and flakes.own_texture is not None:
        from fire_atlas.sources.flake_texture import examine_cells

        ((key, path),) = part.texture_files.items()
        with located(part.tree, key):
            examine_cells(flakes.own_texture, path, max_pixels)
    with located(part.tree):
        for key, path in part.flame_ramps.items():
            _examine_ramp(key, path, max_pixels)
    with located(part.tree, source_key(part)):
        if isinstance(recipe.source, SpritesSource):
            from fire_atlas.sources.sprites import open_sprites  # no picture is decoded yet

            opened = open_sprites(part, workers, max_pixels)
            return opened.notes, [opened.names]
        found = examine_source(part, workers, max_pixels)
        if found.size is not None and found.exact:
            check_length(recipe.timeline.frames or 0, found.size, max_pixels)
        if recipe.phases != "none" and isinstance(recipe.source, FluidSource):
            from fire_atlas.generators.fluid.scene import plays_once

            if plays_once(recipe.source):
                raise RecipeError(NEEDS_LOOP, key=("phases",))
        if isinstance(recipe.source, FramesSource) and found.exact:
            check_timeline(recipe.timeline, found.count, found.fps)
            if recipe.variants > 1:
                from fire_atlas.timeline.variants import check_variants

                check_variants(found.count, found.fps, recipe.variants)
    return found.notes, []


def _refuse_names(loaded: CheckedRecipe, sprites: Sequence[SpriteList]) -> None:
    """Refuse names of sprites that the pages of a recipe, or what it exports, cannot tell apart."""
    animations = [name for part in sprites for name in part.animations]
    played = [name for part in sprites for name in part.names(part.played)]
    single = [name for part in sprites for name in part.names(part.single)]
    refuse_equal_names([*played, *single])
    for i, export in enumerate(loaded.recipe.exports):
        with about(("exports", i)):
            name = export_name(export)
            if name in ENGINES:
                engine(name).refuse_names(loaded.recipe.name, animations, played, single)
            elif name == "css":
                from fire_atlas.formats.templates.export import refuse_equal_classes

                refuse_equal_classes(animations, [*played, *single])


def _examine_ramp(key: KeyPath, path: Path, max_pixels: int) -> None:
    from fire_atlas.sources.ramp_image import examine_ramp

    with about(key):
        examine_ramp(path, max_pixels)
