"""The colours of a clip by their light, and mixing two of its frames along these colours.

The colour of fire follows from its heat: from dark red over orange to white. Half-way between white
and black it is orange. A mix of channels gives grey there, which the clip shows nowhere.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Pixels, Plane, as_plane, hue_difference, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.sampling import evenly_spread

_FRAMES = 24
"""Maximum number of frames from which the colours are learnt."""

_SAMPLES = 1 << 13
"""About this many pixels of each of these are used."""

_STEPS = 128
"""Number of steps of light for which a colour is learnt."""

_FINE_STEPS = 1024
"""Number of steps that are interpolated between these."""

_SMOOTHING = 1.5
"""Standard deviation, steps, of the Gaussian over which colours are averaged."""

_FEW = 20
"""Weight of the colours of other steps where fewer pixels than this have the light of a step."""

_SPREAD = 90.0
"""Percentile of the distances of the clip's pixels from the colour of their step that limits those
of a mix."""

_HUE_PERCENTILE = 99.5
"""Percentile of the distances of hues."""

_HUE_STEPS = 7
"""Hues of this many neighbouring steps count as those of a step."""

_FAINT = np.float32(1e-5)
"""Light that 8 bits do not show."""

_TINY = np.float32(1e-6)
"""Keeps divisors above 0."""


@dataclass(frozen=True, slots=True)
class Palette:
    """Mean colour of a clip's pixels at each step of their light.

    Light is measured by its fourth root, which is about as even to the eye as 8-bit values are, and
    a colour by the fourth roots of its channels divided by that of its luminance. So a colour is
    the same in the dark.

    Attributes:
        brightest: Fourth root of the luminance of the last step; the first is 0.
        colours: (fine steps, 3) float32, mean colour.
        spread: (fine steps,) float32, how far the colours of the clip's pixels lie from the mean.
        hue_spread: (fine steps,) float32, the same in ΔE of their hues, for nearly all pixels.
    """

    brightest: float
    colours: NDArray[np.float32]
    spread: NDArray[np.float32]
    hue_spread: NDArray[np.float32]

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> "Palette":
        """Learn the colours of a few frames of ``clip``."""
        numbers = evenly_spread(0, clip.count - 1, _FRAMES)
        found = np.concatenate(list(workers.map(lambda i: _some_pixels(clip.read(i)), numbers)))
        light, colours = _light_and_colours(found[None])
        is_bright = light[0] > _FAINT**0.25
        return _learnt(light[0][is_bright], colours[0][is_bright])

    def mix(
        self, one: Pixels, other: Pixels, weight: Plane, light: Plane, coverage: Plane
    ) -> Pixels:
        """Return a mix of two frames with given light and coverage, in colours of the clip.

        Each pixel has the colour of its light. Where both frames deviate from that in the same
        direction, the mix does, too. What only one of them deviates fades out towards the middle.
        No channel exceeds the coverage by more than those of both frames do: colours that need
        more coverage get it.

        Args:
            one, other: (H, W, 4) the frames.
            weight: (H, W) weight of ``other``, 0..1.
            light: (H, W) luminance of the mix.
            coverage: (H, W) the least alpha of the mix.
        """
        root, here, there = self._index(light), self._deviation(one), self._deviation(other)
        smaller = np.minimum(np.abs(here), np.abs(there))
        common = np.where(here * there > 0, np.copysign(smaller, here), np.float32(0))
        nearer = np.where((weight < 0.5)[..., None], here, there)
        deviation = common + np.abs(1 - 2 * weight)[..., None] * (nearer - common)
        most = np.maximum(self.spread[root], _length(common))
        deviation *= np.minimum(1, most / np.maximum(_length(deviation), _TINY))[..., None]
        colour = np.square(np.square(np.maximum(self.colours[root] + deviation, 0)))
        beyond = [np.maximum(brightest(frame) - frame[..., 3], 0) for frame in (one, other)]
        extra = beyond[0] + (beyond[1] - beyond[0]) * weight
        pixels = np.dstack([colour, coverage])
        factor = light / np.maximum(luminance(pixels), _TINY)
        factor = np.minimum(factor, (1 + extra) / np.maximum(brightest(pixels), _TINY))
        pixels[..., :3] *= factor[..., None]
        np.clip(brightest(pixels) - extra, coverage, 1, out=pixels[..., 3])
        return pixels

    def hue_error(self, pixels: Pixels) -> float:
        """Return how far the hues of a frame lie outside of those that the clip has at their light.

        It is a distance in CIELAB's plane of hues, ΔE: the 99.5th percentile over its pixels.
        """
        light, colours = _light_and_colours(_some_pixels(pixels)[None])
        is_bright = light[0] > _FAINT**0.25
        if not is_bright.any():
            return 0.0
        light, colours = light[:, is_bright][0], colours[:, is_bright][0]
        steps = np.minimum(light * np.float32((_FINE_STEPS - 1) / self.brightest), _FINE_STEPS - 1)
        at = np.rint(steps).astype(np.intp)
        errors = _hue_distance(light, colours, self.colours[at]) - self.hue_spread[at]
        return max(float(np.percentile(errors, _HUE_PERCENTILE)), 0.0)

    def _index(self, light: Plane) -> NDArray[np.intp]:
        """Return the step of each luminance; any shape."""
        steps = _fourth_root(light) * np.float32((_FINE_STEPS - 1) / self.brightest)
        return np.asarray(np.minimum(steps + np.float32(0.5), _FINE_STEPS - 1), np.intp)

    def _deviation(self, pixels: Pixels) -> NDArray[np.float32]:
        """Return the difference of each pixel's colour from that of its light, (H, W, 3)."""
        light, colours = _light_and_colours(pixels)
        steps = light * np.float32((_FINE_STEPS - 1) / self.brightest) + np.float32(0.5)
        deviation = colours - self.colours[np.minimum(steps, _FINE_STEPS - 1).astype(np.intp)]
        deviation[light <= _FAINT**0.25] = 0
        return as_plane(deviation)


