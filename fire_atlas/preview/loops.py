"""How well the loops of a finished atlas go round."""

from collections import deque
from itertools import islice

from fire_atlas.effect.flakes.statistics import Figure
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.preview.blend import as_seen
from fire_atlas.preview.frames import cut_frames
from fire_atlas.vision.loop_figures import LoopFigures, loop_figures

_MEASURED = 512
"""Longer loops are not measured: it takes some ms a frame."""


def loops_of(atlas: AtlasFile) -> dict[str, list[Figure]]:
    """Return the figures of each looping animation whose frames are alike, by its name.

    Steps are told against the median step, flow and change of light at the seam against the 95th
    percentile, detail against the median.

    Raises:
        SourceError: A page file is missing, or is not what the atlas says.
    """
    found = {}
    frames = cut_frames(atlas)
    regions = {region.name: region for region in atlas.frames}
    for animation in atlas.sheet.animations:
        shown = islice(frames, len(animation.frames))
        sizes = {
            (regions[name].frame_width, regions[name].frame_height) for name in animation.frames
        }
        if animation.loop and len(sizes) == 1 and 2 <= len(animation.frames) <= _MEASURED:
            seen = (as_seen(frame, atlas.alpha, atlas.blend_space) for frame in shown)
            found[animation.name] = _figures(loop_figures(seen))
        else:
            deque(shown, maxlen=0)
    return found


def _figures(loop: LoopFigures) -> list[Figure]:
    return [
        Figure("seam step", loop.seam_ratio, low=0.8, high=1.25),
        Figure("largest step", loop.largest_step),
        Figure("smallest step", loop.smallest_step),
        Figure("flow at the seam", loop.seam_flow, high=1.25),
        Figure("light at the seam", loop.seam_light, high=1.25),
        Figure("least detail", loop.least_detail),
    ]
