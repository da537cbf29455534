"""Plan the build of several recipes: what is built before what, and which recipes a shard takes."""

import re
from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Self, TypeAlias

from fire_atlas.core.errors import FireAtlasError, OutputError, RecipeError
from fire_atlas.core.files import real
from fire_atlas.core.output_file import is_named_after
from fire_atlas.recipe.find import refuse_same_outputs
from fire_atlas.recipe.tree import RecipeTree, named_files, read_tree

FolderOf: TypeAlias = Callable[[RecipeTree], Path]
"""Gives the output folder of a recipe."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The recipes that a command builds, and what each of them waits for.

    Attributes:
        trees: The recipes, each after those whose outputs it reads, otherwise as they were given.
        before: The paths of the recipes whose outputs a recipe reads, by its own path.
    """

    trees: Sequence[RecipeTree]
    before: Mapping[Path, Sequence[Path]]

    @classmethod
    def of(cls, trees: Sequence[RecipeTree], folder_of: FolderOf) -> Self:
        """Find out which recipes read the outputs of others, known by the beginning of their names.

        A recipe reads its members' recipes, not their outputs, so it waits for no member.

        Raises:
            RecipeError: Recipes read each other's outputs.
        """
        written: dict[Path, list[RecipeTree]] = {}
        for tree in trees:
            written.setdefault(real(folder_of(tree)), []).append(tree)
        before = {tree.path: _writers(tree, written) for tree in trees}
        by_path = {tree.path: tree for tree in trees}
        try:
            order = list(TopologicalSorter(before).static_order())
        except CycleError as error:
            names = ", ".join(sorted({str(path) for path in error.args[1]}))
            raise RecipeError(
                f"{names}: each reads what the other writes, so none of them can be built first; "
                f"let one read a file that no recipe writes"
            ) from None
        return cls([by_path[path] for path in order], before)


def refuse_unbuilt(tree: RecipeTree, plan: Plan, built: Container[Path]) -> None:
    """Raise ``OutputError`` if a recipe reads what another, not ``built``, should write."""
    for other in plan.before[tree.path]:
        if other not in built:
            raise OutputError(f"{tree.path}: not built, because it reads what {other} should write")


def _writers(tree: RecipeTree, written: Mapping[Path, Sequence[RecipeTree]]) -> list[Path]:
    """Return the recipes whose outputs ``tree`` reads; ``written`` has the recipes by folder."""
    found = dict[Path, None]()
    for path in _sources(tree):
        named = [output for output in written.get(path.parent, ()) if _may_write(output.name, path)]
        for writer in (*written.get(path, ()), *named):
            found[writer.path] = None
    return [path for path in found if path != tree.path]


def _sources(tree: RecipeTree) -> list[Path]:
    """Return the files, folders and globs that a recipe and its members name as inputs."""
    with suppress(OSError, ValueError):  # not the name of a file: the build reports it
        return [path for recipe in (tree, *tree.members) for path in named_files(recipe).values()]
    return []


def _may_write(name: str, path: Path) -> bool:
    """Return whether a build ``name`` may write the file ``path``, or one that matches it."""
    literal, *wildcards = re.split(r"(?=[*?\[])", path.name, maxsplit=1)
    if wildcards:
        return name.startswith(literal) or literal.startswith(name)
    return is_named_after(name, path.name)


def shard(
    paths: Sequence[Path], overrides: Sequence[str], folder_of: FolderOf, number: int, count: int
) -> list[Path]:
    """Return every ``count``-th of the recipes, beginning with the ``number``-th (from 1).

    Recipes that read each other's outputs count as one, as other shards may be built elsewhere. All
    shards together are all recipes, whatever the machine.

    Raises:
        RecipeError: Two recipes, even of different shards, would write the same files, or recipes
            read each other's outputs.
    """
    trees = []
    for path in paths:
        with suppress(FireAtlasError):  # the shard that takes it reports it
            tree = read_tree(path, overrides)
            _ = tree.name
            trees.append(tree)
    refuse_same_outputs(trees, folder_of)
    groups = _groups(paths, Plan.of(trees, folder_of))
    return [path for group in groups[number - 1 :: count] for path in group]


def _groups(paths: Sequence[Path], plan: Plan) -> list[list[Path]]:
    """Return the recipes in groups of which none reads another's outputs, in their order."""
    groups = {path: [path] for path in paths}
    for path, others in plan.before.items():
        for other in others:
            if groups[other] is not groups[path]:
                joined = sorted(groups[path] + groups[other], key=paths.index)
                groups |= dict.fromkeys(joined, joined)
    return list({id(group): group for group in (groups[path] for path in paths)}.values())
