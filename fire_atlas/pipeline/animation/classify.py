"""Classify the fire of a clip, and fill in what its class decides about the flakes."""

from typing import Any

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.effect.flakes.defaults import DEFAULTS, GREYS, FlakeDefaults
from fire_atlas.effect.flakes.emission import EmitterSettings
from fire_atlas.effect.flame.classes import FlameMeasures, classify_fire
from fire_atlas.effect.flame.colour import colour_ramp, flat_colours
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.recipe.effect import FireClass, Flakes
from fire_atlas.recipe.models import Recipe


def has_undecided_flakes(recipe: Recipe) -> bool:
    """Return whether a recipe leaves anything to the class of the fire. The paper knows none."""
    flakes = recipe.flakes
    if flakes == "none" or recipe.features.preset == "paper":
        return False
    looks = flakes.size, flakes.colors, flakes.sprite, recipe.composite.palette
    return "auto" in (flakes.rate, flakes.sparks, *looks)


def may_have_squares(recipe: Recipe) -> bool:
    """Return whether flakes may be squares on pixels of art, or its class is still open."""
    flakes = recipe.flakes
    return has_undecided_flakes(recipe) or (flakes != "none" and flakes.sprite == "pixel")


def classify(recipe: Recipe, clip: Clip, study: FlameStudy, context: BuildContext) -> Recipe:
    """Return the recipe with everything filled in that the class of its fire decides.

    What the recipe states stays as it is.

    Args:
        recipe: The recipe.
        clip: The clip as it is played.
        study: Constants of the clip, with samples if the recipe has undecided flakes.
        context: Receives a note about the class.
    """
    flakes = recipe.flakes
    if flakes == "none" or study.samples is None or not has_undecided_flakes(recipe):
        return recipe
    fire_class = _class_of(flakes, clip, study, context)
    defaults = DEFAULTS[fire_class]
    found: dict[str, Any] = {"fire_class": fire_class}
    has_texture = flakes.own_texture is not None
    if flakes.sprite == "auto":
        found["sprite"] = "pixel" if defaults.pixel and not has_texture else "soft"
    if flakes.size == "auto" and not has_texture:
        found["size"] = defaults.size
    if flakes.colors == "auto":
        found["colors"] = _colours(defaults, study)
    if flakes.bursts == flakes.sparks == "auto" and defaults.sparks is not None:
        found["sparks"] = defaults.sparks
    flakes = flakes.model_copy(update=found)
    if flakes.rate == "auto":
        rate = _automatic_rate(flakes, clip, study, recipe.seed) * defaults.rate
        flakes = flakes.model_copy(update={"rate": rate})
    palette = recipe.composite.palette
    if palette == "auto":
        palette = "clip" if defaults.hard and flakes.tint == "heat" else "none"
    composite = recipe.composite.model_copy(update={"palette": palette})
    return recipe.model_copy(update={"flakes": flakes, "composite": composite})


def _class_of(flakes: Flakes, clip: Clip, study: FlameStudy, context: BuildContext) -> FireClass:
    """Return the class that the recipe states, or else the measured one, and note why."""
    if flakes.fire_class != "auto":
        return flakes.fire_class
    fire_class, reason = classify_fire(FlameMeasures.of(clip, study))
    sheds = " sheds no flakes" if DEFAULTS[fire_class].rate == 0 else ""
    context.progress.note(f"class: {fire_class}{sheds} ({reason}); flakes.class overrides")
    return fire_class


def _colours(defaults: FlakeDefaults, study: FlameStudy) -> tuple[str, ...] | str:
    """Return the colours of flakes as in a recipe."""
    if study.samples is None or defaults.colours == "embers":
        return "auto"
    match defaults.colours:
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
