"""Check a recipe against the limits of the formats and engines it names, before a build starts.

A valid recipe may still exceed what a file format can hold or an engine can show. Each of them
states its limits in a module ``limits`` that imports nothing heavy; all are checked here.
"""

from collections.abc import Iterator
from itertools import chain
from typing import NewType

from fire_atlas.core.errors import OutputError
from fire_atlas.engines.engine import ENGINES, engine
from fire_atlas.formats.problems import (
    description_limits,
    gpu_limits,
    missing_extra,
    movie_limits,
    page_limits,
)
from fire_atlas.heat.problems import flame_ramp_problems, heat_problems
from fire_atlas.maps.kinds import map_problems, maps_without_source
from fire_atlas.recipe.load import LoadedRecipe, load_tree
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import exports_called
from fire_atlas.recipe.problem import Problem, dotted
from fire_atlas.recipe.source import SpritesSource
from fire_atlas.recipe.tree import MEMBERS, RecipeTree
from fire_atlas.recipe.validate import refusal

CheckedRecipe = NewType("CheckedRecipe", LoadedRecipe)
"""A valid recipe within the limits of all its outputs, made by ``load_checked`` and required by
builds."""


def load_checked(tree: RecipeTree) -> CheckedRecipe:
    """Validate a recipe that has been read, and check the limits of its outputs.

    Its members, if any, contribute only frames, so only its own ``atlas``, ``maps``, ``exports``,
    ``tracks`` and ``movies`` are checked.

    Raises:
        RecipeError: It is invalid or exceeds a limit; with file, line and key of each problem.
        OutputError: It needs an optional package that is not installed.
    """
    loaded = load_tree(tree)
    of_members = _members_with_states(loaded), _sources_of_maps(loaded), _ramps_of_members(loaded)
    problems = [*_problems(loaded.recipe), *chain.from_iterable(of_members)]
    problems += _sprites_on_pages(loaded)
    if problems:
        raise refusal(tree, problems)
    recipe = loaded.recipe
    if missing := missing_extra(recipe.atlas, recipe.maps):
        raise OutputError(missing)
    return CheckedRecipe(loaded)


def _members_with_states(loaded: LoadedRecipe) -> Iterator[Problem]:
    """Yield a problem for each recipe with ``wind.levels`` or ``phases`` among several that share
    pages: what describes these has one graph of states."""
    for i, member in enumerate(loaded.members):
        if member.recipe.wind.levels:
            yield Problem(
                (*MEMBERS, i),
                f"{member.recipe.name} has wind.levels, which need pages of their own; build it "
                f"alone, or give it one wind.level",
            )
        if member.recipe.phases != "none":
            yield Problem(
                (*MEMBERS, i),
                f"{member.recipe.name} has phases, which need pages of their own; build it alone, "
                f"or remove its phases",
            )
    if loaded.members and loaded.recipe.wind.levels:
        yield Problem(
            ("wind", "levels"), "need pages of their own; remove atlas.members, or the levels"
        )
    if loaded.members and loaded.recipe.phases != "none":
        yield Problem(("phases",), "need pages of their own; remove atlas.members, or phases")


def _sources_of_maps(loaded: LoadedRecipe) -> Iterator[Problem]:
    """Yield a problem for each map for which a recipe, or one of several that share pages, has
    nothing."""
    maps = loaded.recipe.maps
    yield from maps_without_source(maps, loaded.recipe.source)
    for i, member in enumerate(loaded.members):
        for problem in maps_without_source(maps, member.recipe.source):
            yield Problem((*MEMBERS, i), f"{'.'.join(map(str, problem.path))}: {problem.message}")


def _sprites_on_pages(loaded: LoadedRecipe) -> Iterator[Problem]:
    """Yield a problem for each thing that pages with sprites, own or of members, cannot have."""
    packed = [part for part in loaded.parts if isinstance(part.recipe.source, SpritesSource)]
    if not packed:
        return
    name, recipe = packed[0].recipe.name, loaded.recipe
    if recipe.atlas.pixels != "color":
        yield Problem(
            ("atlas", "pixels"),
            f"the sprites of {name} keep their colours, which heat has not; set it to color, or "
            f"pack them on pages of their own",
        )
    for path, _ in exports_called(recipe.exports, "aseprite"):
        yield Problem(
            path,
            f"aseprite numbers its frames, so that the names of the sprites of {name} were lost; "
            f"use json or phaser",
        )


def _ramps_of_members(loaded: LoadedRecipe) -> Iterator[Problem]:
    """Yield a problem for each member in a ramp's colours, where pages store heat."""
    for i, member in enumerate(loaded.members):
        for problem in flame_ramp_problems(member.recipe):
            yield Problem((*MEMBERS, i), f"{dotted(problem.path)}: {problem.message}")


def _problems(recipe: Recipe) -> Iterator[Problem]:
    """Yield a problem for each limit of a format or an engine that a recipe exceeds."""
    atlas, exports = recipe.atlas, recipe.exports
    has_flakes = recipe.flakes != "none" or bool(atlas.members)
    yield from page_limits(atlas)
    yield from gpu_limits(atlas, recipe.maps)
    yield from map_problems(recipe.maps, atlas, has_flakes)
    yield from heat_problems(recipe)
    yield from description_limits(atlas, exports)
    yield from movie_limits(recipe.movies, atlas)
    for name in ENGINES:
        yield from engine(name).problems(recipe)
