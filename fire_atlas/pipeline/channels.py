"""Measure channels of frames other than colour: motion vectors of the flame."""

from collections.abc import Mapping, Sequence

from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.channels.motion import Motion, estimate_motion
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.render import RenderedFrame
from fire_atlas.recipe.output import Maps


def measure_motion(
    frames: Sequence[RenderedFrame],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    maps: Maps,
    context: BuildContext,
) -> Motion | None:
    """Return the motion of an animation; None if the recipe has no motion vectors.

    Args:
        frames: The animation, in playing order.
        skipped: Source frames it skips, as from ``render.thumbnails_of_skipped_frames``.
        loop: Whether frame 0 follows the last frame.
        maps: The section of the recipe.
        context: Workers, progress and timer.

    Raises:
        SourceError: The frames differ in size, so that their pixels do not correspond.
    """
    if maps.motion == "none":
        return None
    sizes = {(frame.width, frame.height) for frame in frames}
    if len(sizes) > 1:
        raise SourceError(
            "maps.motion: the images of an animation differ in size, but motion vectors need equal "
            "sizes; make them one size, or leave maps.motion out"
        )
    thumbnails = [frame.thumbnail for frame in frames if frame.thumbnail is not None]
    with context.timer.measure("motion"):
        context.progress.stage("motion", len(frames))
        return estimate_motion(
            thumbnails,
            skipped,
            sizes.pop(),
            loop,
            motion_encoding(maps.motion),
            context.workers,
            context.progress.advance,
        )
