"""Export to Godot 4; here are the parts that every engine has (``engines/engine.py``)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.engine import Addon, Engine
from fire_atlas.engines.godot.files import godot_files
from fire_atlas.engines.godot.names import single_stems, titles
from fire_atlas.formats.output_names import OutputNames
from fire_atlas.formats.problems import upright_only
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Export
from fire_atlas.recipe.problem import Problem

if TYPE_CHECKING:
    from fire_atlas.formats.product import Product


class _Godot(Engine):
    def files(
        self, recipe: Recipe, export: Export, stems: list[str], others: list[OutputNames]
    ) -> Iterator[OutputNames]:
        """Yield the files that the export writes for a recipe."""
        return godot_files(recipe, stems, others)

    def problems(self, recipe: Recipe) -> Iterator[Problem]:
        """Yield a problem if frames may be rotated."""
        return upright_only(recipe.atlas, recipe.exports, "godot")

    def refuse_names(
        self, build: str, animations: Sequence[str], frames: Sequence[str], singles: Sequence[str]
    ) -> None:
        """Refuse animations of one name in the editor, and single sprites of one file."""
        titles(animations)
        single_stems(build, singles)

    def export(self, product: "Product", export: Export) -> Iterator[OutputFile]:
        """Yield sprite frames, scenes, scripts and import settings."""
        from fire_atlas.engines.godot.export import export_godot

        return export_godot(product)

    def advice(self, product: "Product") -> Iterator[str]:
        """Yield advice for each part of a build that the scenes leave out."""
        from fire_atlas.engines.godot.advice import what_is_not_shown

        return what_is_not_shown(product)

    def moved(self, out: Path, files: Sequence[str], export: Export) -> Mapping[str, str]:
        """Return nothing: Godot's scenes refer to pages by their paths too."""
        return {}

    def addon(self, project: Path, manifest_name: Callable[[str], str]) -> Addon:
        """Return the add-on for a Godot project."""
        from fire_atlas.engines.godot.addon import (
            ADDON_NAME,
            addon_files,
            addon_folder,
            require_project,
        )

        require_project(project)
        folder = addon_folder(project)
        enable = "enable Fire Atlas in the editor, in Project > Project Settings > Plugins"
        return Addon(ADDON_NAME, "Godot 4", folder, {folder: list(addon_files())}, enable)


ENGINE = _Godot()
