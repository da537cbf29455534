"""What a frame holds besides its colours: how the flame in it moves."""

from collections.abc import Mapping, Sequence

from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.channels.motion import Motion, learn_motion
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.render import RenderedFrame
from fire_atlas.recipe.output import Maps


def measure_motion(
    frames: Sequence[RenderedFrame],
    between: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    maps: Maps,
    context: BuildContext,
) -> Motion | None:
    """Return how an animation moves, where the recipe asks for motion vectors.

    Args:
        frames: The animation, in playing order.
        between: What its source shows between some of them, as of ``render.flames_between``.
        loop: Whether frame 0 follows the last frame.
        maps: What the recipe asks for.
        context: The pool, and who hears of the progress.

    Raises:
        SourceError: Its frames differ in size, so that no place in one is a place in the next.
    """
    if maps.motion == "none":
        return None
    sizes = {(frame.width, frame.height) for frame in frames}
    if len(sizes) > 1:
        raise SourceError(
            "maps.motion: the images of an animation differ in size, and vectors lead from a place "
            "in one to a place in the next; make them one size, or leave maps.motion out"
        )
    thumbnails = [frame.thumbnail for frame in frames if frame.thumbnail is not None]
    with context.timer.measure("motion"):
        context.progress.stage("motion", len(frames))
        return learn_motion(
            thumbnails,
            between,
            sizes.pop(),
            loop,
            motion_encoding(maps.motion),
            context.workers,
            context.progress.advance,
        )
