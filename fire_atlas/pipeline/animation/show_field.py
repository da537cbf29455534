"""Show how fires are analysed: features, candidates, force, field and blur of every frame.

Nothing is built: the steps up to the buoyancy field run as in a build, and what a build looks at in
passing is kept.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.composition.blur import bounded
from fire_atlas.effect.field.forcing import cell_means
from fire_atlas.effect.field.record import SolvedFrame, record_field, solve_field
from fire_atlas.pipeline.animation.analyse import (
    FrameAnalyser,
    analysed_frames,
    solver_of,
)
from fire_atlas.pipeline.animation.animate import PreparedView
from fire_atlas.pipeline.animation.contribute import prepared
from fire_atlas.pipeline.input.check import CheckedRecipe
from fire_atlas.pipeline.input.open import open_input
from fire_atlas.preview.field_marks import FieldLayer, FieldMarks, MarkGrid, Marks
from fire_atlas.recipe.effect import MotionBlur
from fire_atlas.sources.sprites import Sprites


def field_marks(loaded: CheckedRecipe, context: BuildContext) -> dict[str, FieldMarks]:
    """Analyse every animation of a recipe, and return its marks by its name on the pages.

    Raises:
        RecipeError: The recipe has no effect, so there is no field.
    """
    found = {}
    for part in loaded.parts:
        opened = open_input(part, context)
        if isinstance(opened, Sprites):
            raise RecipeError(f"{part.path}: packs sprites, which have no field; preview fire")
        if not part.recipe.has_effect:
            raise RecipeError(
                f"{part.path}: has neither flakes nor motion blur, so no field is computed; "
                f"take out flakes: none or motion_blur: none"
            )
        for name, view in prepared(part, opened, len(loaded.parts), context):
            found[name] = _marks(view, context)
    return found


def _marks(view: PreparedView, context: BuildContext) -> FieldMarks:
    clip, study, recipe = view.clip, view.study, view.recipe
    analyser, solver = FrameAnalyser.of(clip, study, recipe), solver_of(clip, study, recipe)
    forces = dict[int, tuple[Plane, Plane]]()
    context.progress.stage("analyse", clip.count)

    def solved() -> Iterator[SolvedFrame]:
        forcings = (frame.forcing for frame in analysed_frames(clip, analyser, context))
        for frame in solve_field(forcings, clip, solver):
            if frame.number < clip.count:
                forces[frame.number] = solver.buoyancy(frame.field.heat, frame.forcing)
                context.progress.advance()
            yield frame

    field = record_field(solved(), clip, solver)
    grid = MarkGrid.of(clip.width, clip.height, field.cell)
    blur = recipe.motion_blur
    exposure = None
    if isinstance(blur, MotionBlur):  # of the flame, if that is blurred, else of flakes
        exposure = blur.shutter / clip.fps * (blur.exaggeration if blur.flame else 1)
    weight = cell_means(study.kappa, field.cell)

    def marks(i: int) -> Mapping[FieldLayer, Marks]:
        found: dict[FieldLayer, Marks] = {
            **_births(i, analyser, grid),
            "force": grid.means(*forces[i], field.cell),
            "field": grid.means(field.u[i], field.v[i], field.cell),
        }
        if exposure is not None:
            path = as_plane(weight * np.float32(exposure))
            moved = as_plane(field.u[i] * path), as_plane(field.v[i] * path)
            found["blur"] = grid.means(*bounded(*moved, (clip.width, clip.height)), field.cell)
        return found

    return FieldMarks.of(grid, list(context.workers.map(marks, range(clip.count))))


def _births(i: int, analyser: FrameAnalyser, grid: MarkGrid) -> dict[FieldLayer, Marks]:
    """Return the marks of where flakes are born in frame ``i``: features and candidates.

    In the tail of a clip none is born.
    """
    features, window = analyser.features(i), analyser.window
    candidates = analyser.candidates(features)
    row, column = np.divmod(candidates.places, candidates.width)
    weight = np.diff(candidates.weights, prepend=0.0)
    if i >= analyser.clip.body:
        row, column, weight = row[:0], column[:0], weight[:0]
    return {
        "features": grid.strongest(features.x, features.y, (window.left, window.top)),
        "candidates": grid.dots(column + window.left, row + window.top, weight),
    }
