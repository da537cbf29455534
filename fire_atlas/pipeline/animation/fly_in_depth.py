"""Let the flakes of a fire with depth fly, once for all its views."""

from collections.abc import Iterable

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Clip, depth_of, kept
from fire_atlas.core.context import BuildContext
from fire_atlas.effect.field.wind import wind_in_view
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.animation.analyse import analyse
from fire_atlas.pipeline.animation.prepare import prepare
from fire_atlas.pipeline.animation.simulate import FlightInDepth, recipes_of_sets, simulate_in_depth
from fire_atlas.recipe.models import Recipe


def flies_in_depth(recipe: Recipe, clip: Clip) -> bool:
    """Return whether the flakes of a clip fly in three dimensions."""
    return clip.depth is not None and recipe.flakes != "none"


def fly_in_depth(
    recipe: Recipe, clip: Clip, study: FlameStudy, clips: Iterable[Clip], context: BuildContext
) -> tuple[FlightInDepth, ...]:
    """Return the flight of all flakes of a fire with depth, of each set that its recipe asks for.

    They are born on the fire as it is seen from the front. The gas that carries them moves as it
    does seen from there and from the right: level, with parallel lines of sight.

    Args:
        recipe: The recipe, with what the class of the first view decides.
        clip, study: The first view.
        clips: Of all views of the fire.
        context: Workers, progress and timer.
    """
    depth, timer = depth_of(clip), context.timer
    known = {depth_of(clip).camera: clip for clip in clips}

    def seen_by(camera: Camera) -> Clip:
        return known[camera] if camera in known else kept(depth.seen_by(camera))

    with timer.measure("study"):
        front = clip
        if depth.front != depth.camera:
            front, study = prepare(recipe, seen_by(depth.front), False, context)
        side, side_study = prepare(recipe, seen_by(depth.front.from_the_right()), False, context)
    wind = wind_in_view(recipe.wind, azimuth=90.0)
    flights = list[FlightInDepth]()
    for own in recipes_of_sets(recipe):
        with timer.measure("analyse"):
            analysis = analyse(front, study, own, context)
            from_the_side = own.without_flakes().model_copy(update={"wind": wind})
            field = analyse(side, side_study, from_the_side, context, eddies=1).field
        with timer.measure("fly"):
            flights.append(simulate_in_depth(front, analysis, field, [*known], own, context))
    return tuple(flights)