def _some_pixels(pixels: Pixels) -> Pixels:
    """Return evenly spread pixels of a frame, (n, 4), unmixed."""
    stride = max(1, int((pixels.shape[0] * pixels.shape[1] / _SAMPLES) ** 0.5))
    return pixels[::stride, ::stride].reshape(-1, 4)


def _fourth_root(light: NDArray[np.float32]) -> NDArray[np.float32]:
    return as_plane(cv2.sqrt(cv2.sqrt(light)))


def _length(vectors: NDArray[np.float32]) -> Plane:
    """Return the lengths of vectors (H, W, 3)."""
    return as_plane(np.sqrt(np.einsum("ijk,ijk->ij", vectors, vectors)))


def _light_and_colours(pixels: Pixels) -> tuple[Plane, NDArray[np.float32]]:
    """Return the fourth root of each pixel's luminance, (H, W), and its colour, (H, W, 3)."""
    light = _fourth_root(luminance(pixels))
    channels = _fourth_root(np.ascontiguousarray(pixels[..., :3]))
    return light, as_plane(channels / np.maximum(light, _TINY)[..., None])


def _learnt(light: NDArray[np.float32], colours: NDArray[np.float32]) -> Palette:
    """Return the palette of pixels with these fourth roots of luminance (n,) and colours (n, 3)."""
    if not light.size:
        none = np.zeros(_FINE_STEPS, np.float32)
        return Palette(1.0, np.ones((_FINE_STEPS, 3), np.float32), none, none)
    top = max(float(light.max()), 1e-3)
    steps = np.rint(light * np.float32((_STEPS - 1) / top)).astype(np.intp)
    counts = np.bincount(steps, minlength=_STEPS).astype(np.float64)
    sums = [np.bincount(steps, channel, _STEPS) for channel in colours.T.astype(np.float64)]
    mean = _over_steps(np.array(sums), counts)
    own = as_plane(mean.T[steps])
    lengths = np.linalg.norm(colours - own, axis=1), _hue_distance(light, colours, own)
    usual = np.zeros((2, _STEPS))
    for step in np.flatnonzero(counts):
        here = steps == step
        usual[:, step] = [
            np.percentile(distances[here], percentile)
            for distances, percentile in zip(lengths, (_SPREAD, _HUE_PERCENTILE), strict=True)
        ]
    # A mix may have hues of pixels that are a little darker or brighter.
    usual[1] = cv2.dilate(usual[1:], np.ones((1, _HUE_STEPS), np.uint8))
    spread = _over_steps(usual * counts, counts)
    fine = np.linspace(0, _STEPS - 1, _FINE_STEPS)
    columns = [np.interp(fine, np.arange(_STEPS), row) for row in (*mean, *spread)]
    table = as_plane(np.stack(columns))
    return Palette(top, np.ascontiguousarray(table[:3].T), table[3], table[4])


def _hue_distance(
    light: NDArray[np.float32], one: NDArray[np.float32], other: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the distance, ΔE, of two colours (n, 3) of the same fourth root of luminance (n,)."""
    linear = (np.square(np.square(light[:, None] * colours)) for colours in (one, other))
    return hue_difference(*linear)


def _over_steps(sums: NDArray[np.float64], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means (k, steps) of ``sums`` of ``counts`` values, averaged over neighbouring steps.

    Where few pixels have the light of a step, steps further away count as well.
    """
    distance = np.abs(np.subtract.outer(np.arange(_STEPS), np.arange(_STEPS)))
    near = np.exp(-0.5 * (distance / _SMOOTHING) ** 2)
    near /= near.sum(axis=1, keepdims=True)
    far = 1 / (1.0 + distance) ** 4
    far *= (np.maximum(_FEW - near @ counts, 0) / (far @ counts))[:, None]
    weights = near + far
    return np.asarray((sums @ weights.T) / (weights @ counts))
