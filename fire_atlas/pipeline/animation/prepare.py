"""Prepare a clip: arrange its frames as they are played, and study what holds for all of them."""

from dataclasses import replace

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.workload import check_workload
from fire_atlas.effect.field.buoyancy import lift_direction
from fire_atlas.effect.flame.direction import UP
from fire_atlas.effect.flame.room import without_room
from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.pipeline.animation.classify import has_undecided_flakes, may_have_squares
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import FramesSource
from fire_atlas.timeline.arrange import arrange
from fire_atlas.vision.pixel_grid import NOT_ENLARGED, find_pixel_grid


def prepare(
    recipe: Recipe, clip: Clip, is_first: bool, context: BuildContext
) -> tuple[Clip, FlameStudy]:
    """Return ``clip`` as it is played, and its study.

    ``is_first``: whether it is the first view, by which the fire is classified.
    """
    size = clip.width, clip.height
    # What is asked for is known before any frame is made.
    check_length(recipe.timeline.frames or 0, size, context.max_pixels)
    shows_art = isinstance(recipe.source, FramesSource) and may_have_squares(recipe)
    art = find_pixel_grid(clip) if shows_art else NOT_ENLARGED
    clip = _arranged(without_veil(recipe, clip, context), recipe, context)
    check_length(clip.count, size, context.max_pixels)
    direction = lift_direction(recipe.buoyancy)
    if direction is None and not isinstance(recipe.source, FramesSource):
        direction = UP  # generated fire rises, and its recipe states the wind that bends it
    # How the flame moves and looks is measured only if anything depends on it.
    is_open = is_first and has_undecided_flakes(recipe)
    is_sampled = (recipe.has_effect or recipe.needs_field) and (direction is None or is_open)
    study = study_flame(clip, recipe.features, direction, context.workers, is_sampled=is_sampled)
    return clip, replace(study, art=art)


def without_veil(recipe: Recipe, clip: Clip, context: BuildContext) -> Clip:
    """Return a clip without the veil of the room in which its fire was filmed, if it has one."""
    source = recipe.source
    if isinstance(source, FramesSource) and source.black == "auto" and clip.matte == "luminance":
        return without_room(clip, context.workers, context.progress.note)
    return clip


def check_length(frames: int, size: tuple[int, int], max_pixels: int) -> None:
    """Refuse more frames of a ``size`` (width, height), px, than a build takes on.

    Raises:
        SourceError: As ``check_workload``.
    """
    fewer = "timeline.frames, or a smaller source.height"
    check_workload(frames, size, max_pixels, fewer, key=("timeline", "frames"))


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
        seed=recipe.seed,
    )
