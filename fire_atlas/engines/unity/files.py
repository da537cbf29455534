"""Which files the export writes for a recipe, known before a build starts."""

from collections.abc import Iterator

from fire_atlas.engines.unity.names import (
    ASSEMBLY_ENDING,
    CLIP_ENDING,
    CONTROLLER_ENDING,
    MATERIAL_ENDING,
    META_ENDING,
    PREFAB_ENDING,
    SCRIPT_ENDING,
    SHADER_ENDING,
    TABLE_ENDING,
    Played,
    player_name,
)
from fire_atlas.formats.output_names import OutputNames
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import UnityOptions


def unity_files(
    recipe: Recipe, options: UnityOptions, stems: list[str], others: list[OutputNames]
) -> Iterator[OutputNames]:
    """Yield the files that the export writes for a recipe.

    Args:
        recipe: The recipe.
        options: Of the export.
        stems: The file stem of each scale.
        others: The files of the recipe that belong to no engine.
    """
    for file in others:
        is_played = file.role == "light" and options.player == "package"
        if is_played or file.role in {"page", "map", "ramp"}:
            yield file.beside(META_ENDING)
    for asset in _assets(recipe, options, stems):
        yield asset
        yield asset.beside(META_ENDING)


def _assets(recipe: Recipe, options: UnityOptions, stems: list[str]) -> Iterator[OutputNames]:
    """Yield the files that have a ``.meta`` beside them."""
    for stem in stems:
        yield OutputNames(stem, CLIP_ENDING, "engine", "animation")
        yield OutputNames(stem, CONTROLLER_ENDING, "engine", is_certain=recipe.has_fire)
        yield OutputNames(stem, PREFAB_ENDING, "engine", is_certain=recipe.has_fire)
        if recipe.maps.haze:
            yield OutputNames(f"{stem}.haze", MATERIAL_ENDING, "import")
    if recipe.maps.haze:
        yield OutputNames(f"{recipe.name}.haze", SHADER_ENDING, "engine")
    is_heat = recipe.atlas.pixels != "color"
    if not is_heat and recipe.atlas.alpha != "straight":
        yield from _material(recipe.name, options)
    if is_heat:
        yield from _player(recipe.name, "heat", options)
    if recipe.may_have_flakes and options.flakes:
        yield from _player(recipe.name, "flakes", options)
        yield OutputNames(f"{recipe.name}.flakes", TABLE_ENDING, "engine")
    if options.player == "own":
        start = player_name(recipe.name, "start")
        yield OutputNames(start, SCRIPT_ENDING, "engine", is_certain=recipe.has_fire)
    if options.assembly:
        yield OutputNames(options.namespace, ASSEMBLY_ENDING, "engine")


def _player(name: str, played: Played, options: UnityOptions) -> Iterator[OutputNames]:
    """Yield the material of what is played, and its own shader and script if it has them."""
    yield from _material(f"{name}.{played}", options)
    if options.player == "own":
        yield OutputNames(player_name(name, played), SCRIPT_ENDING, "engine")


def _material(stem: str, options: UnityOptions) -> Iterator[OutputNames]:
    yield OutputNames(stem, MATERIAL_ENDING, "import")
    if options.player == "own":
        yield OutputNames(stem, SHADER_ENDING, "engine")
