"""What became of a build."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fire_atlas.outputs.manifest import manifest_name, read_manifest
from fire_atlas.recipe.tree import RecipeTree


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a build.

    Attributes:
        files: The outputs.
        timings: Seconds by stage; of a build alone.
        statistics: Figures about the result, as in its manifest.
        fresh: Whether the outputs were up to date, so that nothing was done.
    """

    files: list[Path] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    fresh: bool = False


def fresh_outcome(tree: RecipeTree, out: Path) -> Outcome:
    """Return the outcome for a recipe whose outputs in ``out`` are up to date."""
    manifest = read_manifest(out, tree.name)
    if manifest is None:  # it was removed since it was read
        return Outcome(fresh=True)
    names = [*(entry.name for entry in manifest.outputs), manifest_name(tree.name)]
    return Outcome([out / name for name in names], {}, manifest.statistics, fresh=True)
