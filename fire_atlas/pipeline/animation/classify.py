"""Classify the fire of a clip, and fill in what its class and its style decide about the flakes."""

from typing import Any

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.effect.flakes.defaults import CLASSES, GREYS, STYLES, StyleDefaults
from fire_atlas.effect.flakes.emission import EmitterSettings
from fire_atlas.effect.flame.classes import FlameMeasures, classify_fire
from fire_atlas.effect.flame.colour import colour_ramp, flat_colours
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.effect.flame.styles import style_of
from fire_atlas.recipe.effect import FireClass, Flakes, FlakeStyle
from fire_atlas.recipe.fluid import FireName, FluidSource
from fire_atlas.recipe.models import Recipe

_OF_READY_FIRES: dict[FireName, FireClass] = {
    "campfire": "campfire",
    "torch": "torch",
    "flamethrower": "torch",
    "muzzle_flash": "explosion",
    "explosion": "explosion",
    "fireball": "explosion",
    "smoke": "none",
    "steam": "none",
}
"""The class of each ready fire of source ``fluid``."""


def has_undecided_flakes(recipe: Recipe) -> bool:
    """Return whether a recipe leaves anything to class or style of the fire. The paper knows
    neither."""
    flakes = recipe.flakes
    if flakes == "none" or recipe.features.preset == "paper":
        return False
    looks = flakes.size, flakes.colors, flakes.sprite, recipe.composite.palette
    return "auto" in (flakes.rate, flakes.sparks, *looks)


def may_have_squares(recipe: Recipe) -> bool:
    """Return whether flakes may be squares on pixels of art, or its style is still open."""
    flakes = recipe.flakes
    return has_undecided_flakes(recipe) or (flakes != "none" and flakes.sprite == "pixel")


def classify(recipe: Recipe, clip: Clip, study: FlameStudy, context: BuildContext) -> Recipe:
    """Return the recipe with everything filled in that class and style of its fire decide.

    What the recipe states stays as it is.

    Args:
        recipe: The recipe.
        clip: The clip as it is played.
        study: Constants of the clip, with samples if the recipe has undecided flakes.
        context: Receives a note about class and style.
    """
    flakes = recipe.flakes
    if flakes == "none" or study.samples is None or not has_undecided_flakes(recipe):
        return recipe
    if isinstance(recipe.source, FluidSource) and flakes.fire_class == "auto":
        flakes = flakes.model_copy(update={"fire_class": _OF_READY_FIRES[recipe.source.fire]})
    fire_class, style = _decided(flakes, clip, study, context)
    burns, looks = CLASSES[fire_class], STYLES[style]
    found: dict[str, Any] = {"fire_class": fire_class, "style": style}
    has_texture = flakes.own_texture is not None
    if flakes.sprite == "auto":
        found["sprite"] = "pixel" if looks.pixel and not has_texture else "soft"
    if flakes.size == "auto" and not has_texture:
        found["size"] = looks.size
    if flakes.colors == "auto":
        found["colors"] = _colours(looks, study)
    sparks = 0.0 if looks.hard else burns.sparks
    if flakes.bursts == flakes.sparks == "auto" and sparks is not None:
        found["sparks"] = sparks
    flakes = flakes.model_copy(update=found)
    if flakes.rate == "auto":
        rate = _automatic_rate(flakes, clip, study, recipe.seed) * burns.rate * looks.rate
        flakes = flakes.model_copy(update={"rate": rate})
    palette = recipe.composite.palette
    if palette == "auto":
        palette = "clip" if looks.hard and flakes.tint == "heat" else "none"
    composite = recipe.composite.model_copy(update={"palette": palette})
    return recipe.model_copy(update={"flakes": flakes, "composite": composite})


def _decided(
    flakes: Flakes, clip: Clip, study: FlameStudy, context: BuildContext
) -> tuple[FireClass, FlakeStyle]:
    """Return the class and the style that the recipe states, or else the measured ones, and note
    why."""
    if flakes.fire_class != "auto" and flakes.style != "auto":
        return flakes.fire_class, flakes.style
    measures = FlameMeasures.of(clip, study)
    notes, keys, style, fire_class = list[str](), list[str](), flakes.style, flakes.fire_class
    if style == "auto":
        style, why = style_of(measures)
        notes.append(f"style: {style} ({why})")
        keys.append("flakes.style")
    if fire_class == "auto":
        fire_class, why = classify_fire(measures, style)
        sheds = " sheds no flakes" if CLASSES[fire_class].rate == 0 else ""
        notes.insert(0, f"class: {fire_class}{sheds} ({why})")
        keys.insert(0, "flakes.class")
    overrides = "overrides" if len(keys) == 1 else "override"
    context.progress.note(f"{', '.join(notes)}; {' and '.join(keys)} {overrides}")
    return fire_class, style


def _colours(looks: StyleDefaults, study: FlameStudy) -> tuple[str, ...] | str:
    """Return the colours of flakes as in a recipe."""
    if study.samples is None or looks.colours == "embers":
        return "auto"
    match looks.colours:
        case "grey":
            return GREYS
        case "own":
            return colour_ramp(study.samples)
        case "flat":
            return flat_colours(study.samples)


def _automatic_rate(flakes: Flakes, clip: Clip, study: FlameStudy, seed: int) -> float:
    """Return the spawn rate, 1/s, that suits a campfire of this size."""
    emitter = EmitterSettings.of(
        flakes,
        clip,
        moving_area=study.moving_area,
        fires=study.fires.by_number,
        seed=seed,
        art=study.art,
    )
    return emitter.rate
