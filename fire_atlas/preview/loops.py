"""Measure the quality of the loops of a finished atlas."""

from collections import deque
from itertools import islice

from fire_atlas.effect.flakes.statistics import Figure
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.preview.blend import as_seen
from fire_atlas.preview.cut_frames import cut_frames, shown_alpha
from fire_atlas.vision.loop_figures import LoopFigures, loop_figures

_MAX_FRAMES = 512
"""Maximum length of a loop that is measured, as each frame takes some ms."""


def figures_of_loops(atlas: AtlasFile) -> dict[str, list[Figure]]:
    """Return figures about each looping animation whose frames have one size, by its name.

    Steps are relative to the median step, detail to its median; flow and change of light at the
    seam are relative to their 95th percentiles.

    Raises:
        SourceError: A page file is missing, or is not as the atlas states.
    """
    found = {}
    frames = cut_frames(atlas)
    regions = {region.name: region for region in atlas.frames}
    for animation in atlas.sheet.animations:
        shown = islice(frames, len(animation.frames))
        sizes = {
            (regions[name].frame_width, regions[name].frame_height) for name in animation.frames
        }
        if animation.loop and len(sizes) == 1 and 2 <= len(animation.frames) <= _MAX_FRAMES:
            seen = (
                as_seen(frame, shown_alpha(atlas.sheet), atlas.sheet.blend_space) for frame in shown
            )
            found[animation.name] = _figures(loop_figures(seen))
        else:
            deque(shown, maxlen=0)  # skip its frames
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
