"""What every game engine has: the parts that the rest of the tool asks its package for.

To add an engine: its name in ``ExportName`` of ``recipe/output.py``, a package here whose
``ENGINE`` has these parts, its templates, and its name in ``ENGINES``.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.output_names import OutputNames
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Export, ExportName
from fire_atlas.recipe.problem import Problem

if TYPE_CHECKING:
    from fire_atlas.formats.product import Product


class Engine(Protocol):
    """An engine, ``ENGINE`` of its package. ``files`` and ``problems`` import nothing heavy."""

    def files(
        self, recipe: Recipe, export: Export, stems: list[str], others: list[OutputNames]
    ) -> Iterator[OutputNames]:
        """Yield the files that an export writes for a recipe, known before a build starts.

        Args:
            recipe: The recipe.
            export: The entry of its ``exports``, with its options.
            stems: The file stem of each scale.
            others: The files of the recipe that belong to no engine.
        """

    def problems(self, recipe: Recipe) -> Iterator[Problem]:
        """Yield a problem for each setting of a recipe that the engine cannot show or import."""

    def refuse_names(
        self, build: str, animations: Sequence[str], frames: Sequence[str], singles: Sequence[str]
    ) -> None:
        """Refuse names that the engine, or its files, cannot tell apart.

        Args:
            build: Name of the build.
            animations: Names of its animations.
            frames: Names of their frames.
            singles: Names of sprites that no animation plays.

        Raises:
            OutputError: With two such names.
        """

    def export(self, product: "Product", export: Export) -> Iterator[OutputFile]:
        """Yield the files of an export."""

    def advice(self, product: "Product") -> Iterator[str]:
        """Yield what the engine's files do not show of a build, and what would let them."""

    def moved(self, out: Path, files: Sequence[str], export: Export) -> Mapping[str, str]:
        """Return where outputs lie below ``out`` that were renamed in the engine's editor, by the
        names that a build gives them.

        Raises:
            OutputError: That cannot be told.
        """

    def addon(self, project: Path, manifest_name: Callable[[str], str]) -> "Addon":
        """Return the engine's add-on for a project.

        Args:
            project: The project's folder.
            manifest_name: Returns the file name of the manifest that lists an add-on's files.

        Raises:
            OutputError: The folder is no project of the engine.
        """


@dataclass(frozen=True, slots=True)
class Addon:
    """Files for a project, from which the engine's editor builds recipes.

    Attributes:
        name: Its name, and that of its manifests.
        title: The engine, for the user.
        folder: Where it is put.
        files: By the folder they are put into.
        next_step: What the user does next.
    """

    name: str
    title: str
    folder: Path
    files: Mapping[Path, Sequence[OutputFile]]
    next_step: str


ENGINES: tuple[ExportName, ...] = ("godot", "unity")
"""Names of all engines, each that of its package here."""


def engine(name: str) -> Engine:
    """Return an engine; its package is imported now."""
    return cast("Engine", import_module(f"fire_atlas.engines.{name}").ENGINE)
