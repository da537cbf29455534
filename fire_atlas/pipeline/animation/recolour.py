"""Give a clip's flame and flakes the colours of a ramp, but not what stands in the fire."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame, is_page_ready
from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture, as_light, brightest_shown, brightness_of
from fire_atlas.core.pixels import Pixels, Plane, as_plane, decode_unit, encode_unit
from fire_atlas.effect.flakes.tracks import COLUMNS, Table, Tracks
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.heat.ramp_colours import (
    HeatColours,
    Light,
    OwnColours,
    Values,
    light_of_shown,
    needed,
    shown,
)
from fire_atlas.heat.ready import RampLight
from fire_atlas.recipe.output import Atlas
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.still import still_things

_SAMPLES, _SAMPLED = 8, 1 << 15
"""Number of frames by which a flame's own colours are measured, and of pixels of each."""

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
        own: The flame's own colours, by which it is told from smoke and wood; None if something
            else tells.
        scene: Tells flame from the scene behind it, if the clip is an opaque scene.
        still: (H, W) how far each pixel shows a thing that stands still, 0..1, if the clip is fire
            on black, whose coverage says nothing of things.
        solids: What stands in the fire, as ``Clip.solids``; None if that is unknown.
    """

    colours: HeatColours
    own: OwnColours | None
    scene: FlameSegmentation | None
    still: Plane | None
    solids: Callable[[int], Pixels] | None

    @classmethod
    def of(
        cls, clip: Clip, flame: FlameSegmentation, ramp: RampLight, context: BuildContext
    ) -> Self:
        """Return the colours of a ramp for a clip with this ``flame``."""
        scene = None if flame.background is None else flame
        is_told = clip.solids is not None or scene is not None
        own = None if is_told else _own_colours(clip, context)
        is_filmed = clip.matte == "luminance" and clip.flow is None
        still = _still_things(clip, flame.activity, context) if is_filmed else None
        return cls(HeatColours.of(ramp, clip.blend_space), own, scene, still, clip.solids)

    def flame(self, i: int, flame: Picture, atlas: Atlas) -> Picture:
        """Return the flame (H, W, 4) of frame ``i`` in these colours.

        Pixels that show none are unchanged: they keep the exact bytes of the source if the page
        encodes alike.
        """
        light, space = as_light(flame), self.colours.blend_space
        where = np.flatnonzero(light[..., 3] > 0)
        seen = shown(light.reshape(-1, 4)[where], space)
        coloured, share = self._coloured(seen)
        if self.scene is not None:
            share = self.scene.fire_before(brightness_of(flame, space), light).reshape(-1)[where]
        if self.still is not None:
            share = as_plane(share * (1 - self.still.reshape(-1)[where]))
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


def _own_colours(clip: Clip, context: BuildContext) -> OwnColours:
    """Measure the colours of a clip's flame in a few of its frames."""
    stride = max(1, clip.width * clip.height // _SAMPLED)

    def some(i: int) -> Light:
        return clip.read(i).reshape(-1, 4)[::stride]

    numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
    seen = shown(np.concatenate(list(context.workers.map(some, numbers))), clip.blend_space)
    return OwnColours.of(seen, clip.blend_space, is_matted=clip.matte == "alpha")


def _still_things(clip: Clip, activity: Plane, context: BuildContext) -> Plane:
    """Return how far each pixel of a clip, (H, W) in 0..1, shows a thing that stands still."""

    def brightness(i: int) -> Plane:
        return brightest_shown(clip.picture(i)) * np.float32(255)

    numbers = evenly_spread(0, clip.body - 1, _SAMPLES)
    return still_things(list(context.workers.map(brightness, numbers)), activity)
