"""Give a clip's flame and flakes the colours of a ramp, but not what stands in the fire."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame, is_page_ready
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture, as_light
from fire_atlas.core.pixels import Pixels, as_plane, decode_unit, encode_unit
from fire_atlas.effect.flakes.tracks import COLUMNS, Table, Tracks
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.heat.ramp_colours import (
    HeatColours,
    Light,
    Values,
    light_of_shown,
    needed,
    shown,
)
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.flame_part import FlamePart
from fire_atlas.recipe.output import Atlas

_UNSEEN = np.float32(4e-4)
"""Light, linear, up to which what a flame adds to something solid is not seen: a step of sRGB."""

_MOST = np.float32(0.999)
"""The most light of something solid before which a flame can still be told."""

_RGB, _A = [COLUMNS.index(name) for name in "rgb"], COLUMNS.index("a")


@dataclass(frozen=True, slots=True)
class Recolouring:
    """The colours that a clip's fire gets.

    Attributes:
        colours: Those of the ramp.
        part: Tells the flame from all else.
        solids: What stands in the fire, as ``Clip.solids``; None if that is unknown.
    """

    colours: HeatColours
    part: FlamePart
    solids: Callable[[int], Pixels] | None

    @classmethod
    def of(
        cls, clip: Clip, flame: FlameSegmentation, ramp: RampLight, context: BuildContext
    ) -> Self:
        """Return the colours of a ramp for a clip with this ``flame``."""
        part = FlamePart.of(clip, flame, context)
        return cls(HeatColours.of(ramp, clip.blend_space), part, clip.solids)

    def flame(self, i: int, flame: Picture, atlas: Atlas) -> Picture:
        """Return the flame (H, W, 4) of frame ``i`` in these colours.

        Pixels that show none are unchanged: they keep the exact bytes of the source if the page
        encodes alike.
        """
        light, space = as_light(flame), self.colours.blend_space
        where = np.flatnonzero(light[..., 3] > 0)
        seen = shown(light.reshape(-1, 4)[where], space)
        coloured, share = self.colours.of_flame(seen), self.part.of_frame(flame, where, seen)
        if self.solids is not None:
            solid = self.solids(i).reshape(-1, 4)[where]
            before = np.flatnonzero(solid[:, 3] > 0)
            coloured[before], share[before] = self._before(seen[before], solid[before])
        changed = np.flatnonzero(share > 0)
        if not changed.size:
            return flame
        mixed = seen[changed] + (coloured - seen)[changed] * share[changed, None]
        pixels = light_of_shown(as_plane(mixed), space)
        is_ready = is_page_ready(flame, atlas)
        whole: Picture = (flame if is_ready else light).copy()
        whole.reshape(-1, 4)[where[changed]] = (
            encode_frame(pixels[None], "straight", atlas.blend_space)[0] if is_ready else pixels
        )
        return whole

    def palette(self, palette: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return colours of the clip, (n, 3) sRGB in 0..1, as they become."""
        seen = np.column_stack([palette, np.ones(len(palette), np.float32)])
        coloured, share = self.colours.of_flame(seen), self.part.of_colours(seen)
        return as_plane(palette + (coloured[:, :3] - palette) * share[:, None])

    def tracks(self, tracks: Tracks) -> Tracks:
        """Return flakes in the ramp's colours, as bright as they were; those that show a picture as
        it is painted are unchanged."""
        if tracks.texture is not None and not tracks.texture.tinted:
            return tracks
        return replace(tracks, frames=tuple(self._rows(rows) for rows in tracks.frames))

    def _rows(self, rows: Table) -> Table:
        coloured, light = rows.copy(), rows[:, _RGB]
        hue = self.colours.hue_of(light * rows[:, [_A]])
        coloured[:, _RGB] = hue * light.max(axis=1, keepdims=True)
        return coloured

    def _before(self, seen: Light, solid: Light) -> tuple[Light, Values]:
        """Return what is shown of pixels in these colours, with flame before something ``solid``,
        (n, 4) light and coverage, and where there is flame, 0 or 1: the solid's light is shown
        through the flame's as film exposes both."""
        whole, behind = decode_unit(seen[:, :3]), 1 - np.minimum(solid[:, :3], _MOST)
        flame = as_plane(np.maximum(1 - (1 - whole) / behind, 0))
        alone = np.hstack([encode_unit(flame), np.ones_like(flame[:, :1])])
        alone[:, 3] = needed(alone, self.colours.blend_space)
        coloured = self.colours.of_flame(alone)
        light = 1 - (1 - decode_unit(coloured[:, :3])) * behind
        coloured[:, :3] = encode_unit(as_plane(light))
        coloured[:, 3] += solid[:, 3] * (1 - coloured[:, 3])
        coloured[:, 3] = np.maximum(coloured[:, 3], needed(coloured, self.colours.blend_space))
        return coloured, as_plane((whole - solid[:, :3]).max(axis=1) > _UNSEEN)
