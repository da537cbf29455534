"""Prepare sprites for packing: encoded, but otherwise as they are."""

from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.core.context import BuildContext
from fire_atlas.pipeline.animation.contribution import (
    Contribution,
    FinishedAnimation,
    FinishedSprite,
)
from fire_atlas.pipeline.animation.render import RenderedFrame, render_each
from fire_atlas.recipe.models import Recipe
from fire_atlas.sources.sprites import Sprites


def pack_only(recipe: Recipe, sprites: Sprites, context: BuildContext) -> Contribution:
    """Return sprites as finished animations and single sprites, their pixels unchanged."""

    def finished(i: int) -> FinishedSprite:
        picture, named = sprites.read(i)
        height, width = picture.shape[:2]
        encoded = encode_sprites(picture, recipe.atlas)
        return FinishedSprite(RenderedFrame(encoded, {}, None, width, height), named)

    names = sprites.names
    with context.timer.measure("render"):
        rendered = render_each(finished, range(len(names.files)), context)
    animations = {
        title: FinishedAnimation(
            [rendered[i].frame for i in played],
            sprites.rates[title],
            loop=recipe.timeline.loop != "none",
            has_hard_edges=True,
            named=tuple(rendered[i].named for i in played),
        )
        for title, played in names.animations.items()
    }
    single = tuple(rendered[i] for i in names.single)
    statistics = {"frames": len(rendered), "animations": len(animations)}
    return Contribution(recipe.name, recipe, animations, statistics, single=single)
