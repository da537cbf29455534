"""Prepare sprites of any size as named animations, without resizing, flakes or blur."""

from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.maps.maker import AnimationParts
from fire_atlas.pipeline.animation.contribution import Contribution, FinishedAnimation, maps_of
from fire_atlas.pipeline.animation.layers import flame_layers
from fire_atlas.pipeline.animation.render import refuse_without_alpha, render_each, render_frame
from fire_atlas.recipe.models import Recipe
from fire_atlas.sources.sprites import Sprites


def pack_only(recipe: Recipe, sprites: Sprites, context: BuildContext) -> Contribution:
    """Prepare sprites as finished animations, their frames unchanged.

    Raises:
        RecipeError: The timeline or the maps have settings that need a single clip.
    """
    refuse_clip_settings(recipe)
    if recipe.maps.smoke:
        refuse_without_alpha(sprites.matte)
    numbers = [i for played in sprites.animations.values() for i in played]
    with context.timer.measure("render"):
        rendered = render_each(
            lambda i: render_frame(flame_layers(sprites.picture(i), recipe), recipe),
            numbers,
            context,
        )
    frames = dict(zip(numbers, rendered, strict=True))
    loop = recipe.timeline.loop != "none"
    animations = {}
    for name, played in sprites.animations.items():
        shown = [frames[i] for i in played]
        # No images are skipped, so frames are held out to test motion vectors.
        parts = AnimationParts([(frame.width, frame.height) for frame in shown], loop)
        maps = maps_of(shown, parts, recipe, context)
        animations[name] = FinishedAnimation(
            shown, sprites.fps, loop, maps=maps, pixel_art=recipe.is_pixel_art
        )
    statistics = {
        "frames": len(numbers),
        "animations": len(animations),
        "fps": round(sprites.fps, 4),
        "matte": sprites.matte,
    }
    if recipe.maps.motion != "none":
        statistics["motions"] = {name: each.all_statistics() for name, each in animations.items()}
    return Contribution(recipe.name, animations, statistics)


def refuse_clip_settings(recipe: Recipe) -> None:
    """Refuse what can be done with a single clip alone.

    Raises:
        RecipeError: The timeline or the maps have such settings.
    """
    if not recipe.timeline.keeps_all_frames:
        raise RecipeError(
            "edits a single clip, but these images have several animations or sizes; remove every "
            "setting of it (only loop: auto or loop: none may stay)",
            key=("timeline",),
        )
    if recipe.maps.haze:
        raise RecipeError(
            "the hot air is found by the motion of one clip, but these images have several "
            "animations or sizes; leave it out, or give each animation its own recipe",
            key=("maps", "haze"),
        )
