"""Prepare the texture of flakes: as large as the largest flake, and encoded as on the pages."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from fire_atlas.atlas.encode import encode_sprite, light_over_black, scaled
from fire_atlas.atlas.sheet import AnimationFrames, Rect, Sprite
from fire_atlas.atlas.trim import crop, up_to
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.effect.flakes.emission import size_range
from fire_atlas.effect.flakes.texture import MIN_WIDTH, TextureCells
from fire_atlas.recipe.effect import Flakes
from fire_atlas.recipe.output import Atlas


@dataclass(frozen=True, slots=True)
class PreparedTexture:
    """The texture of a recipe's flakes.

    Attributes:
        shape: What flakes are drawn with.
        sprites: The cells in each scale of the pages, the largest first: (cells, scales).
    """

    shape: TextureCells
    sprites: tuple[tuple[Sprite, ...], ...]

    @classmethod
    def of(
        cls,
        cells: Sequence[Pixels],
        flakes: Flakes,
        clip: Clip,
        atlas: Atlas,
        context: BuildContext,
    ) -> Self:
        """Return the texture for the flakes of a clip.

        Args:
            cells: As painted, all of one size.
            flakes: The recipe's section.
            clip: Only its height is used.
            atlas: How pages are encoded.
            context: Receives a note if the cells are larger than any flake.
        """
        own = flakes.own_texture
        if own is None:
            raise ValueError("these flakes have no texture")
        height, width = cells[0].shape[:2]
        largest = max(size_range(flakes)[1] * clip.height, MIN_WIDTH)
        share, unit = min(largest / height, 1.0), round(1 / atlas.scales[-1])
        size = tuple(up_to(unit, max(round(length * share), 1)) for length in (width, height))
        if share < 1:
            context.progress.note(
                f"flakes.texture: cells of {width}x{height} px are packed at {size[0]}x{size[1]}: "
                f"the largest flake is {largest:.0f} px wide; a larger flakes.size shows more"
            )
        fitted = [_resized(cell, size) for cell in cells]
        sprites = tuple(
            tuple(
                encode_sprite(variant, atlas.alpha, atlas.blend_space, bits=atlas.bits)
                for variant in scaled(cell, atlas.scales)
            )
            for cell in fitted
        )
        whole = Rect(0, 0, *size)
        light = [
            light_over_black(crop(cell[0], whole), atlas.alpha, atlas.blend_space)
            for cell in sprites
        ]
        shown = np.stack(light)
        if flakes.tint == "heat":
            shown = shown.max(axis=3, keepdims=True)
        return cls(TextureCells(shown, own.play == "life"), sprites)

    def frames_for_pages(self, name: str, duration: float) -> AnimationFrames:
        """Return the cells in the largest scale for packing; ``duration`` of each is in ms."""
        sprites = tuple(cell[0] for cell in self.sprites)
        height, width = self.shape.light.shape[1:3]
        return AnimationFrames(
            name, sprites, duration, self.shape.over_life, (width / 2, height / 2)
        )


def _resized(cell: Pixels, size: tuple[int, ...]) -> Pixels:
    """Return a cell at ``size``, (width, height) px."""
    if cell.shape[1::-1] == size:
        return cell
    return as_plane(cv2.resize(cell, size, interpolation=cv2.INTER_AREA))
