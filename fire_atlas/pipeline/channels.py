"""Measure channels of frames other than colour: motion vectors of the flame, haze."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

from fire_atlas.atlas.sheet import Rect
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.layers import SimulatedClip
from fire_atlas.pipeline.render import RenderedFrame
from fire_atlas.recipe.output import Maps

if TYPE_CHECKING:
    from fire_atlas.channels.haze import Haze
    from fire_atlas.channels.motion import Motion


def measure_motion(
    frames: Sequence[RenderedFrame],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    maps: Maps,
    context: BuildContext,
) -> "Motion | None":
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
    from fire_atlas.channels.encoding import motion_encoding
    from fire_atlas.channels.motion import estimate_motion

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


def measure_haze(
    simulated: SimulatedClip, maps: Maps, seed: int, context: BuildContext
) -> "Haze | None":
    """Return the haze of an animation; None if the recipe has none."""
    analysis = simulated.analysis
    if not maps.haze or analysis is None:
        return None
    from fire_atlas.channels.haze import haze_of
    from fire_atlas.effect.field.hot_air import thinness

    if simulated.study.segmentation.background is not None:
        context.progress.note(
            "maps.haze: the clip is an opaque scene, which hides what hot air would bend; "
            "source.matte: luminance makes its dark parts transparent"
        )
    with context.timer.measure("haze"):
        thin = thinness(analysis.field, simulated.clip.height, seed)
        played = islice(thin, simulated.clip.count)  # without a dark end, fewer than the field's
        return haze_of(played, simulated.study.kappa, analysis.field.cell)


def with_room_for(haze: "Haze | None", frames: Sequence[RenderedFrame]) -> list[RenderedFrame]:
    """Return the frames, whose visible boxes also hold what is seen of their haze."""
    if haze is None:
        return list(frames)
    return [_enlarged(frame, haze.seen(i)) for i, frame in enumerate(frames)]


def _enlarged(frame: RenderedFrame, seen: Rect | None) -> RenderedFrame:
    whole, *smaller = frame.sprites
    if seen is None:
        return frame
    right, bottom = min(seen.x + seen.width, frame.width), min(seen.y + seen.height, frame.height)
    within = Rect(seen.x, seen.y, right - seen.x, bottom - seen.y)
    lit = within if whole.lit is None else bounding_rect([whole.lit, within])
    return replace(frame, sprites=(replace(whole, lit=lit), *smaller))
