"""The frames of a fire at the heights that are tried, and how far they are from the whole."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import Sprite
from fire_atlas.core.context import BuildContext
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.fit.frames import as_textures, at_heights, squared_errors
from fire_atlas.recipe.fit import Fit
from fire_atlas.recipe.output import Atlas

_UNCOMPRESSED = ""
"""Stands for the blocks of pages that have none."""


class ScaledFrames:
    """All frames at the heights that are tried, and how far each is from each of the whole.

    All searches share them: each frame is made once at each height, and compressed once to each
    kind of blocks.

    Attributes:
        whole: The animations at the largest height.
        top: That height, px.
        is_pixel_art: Whether there is no other height.
    """

    def __init__(
        self,
        animations: Mapping[str, FinishedAnimation],
        atlas: Atlas,
        budget: Fit,
        context: BuildContext,
    ) -> None:
        """Make the frames of the largest height; arguments as of ``fit``."""
        full_height = next(iter(animations.values())).frames[0].height
        self.is_pixel_art = any(animation.pixel_art for animation in animations.values())
        self.top = full_height
        if budget.shown and not self.is_pixel_art:
            self.top = min(full_height, budget.shown)
        self._atlas, self._context = atlas, context
        self.whole = {
            name: at_heights(animation, [self.top], atlas, context.workers)[0]
            for name, animation in animations.items()
        }
        self._made: dict[int, dict[str, FinishedAnimation]] = {}
        self._errors: dict[tuple[int, str], NDArray[np.float64]] = {}

    def at(self, heights: Sequence[int]) -> list[Mapping[str, FinishedAnimation]]:
        """Return the animations at each of ``heights``."""
        unmade = [height for height in heights if height not in self._made]
        if unmade:
            workers = self._context.workers
            for name, whole in self.whole.items():
                made = at_heights(whole, unmade, self._atlas, workers)
                for height, animation in zip(unmade, made, strict=True):
                    self._made.setdefault(height, {})[name] = animation
        return [self._made[height] for height in heights]

    def errors(self, heights: Sequence[int], blocks: Sequence[str]) -> list[NDArray[np.float64]]:
        """Return, for each of ``heights``, the squared errors (i, j) of its frames j as frames i of
        the whole: the mean of those compressed to each of ``blocks``, or as they are."""
        kinds = tuple(blocks) or (_UNCOMPRESSED,)
        unknown = {
            kind: [height for height in heights if (height, kind) not in self._errors]
            for kind in kinds
        }
        for missing in dict.fromkeys(map(tuple, unknown.values())):
            if missing:
                self._compare(missing, [kind for kind in kinds if tuple(unknown[kind]) == missing])
        return [
            np.asarray(sum(self._errors[height, kind] for kind in kinds) / len(kinds))
            for height in heights
        ]

    def _compare(self, heights: Sequence[int], kinds: Sequence[str]) -> None:
        workers, atlas = self._context.workers, self._atlas
        self._context.progress.stage("fit", len(self.whole))
        at_each = self.at(heights)
        for name, whole in self.whole.items():
            sprites = [sprites_of(animations[name]) for animations in at_each]
            blocks = [kind for kind in kinds if kind != _UNCOMPRESSED]
            textures = as_textures(sprites, blocks, atlas, workers)
            for kind, shown in zip(kinds, textures, strict=True):
                errors = squared_errors(sprites_of(whole), shown, atlas, workers)
                for height, of_height in zip(heights, errors, strict=True):
                    before = self._errors.get((height, kind), np.zeros(()))
                    self._errors[height, kind] = before + of_height
            self._context.progress.advance()


def sprites_of(animation: FinishedAnimation) -> list[Sprite]:
    """Return the frames of an animation, each as its largest sprite."""
    return [frame.sprites[0] for frame in animation.frames]
