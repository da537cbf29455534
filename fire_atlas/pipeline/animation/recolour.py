"""Give a clip's flame and flakes the colours of a ramp, but not what stands in the fire."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame, is_page_ready
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture, as_light, brightness_of
from fire_atlas.core.pixels import Pixels, as_plane, decode_unit, encode_unit
from fire_atlas.effect.flakes.tracks import COLUMNS, Table, Tracks
from fire_atlas.effect.flame.segmentation import Background
from fire_atlas.heat.ready import RampLight
from fire_atlas.heat.recolour import (
    HeatColours,
    Light,
    OwnColours,
    Values,
    light_of_shown,
    needed,
    shown,
)
from fire_atlas.recipe.output import Atlas
from fire_atlas.vision.sampling import evenly_spread

_SAMPLES, _SAMPLED = 8, 1 << 15
"""Number of frames by which a flame's own colours are measured, and of pixels of each."""

_UNSEEN = np.float32(4e-4)
"""Light, linear, up to which a flame is not seen before something solid: a step of sRGB."""

_MOST = np.float32(0.999)
"""The most light of something solid before which a flame can still be told."""

_RGB, _A = [COLUMNS.index(name) for name in "rgb"], COLUMNS.index("a")


@dataclass(frozen=True, slots=True)
class Recolouring:
    """The colours that a clip's fire gets.

    Attributes:
        colours: Those of the ramp.
        own: The flame's own colours, by which it is told from smoke and wood; None if something
            else tells.
        background: The static background, if the clip is an opaque scene.
        solids: What stands in the fire, as ``Clip.solids``; None if that is unknown.
    """

    colours: HeatColours
    own: OwnColours | None
    background: Background | None
    solids: Callable[[int], Pixels] | None

    @classmethod
    def of(
        cls, clip: Clip, background: Background | None, ramp: RampLight, context: BuildContext
    ) -> Self:
        """Return the colours of a ramp for a clip."""
        is_told = clip.solids is not None or background is not None
        own = None if is_told else _own_colours(clip, context)
        return cls(HeatColours.of(ramp, clip.blend_space), own, background, clip.solids)

    def flame(self, i: int, flame: Picture, atlas: Atlas) -> Picture:
        """Return the flame (H, W, 4) of frame ``i`` in these colours.

        Pixels that show none are unchanged: they keep the exact bytes of the source if the page
        encodes alike.
        """
        light, space = as_light(flame), self.colours.blend_space
        where = np.flatnonzero(light[..., 3] > 0)
        seen = shown(light.reshape(-1, 4)[where], space)
        coloured, share = self._coloured(seen)
        if self.background is not None:
            bright = brightness_of(flame, space)
            share = as_plane(self.background.foreground(bright, light).reshape(-1)[where])
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
        coloured, share = self._coloured(seen)
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

    def _coloured(self, seen: Light) -> tuple[Light, Values]:
        """Return what is shown of pixels in these colours, and how much of each, 0..1, is flame."""
        share = np.ones(len(seen), np.float32) if self.own is None else self.own.share(seen)
        return self.colours.of_flame(seen), share

    def _before(self, seen: Light, solid: Light) -> tuple[Light, Values]:
        """Return what ``_coloured`` does of pixels with flame before something ``solid``, (n, 4)
        light and coverage: its light is shown through the flame's as film exposes both."""
        behind = 1 - np.minimum(solid[:, :3], _MOST)
        flame = as_plane(np.maximum(1 - (1 - decode_unit(seen[:, :3])) / behind, 0))
        alone = np.hstack([encode_unit(flame), np.ones_like(flame[:, :1])])
        alone[:, 3] = needed(alone, self.colours.blend_space)
        coloured = self.colours.of_flame(alone)
        light = 1 - (1 - decode_unit(coloured[:, :3])) * behind
        coloured[:, :3] = encode_unit(as_plane(light))
        coloured[:, 3] += solid[:, 3] * (1 - coloured[:, 3])
        coloured[:, 3] = np.maximum(coloured[:, 3], needed(coloured, self.colours.blend_space))
        return coloured, as_plane(flame.max(axis=1) > _UNSEEN)


def _own_colours(clip: Clip, context: BuildContext) -> OwnColours:
    """Measure the colours of a clip's flame in a few of its frames."""
    stride = max(1, clip.width * clip.height // _SAMPLED)

    def some(i: int) -> Light:
        return clip.read(i).reshape(-1, 4)[::stride]

    numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
    seen = shown(np.concatenate(list(context.workers.map(some, numbers))), clip.blend_space)
    return OwnColours.of(seen, clip.blend_space, is_matted=clip.matte == "alpha")
