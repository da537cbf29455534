"""Animate several fires of one recipe: variants, of which no two show the same drawing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import StateGraph, variant_title
from fire_atlas.core.chance import RandomStream, seed_of
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.progress import WithNotes
from fire_atlas.pipeline.animation.contribution import Contribution, FinishedAnimation
from fire_atlas.pipeline.input.open import Opened, open_input
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import FramesSource


@dataclass(frozen=True, slots=True)
class Variant:
    """One of the fires of a recipe.

    Attributes:
        number: Its number, from 0 on.
        recipe: The recipe with the variant's own seed.
        opened: Its source: made with that seed, or a cut of its own of a clip.
        context: Of the build; its notes say of which variant they are.
    """

    number: int
    recipe: Recipe
    opened: Opened
    context: BuildContext


def variants_of(loaded: LoadedRecipe, opened: Opened, context: BuildContext) -> Iterator[Variant]:
    """Yield the variants of a recipe, whose source is ``opened``; each is opened when its turn
    comes.

    The first has the recipe's own seed: it is the fire of a recipe without variants, if that is
    generated.

    Raises:
        RecipeError: A clip is too short for so many.
    """
    recipe = loaded.recipe
    said, shown, cuts = set[str](), list[NDArray[np.float32]](), list[Opened]()
    if isinstance(recipe.source, FramesSource) and isinstance(opened, Mapping):
        ((name, clip),) = opened.items()
        cuts = [{name: cut} for cut in _cut(clip, recipe.variants, context)]
    for number in range(recipe.variants):
        seed = seed_of(recipe.seed, RandomStream.VARIANTS, number)
        own = recipe.model_copy(update={"seed": seed})
        if cuts:
            opened = cuts[number]
        elif number:
            # What is noted of the source of the first holds for all.
            unnoted = WithNotes(context.progress, lambda _: None)
            opened = open_input(replace(loaded, recipe=own), replace(context, progress=unnoted))
        if not cuts:
            _require_apart(opened, shown, variant_title(number), context)
        yield Variant(number, own, opened, _telling_more(number, said, context))


def _telling_more(variant: int, said: set[str], context: BuildContext) -> BuildContext:
    """Return the context of a variant, of which is noted what was not ``said`` of those before."""

    def tell(message: str) -> None:
        if message not in said:
            said.add(message)
            context.progress.note(f"{variant_title(variant)}: {message}")

    return replace(context, progress=WithNotes(context.progress, tell))


def _cut(clip: Clip, variants: int, context: BuildContext) -> list[Clip]:
    from fire_atlas.timeline.variants import cut_apart

    with context.timer.measure("study"):
        return cut_apart(clip, variants, context.workers)


def _require_apart(
    opened: Opened, shown: list[NDArray[np.float32]], stem: str, context: BuildContext
) -> None:
    """Refuse a generated variant that shows a drawing of those before, whose small copies are
    ``shown``; add its own. One view or wind tells: the others are of the same fire."""
    from fire_atlas.timeline.variants import require_apart, small_copies

    first = opened.loops[0] if isinstance(opened, FireInWind) else None
    if isinstance(opened, Mapping):
        first = next(iter(opened.values()))
    assert first is not None, "sprites have no variants"
    with context.timer.measure("study"):
        copies = small_copies(first, context.workers)
        require_apart(shown, copies, stem)
    shown.append(copies)


def as_first(variant: Recipe, first: Recipe) -> Recipe:
    """Return the recipe of a variant with all that the class of the first one's fire decided, so
    that all shed alike."""
    decided = {"flakes": first.flakes, "composite": first.composite}
    return variant.model_copy(update=decided)


def joined(variants: Sequence[Contribution], recipe: Recipe) -> Contribution:
    """Return what the variants of a recipe contribute together."""
    animations, others = dict[str, FinishedAnimation](), dict[str, dict[str, Any]]()
    for number, variant in enumerate(variants):
        for name, animation in variant.animations.items():
            title = variant_title(number, "" if name == recipe.name else name)
            animations[title] = replace(animation, variant=number)
        if len(variant.animations) > 1:
            for key, figures in variant.statistics.items():
                if key != "animations":
                    others.setdefault(key, {})[variant_title(number)] = figures
    of_animations = {title: each.all_statistics() for title, each in animations.items()}
    states = [
        variant.states.as_variant(number)
        for number, variant in enumerate(variants)
        if variant.states is not None
    ]
    return replace(
        variants[0],
        animations=animations,
        statistics={"animations": of_animations, **others},
        states=StateGraph.joined(states) if states else None,
    )


def require_loops(variants: Sequence[Contribution], recipe: Recipe) -> None:
    """Refuse cuts of a clip of which one was found to play once.

    Raises:
        RecipeError: One does; its message has its number.
    """
    if not isinstance(recipe.source, FramesSource) or recipe.phases != "none":
        return
    for number, variant in enumerate(variants):
        if not all(animation.loop for animation in variant.animations.values()):
            raise RecipeError(
                f"cut {number} of the clip does not loop, and variants burn on; set timeline.loop: "
                f"crossfade, or remove variants",
                key=("variants",),
            )
