"""Export to Unity 2021.3 and later; here are the parts that every engine has
(``engines/engine.py``)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.engine import Addon, Engine
from fire_atlas.engines.unity.files import unity_files
from fire_atlas.engines.unity.names import file_stems, sprite_names, state_names
from fire_atlas.formats.output_names import OutputNames
from fire_atlas.formats.problems import upright_only
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Export, UnityExport, UnityOptions, exports_called
from fire_atlas.recipe.problem import Problem

if TYPE_CHECKING:
    from fire_atlas.formats.product import Product


class _Unity(Engine):
    def files(
        self, recipe: Recipe, export: Export, stems: list[str], others: list[OutputNames]
    ) -> Iterator[OutputNames]:
        """Yield the files that the export writes for a recipe."""
        return unity_files(recipe, _options(export), stems, others)

    def problems(self, recipe: Recipe) -> Iterator[Problem]:
        """Yield a problem for each Unity export whose pages Unity cannot show or import."""
        yield from upright_only(recipe.atlas, recipe.exports, "unity")
        if recipe.atlas.format == "webp":
            for path, _ in exports_called(recipe.exports, "unity"):
                yield Problem(path, "unity does not import atlas.format webp; set it to png")

    def refuse_names(
        self, build: str, animations: Sequence[str], frames: Sequence[str], singles: Sequence[str]
    ) -> None:
        """Refuse sprites, states or files of one name."""
        sprite_names([*frames, *singles])
        state_names(animations)
        file_stems(build, animations)

    def export(self, product: "Product", export: Export) -> Iterator[OutputFile]:
        """Yield assets with their ``.meta``."""
        from fire_atlas.engines.unity.export import export_unity

        return export_unity(product, _options(export))

    def advice(self, product: "Product") -> Iterator[str]:
        """Yield advice if flakes have a texture."""
        if product.sheets[0].cells:
            yield (
                "flakes.texture: Unity's player draws flakes as soft streaks, not with the "
                "texture; the pages have its cells as sprites, and flakes.bake: true draws flakes "
                "into frames"
            )

    def moved(self, out: Path, files: Sequence[str], export: Export) -> Mapping[str, str]:
        """Return where files lie now whose GUIDs are below ``out``."""
        from fire_atlas.engines.unity.places import moved_files

        return moved_files(out, files, _options(export).namespace)

    def addon(self, project: Path, manifest_name: Callable[[str], str]) -> Addon:
        """Return the package for a Unity project."""
        from fire_atlas.engines.unity.package import PACKAGE_NAME, package_files, package_folder

        package = package_folder(project)
        files = package_files(manifest_name(PACKAGE_NAME))
        return Addon(
            PACKAGE_NAME,
            "Unity",
            package,
            {package / folder: inside for folder, inside in files.items()},
            "open the project in Unity 2021.3 or later; select a recipe in the Project window, "
            "then Assets > Fire Atlas > Build Selected Recipes",
        )


ENGINE = _Unity()


def _options(export: Export) -> UnityOptions:
    return export.unity if isinstance(export, UnityExport) else UnityOptions()
