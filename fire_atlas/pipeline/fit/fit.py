"""Fit an animation into a budget: of heights and frames, those that come closest to the whole.

A ladder of heights is tried; then, three times, those between the best one and its neighbours. At
each, choices of frames are tried from the smallest error up. Memory is that of the pages on which
they are packed. All this is done for each choice among the compressed textures that the recipe
lists. The order and the end of the trials depend on nothing but the frames.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.pipeline.animation.contribution import Contribution, FinishedAnimation
from fire_atlas.pipeline.fit.budget_search import FitSearch, Offer, Shared
from fire_atlas.pipeline.fit.packed import PackedChoices, least_bytes
from fire_atlas.pipeline.fit.scaled import ScaledFrames
from fire_atlas.recipe.fit import Fit
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas

_MIB = 1 << 20

_ROUNDS = 3
"""How often heights are tried beside the best."""

_CURVE = (1 / 4, 1 / 2, 1, 2, 4)
"""The budgets for which the curve says what they would give, as shares of the recipe's."""


def fit(
    contribution: Contribution, recipe: Recipe, budget: Fit, context: BuildContext
) -> tuple[Contribution, Atlas]:
    """Return a recipe's animations with the frames and in the height that its budget is best spent
    on, and the settings of their pages; a note and the statistics say which.

    Raises:
        RecipeError: Nothing fits, or its animations differ in length.
    """
    limit = None if budget.memory is None else int(budget.memory * _MIB)
    limits = [None] if limit is None else [int(limit * share) for share in _CURVE]
    with context.timer.measure("fit"):
        searches = searches_of(contribution.animations, recipe, budget, context)
        for search in searches:
            for _ in range(_ROUNDS):
                search.add_neighbours([search.best(other) for other in limits])
        found, curve = closest(searches, limit), [closest(searches, other) for other in limits]
        if found is None:
            raise RecipeError(searches[-1].why_nothing_fits(limit), key=("fit",))
    search, best = found
    context.progress.note(search.sentence(best))
    animations = search.left(best.height, best.kept)
    fitted = replace(
        contribution,
        animations=animations,
        statistics={
            **_statistics(contribution.statistics, animations),
            "fit": {
                **_entry(best),
                "of": {"frames": search.count, "height": search.full_height},
                **({} if limit is None else {"curve": list(_points(limits, curve))}),
            },
        },
    )
    return fitted, search.atlas_for(best.kept)


def _entry(trial: Offer) -> dict[str, Any]:
    return {
        "frames": len(trial.kept),
        "height": trial.height,
        "memory": trial.memory,
        "error": round(trial.error, 6),
        **({"blocks": trial.blocks} if trial.blocks else {}),
    }


def _points(
    limits: Sequence[int | None], curve: Sequence[tuple[FitSearch, Offer] | None]
) -> Iterator[dict[str, Any]]:
    for limit, found in zip(limits, curve, strict=True):
        if found is not None:
            yield {"budget": limit, **_entry(found[1])}


def _statistics(
    whole: Mapping[str, Any], animations: Mapping[str, FinishedAnimation]
) -> dict[str, Any]:
    """Return the figures of a recipe's animations with the number and the size of their frames."""

    def fitted(figures: Mapping[str, Any], animation: FinishedAnimation) -> dict[str, Any]:
        first = animation.frames[0]
        size = {"frames": len(animation.frames), "frame_size": [first.width, first.height]}
        return {**figures, **size}

    if "animations" not in whole:
        (animation,) = animations.values()
        return fitted(whole, animation)
    of_each = {name: fitted(whole["animations"][name], each) for name, each in animations.items()}
    return {**whole, "animations": of_each}


def searches_of(
    animations: Mapping[str, FinishedAnimation],
    recipe: Recipe,
    budget: Fit,
    context: BuildContext,
) -> list[FitSearch]:
    """Return a search for each choice among the textures of a recipe, the one that takes most
    memory first.

    Raises:
        RecipeError: The animations differ in length.
    """
    choices = recipe.texture_choices
    atlases = [recipe.atlas.model_copy(update={"gpu": formats}) for formats in choices]
    shared = Shared(ScaledFrames(animations, recipe.atlas, budget, context), PackedChoices())
    return [
        FitSearch(
            animations, recipe.model_copy(update={"atlas": atlas}), budget, context, shared,
            is_chosen=len(choices) > 1,
        )
        for atlas in sorted(atlases, key=least_bytes, reverse=True)
    ]  # fmt: skip


def closest(searches: Sequence[FitSearch], limit: int | None) -> tuple[FitSearch, Offer] | None:
    """Return the search and its trial that are closest to the whole within ``limit`` bytes, of
    equals the first; None if no search has any."""
    found = [(search, search.best(limit)) for search in searches]
    trials = [(search, trial) for search, trial in found if trial is not None]
    return min(trials, key=lambda of: of[1].error, default=None)
