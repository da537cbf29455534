"""Give a flame the colours of a ramp: each of its pixels by its heat.

Heat is brightness: the mean of R, G and B as they are shown over black, whatever the hue. It is
counted on the ready ramp ``campfire``: a pixel is as hot as the entry of that ramp which is as
bright. The other ready ramps are about as bright at the same heat, so that a fire keeps its light
and dark.

A flame of that heat covers as much as the entry does. What covers more has something dark behind
it, soot or the black of a drawing, which stays; what covers less is as much clearer in its new
colours.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Bytes, as_plane, decode_unit, encode_unit, expose
from fire_atlas.effect.composition.cover import cover_of_light
from fire_atlas.heat.ramp import finished_ramp
from fire_atlas.heat.ready import NATURAL, RampLight, ready_light

_STEPS = 4096
"""Number of brightnesses for which colours are tabulated."""

_MIN_COVERAGE = np.float32(1e-6)
"""Minimum coverage that light is divided by."""

_ROUNDING = np.float32(1.5 / 255)
"""Difference of two coverages that is that of their bytes."""

_BINS = 16
"""Number of brightnesses for which the saturation of a flame is measured."""

_MIN_COUNT = 30
"""Number of pixels from which the saturation at a brightness is known."""

_VISIBLE = 8 / 255
"""Brightness from which a pixel's saturation is measured: that of dimmer ones is rounding."""

_DULL, _BRIGHT = 0.6, 0.9
"""Brightest channel up to which what is paler than the flame is smoke or wood, and from which it is
the white heat of a flame."""

_PALER_CLEAR, _PALER_SOLID = 0.45, 0.2
"""By how much the saturation of a flame's pixel may be less than usual: of one that is light alone,
as where the blue foot of a candle turns yellow, and of one that hides all behind it, like wood."""

_FADE = 0.2
"""Further difference over which a pixel's flame fades."""

Light = NDArray[np.float32]
"""(n, 4): pixels, linear light, premultiplied by coverage."""

Values = NDArray[np.float32]
"""(n,)."""


def shown(light: Light, blend_space: str) -> Light:
    """Return what a client shows of pixels over black, sRGB in 0..1, and their coverage."""
    coverage = np.clip(light[:, 3:], 0, 1)
    if blend_space == "linear":
        return np.hstack([encode_unit(light[:, :3]), coverage])
    straight = as_plane(light[:, :3] / np.maximum(coverage, _MIN_COVERAGE))
    return np.hstack([encode_unit(straight) * coverage, coverage])


def light_of_shown(seen: Light, blend_space: str) -> Light:
    """Return the pixels of which a client shows ``seen``; the inverse of ``shown``."""
    coverage = seen[:, 3:]
    if blend_space == "linear":
        return np.hstack([decode_unit(seen[:, :3]), coverage])
    straight = as_plane(seen[:, :3] / np.maximum(coverage, _MIN_COVERAGE))
    return np.hstack([decode_unit(straight) * coverage, coverage])


def needed(seen: Light, blend_space: str) -> Values:
    """Return the least coverage (n,) of a page that shows ``seen``."""
    brightest = seen[:, :3].max(axis=1)
    return decode_unit(brightest) if blend_space == "linear" else brightest


