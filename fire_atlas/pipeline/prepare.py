"""Prepare a clip: arrange its frames as they are played, and study what holds for all of them."""

from fire_atlas.core.clip import Clip
from fire_atlas.effect.field.buoyancy import lift_direction
from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.pipeline.classify import has_undecided_flakes
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.effect import MotionBlur
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import FramesSource
from fire_atlas.timeline.arrange import arrange


def prepare(
    recipe: Recipe, clip: Clip, is_classified: bool, context: BuildContext
) -> tuple[Clip, FlameStudy]:
    """Return ``clip`` as it is played, and its study.

    ``is_classified``: whether this clip decides the class of the fire.
    """
    clip = _arranged(clip, recipe, context)
    direction = lift_direction(recipe.buoyancy)
    # The direction in which the flame moves is measured only if flakes or blur follow it.
    is_open = is_classified and has_undecided_flakes(recipe)
    is_sampled = has_effect(recipe) and (direction is None or is_open)
    workers = context.workers
    return clip, study_flame(clip, recipe.features, direction, workers, is_sampled=is_sampled)


def has_effect(recipe: Recipe) -> bool:
    """Return whether a recipe changes frames: it adds flakes, or blurs the flame."""
    blurs_flame = isinstance(recipe.motion_blur, MotionBlur) and recipe.motion_blur.flame
    return recipe.flakes != "none" or blurs_flame


def _arranged(clip: Clip, recipe: Recipe, context: BuildContext) -> Clip:
    """Return the clip as it is played: footage is cut, retimed and looped; generated fire stays as
    it is."""
    if not isinstance(recipe.source, FramesSource):
        return clip
    flakes = recipe.flakes
    return arrange(
        clip,
        recipe.timeline,
        longest_life=0.0 if flakes == "none" else flakes.life[1],
        workers=context.workers,
        progress=context.progress,
        only_packs=flakes == "none" and recipe.motion_blur == "none",
    )
