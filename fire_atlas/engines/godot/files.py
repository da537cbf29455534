"""Which files the export writes for a recipe, known before a build starts."""

from collections.abc import Iterator

from fire_atlas.engines.godot.names import (
    FILM_SCENE,
    FLAKE_PLAYER,
    FLAKE_TABLES,
    FLAKE_TRACKS,
    FRAMES_ENDING,
    HAZE_FRAMES,
    HAZE_PLAYER,
    HAZE_SCENE,
    HAZE_SHADER,
    HEAT_PLAYER,
    HEAT_SHADER,
    IMPORT_ENDING,
    LAMP,
    MOTION_MATERIAL,
    MOTION_PLAYER,
    MOTION_SCENE,
    MOTION_SHADER,
    PARTICLES_SCENE,
    PHASES,
    SCENE_ENDING,
    SPACE_PLAYER,
    SPACE_SCENE,
    SPACE_TABLES,
    SPRITE_ENDING,
    START,
    UID_ENDING,
    WIND,
)
from fire_atlas.formats.output_names import OutputNames
from fire_atlas.recipe.models import Recipe


def godot_files(
    recipe: Recipe, stems: list[str], others: list[OutputNames]
) -> Iterator[OutputNames]:
    """Yield the files that the export writes for a recipe.

    Args:
        recipe: The recipe.
        stems: The file stem of each scale.
        others: The files of the recipe that belong to no engine.
    """
    for file in others:
        is_table = file.role == "tracks" and file.ending.endswith(".csv")
        if is_table or file.role in {"page", "map", "ramp"}:
            yield file.beside(IMPORT_ENDING)
    for stem in stems:
        yield OutputNames(stem, FRAMES_ENDING, "scene", is_certain=recipe.has_fire)
        yield OutputNames(stem, SCENE_ENDING, "scene", is_certain=recipe.has_fire)
        if recipe.may_have_sprites:
            yield OutputNames(stem, SPRITE_ENDING, "scene", "animation")
        for ending in _scenes(recipe):
            yield OutputNames(stem, ending, "scene")
    for ending in _tables(recipe):
        yield OutputNames(recipe.name, ending, "scene")
    if recipe.may_have_flakes:
        yield OutputNames(recipe.name, PARTICLES_SCENE, "scene", "animation")
    for ending in _scripts(recipe):
        script = OutputNames(recipe.name, ending, "script")
        yield script
        yield script.beside(UID_ENDING)


def _scenes(recipe: Recipe) -> Iterator[str]:
    """Yield what follows the stem of each scale in the names of further scenes, and their parts."""
    if recipe.may_have_flakes and recipe.atlas.pixels == "color":
        yield FILM_SCENE
    if recipe.maps.haze:
        yield from (HAZE_SCENE, HAZE_FRAMES)
    if recipe.maps.motion == "godot":
        yield from (MOTION_SCENE, MOTION_MATERIAL)


def _tables(recipe: Recipe) -> Iterator[str]:
    """Yield what follows the build's name in the names of what plays its flakes."""
    if recipe.may_have_flakes:
        yield from (FLAKE_TABLES, SPACE_TABLES, SPACE_SCENE)


def _scripts(recipe: Recipe) -> Iterator[str]:
    """Yield what follows the build's name in the names of scripts and shaders."""
    if recipe.may_have_flakes:
        yield from (FLAKE_PLAYER, FLAKE_TRACKS, SPACE_PLAYER)
    if recipe.atlas.pixels != "color":
        yield from (HEAT_SHADER, HEAT_PLAYER)
    if recipe.maps.haze:
        yield from (HAZE_SHADER, HAZE_PLAYER)
    if recipe.maps.motion == "godot":
        yield from (MOTION_SHADER, MOTION_PLAYER)
    if "light" in recipe.tracks:
        yield LAMP
    if recipe.wind.levels:
        yield WIND
    elif recipe.phases != "none":
        yield PHASES
    else:
        yield START