@dataclass(frozen=True, slots=True)
class HeatColours:
    """The colours of a ramp by the brightness of what gets them.

    Attributes:
        blend_space: Encoding in which the client blends.
        colours: (steps, 4), shown over black, and coverage, for brightnesses from 0 to 1.
        natural: (steps,), coverage of a flame so bright.
    """

    blend_space: str
    colours: NDArray[np.float32]
    natural: Values

    @classmethod
    def of(cls, ramp: RampLight, blend_space: str) -> Self:
        """Return the colours of a ramp."""
        natural, seen = (shown(row, blend_space) for row in (ready_light(NATURAL), ramp))
        brightness, heat = natural[:, :3].mean(axis=1), np.arange(len(ramp))
        at = np.interp(np.linspace(0, 1, _STEPS), brightness, heat)
        table = np.column_stack(
            [np.interp(at, heat, column) for column in (*seen.T, natural[:, 3])]
        )
        colours, coverage = table[:, :4], table[:, 4]
        return cls(blend_space, as_plane(colours), as_plane(coverage))

    def of_flame(self, seen: Light) -> Light:
        """Return what is shown of a flame of which ``seen`` was shown, in the ramp's colours."""
        step = self._step(seen)
        found, natural, coverage = self.colours[step], self.natural[step], seen[:, 3]
        clearer = np.minimum((coverage + _ROUNDING) / np.maximum(natural, _MIN_COVERAGE), 1)
        found[:, 3] = 1 - (1 - found[:, 3] * clearer) * (1 - self.behind(seen))
        found[:, 3] = np.maximum(found[:, 3], needed(found, self.blend_space))
        return found

    def behind(self, seen: Light) -> Values:
        """Return the coverage of what is dark behind a flame of which ``seen`` is shown."""
        usual, coverage = self.natural[self._step(seen)] + _ROUNDING, seen[:, 3]
        more = (coverage - usual) / np.maximum(1 - usual, _MIN_COVERAGE)
        return as_plane(np.where(coverage >= 1, 1, np.clip(more, 0, 1) * (usual < 1)))

    def _step(self, seen: Light) -> NDArray[np.intp]:
        """Return the place in the tables of the brightness of what is ``seen``."""
        brightness = np.clip(seen[:, :3].mean(axis=1), 0, 1)
        return np.asarray(np.rint(brightness * (_STEPS - 1)), np.intp)

    def hue_of(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the colours (n, 3), brightest channel 1, of sparks that shed this light (n, 3)
        before it is exposed."""
        code = encode_unit(expose(as_plane(light))).mean(axis=1)
        step = np.rint(code * (_STEPS - 1)).astype(np.intp)
        first = int(np.argmax(self.colours[:, :3].max(axis=1) > _VISIBLE))
        found = decode_unit(self.colours[np.maximum(step, first), :3]).astype(np.float64)
        return np.asarray(found / np.maximum(found.max(axis=1, keepdims=True), 1e-12))


@dataclass(frozen=True, slots=True)
class OwnColours:
    """How saturated a flame is where it is how bright: what is far paler, and dull, is no flame.

    A flame gets paler as it gets hotter, so that its dim parts are at least as saturated as the
    brighter ones: smoke, wood and stone are dim and pale. Of grey fire nothing is paler.

    Attributes:
        blend_space: Encoding in which the client blends.
        is_matted: Whether coverage is the pictures' own, and not their brightness.
        saturation: (bins,) of the flame for brightnesses from 0 to 1; 0 is grey.
    """

    blend_space: str
    is_matted: bool
    saturation: Values

    @classmethod
    def of(cls, seen: Light, blend_space: str, *, is_matted: bool) -> Self:
        """Measure what is shown of pixels of a few frames of a clip."""
        brightest = seen[:, :3].max(axis=1)
        seen, brightest = seen[brightest > _VISIBLE], brightest[brightest > _VISIBLE]
        paleness = seen[:, :3].min(axis=1) / brightest
        level = np.minimum((brightest * _BINS).astype(np.intp), _BINS - 1)
        found = np.zeros(_BINS)
        for i in range(_BINS):
            if np.count_nonzero(level == i) >= _MIN_COUNT:
                found[i] = 1 - np.median(paleness[level == i])
        return cls(blend_space, is_matted, as_plane(np.maximum.accumulate(found[::-1])[::-1]))

    def share(self, seen: Light) -> Values:
        """Return how much of each pixel, 0..1, is flame, of what is shown of it."""
        brightest = seen[:, :3].max(axis=1)
        saturation = 1 - seen[:, :3].min(axis=1) / np.maximum(brightest, _MIN_COVERAGE)
        level = np.minimum((brightest * _BINS).astype(np.intp), _BINS - 1)
        colour = brightest / np.maximum(seen[:, 3], _MIN_COVERAGE) if self.is_matted else brightest
        heat = smooth_step((colour - _DULL) / (_BRIGHT - _DULL))
        paler = self.saturation[level] * (1 - heat) - saturation
        light = needed(seen, self.blend_space)
        hides = np.clip((seen[:, 3] - light) / np.maximum(1 - light, _MIN_COVERAGE), 0, 1)
        usual = _PALER_CLEAR + (_PALER_SOLID - _PALER_CLEAR) * hides
        return as_plane(1 - smooth_step((paler - usual) / _FADE))


def shown_of_bytes(image: Bytes, alpha: str, blend_space: str, *, thins: bool) -> Light:
    """Return what is shown of encoded pixels (..., 4) of premultiplied or added light, (n, 4), with
    the coverage that straight pages would have; ``thins`` as of ``Atlas``."""
    seen = as_plane(image.reshape(-1, 4) / np.float32(255))
    if alpha == "additive":
        seen[:, 3] = needed(seen, blend_space)
    elif thins:
        # Light F that covers G, over what hides h, covers 1 − (1 − h)(1 − G), and needs
        # 1 − (1 − h)(1 − F).
        light, space = needed(seen, blend_space), blend_space
        hue = decode_unit(seen[:, :3]) if space == "linear" else seen[:, :3]
        clear = (1 - light) / np.maximum(1 - cover_of_light(light, hue, space), _MIN_COVERAGE)
        seen[:, 3] = 1 - (1 - seen[:, 3]) * clear
    return seen


def keeping(
    ramp: Bytes, learnt: Bytes, own: OwnColours, alpha: str, blend_space: str, *, thins: bool
) -> Bytes:
    """Return a ramp (256, 4) that has the ``learnt`` colours of what is no flame, and hides as
    much as these: by the colours of flames alone, wood and smoke would be glass.

    Args:
        ramp, learnt: Encoded for pages with these settings.
        own: The flame's own colours.
        alpha, blend_space, thins: Settings of the pages, as of ``Atlas``.
    """
    seen = shown_of_bytes(learnt, alpha, blend_space, thins=thins)
    natural = HeatColours.of(ready_light(NATURAL), blend_space)
    share = own.share(seen)[:, None]
    kept = ramp.astype(np.float64)
    if alpha != "additive":
        kept[:, 3] = 255 - (255 - kept[:, 3]) * (1 - natural.behind(seen))
    kept += (learnt - kept) * (1 - share)
    return ramp if (np.rint(kept) == ramp).all() else finished_ramp(kept, alpha, blend_space)
