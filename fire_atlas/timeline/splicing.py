"""A clip cut and joined as an edit says."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, cached
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.seam import plan_seam
from fire_atlas.timeline.takes import Edit
from fire_atlas.vision.thumbnails import Thumbnails


def spliced(clip: Clip, edit: Edit, thumbnails: Thumbnails, workers: Workers) -> Clip:
    """Return ``clip`` as ``edit`` shows it; frames of a seam are made when they are read."""
    mean = as_plane(thumbnails.frames.mean(axis=0))
    seams = {
        join: plan_seam(
            clip,
            [
                ((join.ending + k) % clip.count, (join.beginning + k) % clip.count)
                for k in range(edit.overlap)
            ],
            mean,
            workers,
        )
        for join in edit.joins
    }

    def picture(i: int) -> Picture:
        part = edit.shown[i]
        if isinstance(part, int):
            return clip.picture(part)
        join, k = part
        one, other = (clip.read((start + k) % clip.count) for start in join)
        return seams[join][k].of(one, other, mean)

    def flow(i: int) -> NDArray[np.float32]:
        assert clip.flow is not None, "only given where the clip has one"
        part = edit.shown[i]
        if isinstance(part, int):
            return clip.flow(part)
        join, k = part
        one, other = (clip.flow((start + k) % clip.count) for start in join)
        return as_plane(one + (other - one) * ((k + 1) / (edit.overlap + 1)))

    made = {i for i, part in enumerate(edit.shown) if not isinstance(part, int)}
    return replace(
        clip,
        count=len(edit.shown),
        picture=cached(picture, made),
        loop=edit.loop,
        flow=None if clip.flow is None else flow,
    )
