"""Build a recipe into a temporary folder, to look at the result: for ``preview``."""

from argparse import Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from fire_atlas.cli.progress import BuildView, shows_interruption
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext, BuildOptions
from fire_atlas.core.progress import StageTimer
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.folder import recover_default, temporary_folder
from fire_atlas.pipeline.animation.show_field import field_marks
from fire_atlas.pipeline.build import build
from fire_atlas.pipeline.input.check import CheckedRecipe, load_checked
from fire_atlas.pipeline.input.open import open_alone
from fire_atlas.preview.field_marks import FieldMarks
from fire_atlas.recipe.tree import RecipeTree


@dataclass(frozen=True, slots=True)
class BuiltAtlas:
    """An atlas to look at.

    Attributes:
        path: Its JSON.
        clip: For a contact sheet, the clip of its source, if there is just one and it was built
            from a recipe.
        field: Marks of the analysis, by animation, if they were asked for.
    """

    path: Path
    clip: Clip | None = None
    field: Mapping[str, FieldMarks] = field(default_factory=dict)


@contextmanager
def temporary_build(tree: RecipeTree, args: Namespace, view: BuildView) -> Iterator[BuiltAtlas]:
    """Build the recipe ``tree`` into a temporary folder, and yield its atlas."""
    recover_default(args.subject, tree.name, view.note)
    loaded, options = load_checked(tree), BuildOptions.of(args.jobs, args.max_pixels)
    with temporary_folder() as folder:
        try:
            with shows_interruption(view):
                build(loaded, folder, options, view)
                marks = _marks(loaded, options, view) if args.field else {}
        finally:
            view.close()
        clip = _clip(loaded, options) if args.kind == "sheet" else None
        yield BuiltAtlas(folder / f"{tree.name}.json", clip, marks)


def _clip(loaded: CheckedRecipe, options: BuildOptions) -> Clip | None:
    """Return the clip of a recipe's source, if there is just one."""
    opened = open_alone(loaded, options.max_pixels) if not loaded.members else None
    clips = list(opened.values()) if isinstance(opened, Mapping) else []
    return clips[0] if len(clips) == 1 else None


def _marks(loaded: CheckedRecipe, options: BuildOptions, view: BuildView) -> dict[str, FieldMarks]:
    with Workers(options.jobs) as workers:
        context = BuildContext(workers, view, StageTimer(), options.max_pixels)
        return field_marks(loaded, context)
