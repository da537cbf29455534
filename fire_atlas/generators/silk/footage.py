"""Fire from a clip, cut out and set upright, as images for the sheets."""

from itertools import islice

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import REC709, Pixels, Plane, as_plane, unpremultiply
from fire_atlas.generators.silk.probable import Images, Seeds, probable_motion, synthesise
from fire_atlas.generators.silk.texture import Sequence, framed

_SCENE = 12
"""Frames, evenly spread, that tell what stands still behind a fire."""

_LEAST_AREA = 0.002
"""A clip whose flame covers less of the frame holds no fire."""

_FILLED = 0.84, 0.9
"""How much of a sheet's width and height the fire takes."""

_REACH = 0.05
"""Furthest that anything moves from image to image, image heights."""

_BLEND = 3
"""Images over which a circle is closed."""


def images_of(clip: Clip, count: int, shape: tuple[int, int], name: str) -> Sequence:
    """A circle of ``count`` images of the clip's own fire.

    They are consecutive, from where the clip comes back to itself best.

    Raises:
        SourceError: The clip holds no fire, or too few frames.
    """
    extra = min(_BLEND, count // 3)
    if clip.count < count + extra:
        raise SourceError(
            f"{name}: has {clip.count} frames, but source.texture.images: {count} needs "
            f"{count + extra}; ask for at most {max(clip.count - _BLEND, 4)}, or for "
            f"synthesis: motion"
        )
    cutter = _Cutter(clip, name)
    start = _best_start(clip, count)
    images = [cutter.upright(i, shape) for i in range(start, start + count + extra)]
    return _circle(images, count)


def images_from_seeds(
    clip: Clip,
    seeds: tuple[int, int],
    count: int,
    shape: tuple[int, int],
    name: str,
    seed: int,
    energy: float,
) -> Sequence:
    """A circle of ``count`` images synthesised from two frames of the clip (Appendix B).

    Raises:
        SourceError: The clip holds no fire, or not these frames.
    """
    if max(seeds) >= clip.count or seeds[0] == seeds[1]:
        raise SourceError(
            f"{name}: seeds {list(seeds)} must be two different frames of 0 to {clip.count - 1}"
        )
    cutter = _Cutter(clip, name)
    one, other = (cutter.upright(i, shape) for i in seeds)
    extra = min(_BLEND, count // 3)
    endless = synthesise(Seeds(one, other, _reach(shape)), seed, energy)
    return _circle(list(islice(endless, 4, 4 + count + extra)), count)


class _Cutter:
    """Knows where the fire of a clip is."""

    def __init__(self, clip: Clip, name: str) -> None:
        self._clip = clip
        picks = sorted({round(i) for i in np.linspace(0, clip.count - 1, _SCENE)})
        looks = [clip.read(i) for i in picks]
        self._still: Plane | None = None
        if clip.matte == "none":
            shown = [_luminance(look[..., :3]) for look in looks]
            still, peak = np.minimum.reduce(shown), np.maximum.reduce(shown)
            # What never goes dark but is as bright as only fire is, is its core.
            core = np.clip(still / max(0.35 * float(np.quantile(peak, 0.995)), 1e-6) - 1, 0, 1)
            self._still = as_plane(still * (1 - core))
        lights = [_luminance(self._fire(look)) for look in looks]
        peak = np.maximum.reduce(lights)
        self._level = 0.12 * float(np.quantile(peak, 0.998))
        lit = peak - np.minimum.reduce(lights) > self._level
        warm = np.mean([_is_warm(look[lit]) for look in looks])
        if self._level < 2e-3 or lit.mean() < _LEAST_AREA or warm < 0.3:
            raise SourceError(
                f"{name}: shows no fire: nothing in it is bright, warm and moves; "
                f"source.texture.path needs a clip of fire"
            )
        self._box = _box(np.add.reduce([np.maximum(light - self._level, 0) for light in lights]))

    def _fire(self, look: Pixels) -> NDArray[np.float32]:
        """Light (H, W, 3) of a frame without what stands still."""
        light = look[..., :3]
        if self._still is None:
            return light
        bright = _luminance(light)
        share = np.clip((bright - 1.3 * self._still) / (0.7 * self._still + 1e-3), 0, 1)
        return np.asarray(light * share[..., None], np.float32)

    def upright(self, i: int, shape: tuple[int, int]) -> Images:
        """Frame ``i`` as an image for a sheet: its fire alone, its middle line straight."""
        light = self._fire(self._clip.read(i))
        shines = as_plane(np.clip(_luminance(light) / self._level - 0.5, 0, 1))
        light = light * shines[..., None]
        left, top, right, bottom = self._box
        height, width = shape
        middle = _middle_line(_luminance(light), (left + right) / 2)
        v = (np.arange(height) + 0.5) / height
        rows = bottom - (bottom - top) * (1 - v - 0.05) / _FILLED[1]
        across = ((np.arange(width) + 0.5) / width - 0.5) * (right - left) / _FILLED[0]
        at = np.interp(rows, np.arange(len(middle)), middle)
        columns = at[:, None] + across[None]
        rows = np.broadcast_to(rows[:, None], columns.shape)
        found = cv2.remap(
            light, as_plane(columns), as_plane(rows), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
        )  # fmt: skip
        # What a film showed was exposed already; sheets are exposed again when they are drawn.
        film = -np.log1p(-np.clip(as_plane(found), 0.0, 0.97))
        return as_plane(film * _rounded(shape)[..., None])


def _rounded(shape: tuple[int, int]) -> Plane:
    """Weights (height, width) with soft sides and a round foot: a clip may be cut off straight."""
    height, width = shape
    u = np.abs((np.arange(width) + 0.5) / width - 0.5) * 2
    v = 1 - (np.arange(height) + 0.5) / height
    side = smooth_step((1 - u) / 0.35)
    foot = np.clip((v[:, None] - 0.09 * u[None] ** 2) / 0.07, 0, 1)
    return as_plane(framed(shape) * side[None] * foot)


def _luminance(light: NDArray[np.float32]) -> Plane:
    return as_plane(cv2.transform(np.ascontiguousarray(light), REC709[None]))


def _is_warm(pixels: NDArray[np.float32]) -> float:
    """Share of pixels (n, 4) that are redder than blue, or white-hot."""
    if not len(pixels):
        return 0.0
    colour = unpremultiply(pixels[None])[0]
    return float(np.mean((colour[:, 0] > 1.15 * colour[:, 2]) | (colour.min(axis=1) > 0.8)))


def _box(total: Plane) -> tuple[float, float, float, float]:
    """Left, top, right and bottom, px, of all but a hundredth of the light."""

    def extent(profile: NDArray[np.float32]) -> tuple[float, float]:
        summed = np.cumsum(profile, dtype=np.float64)
        first, last = np.searchsorted(summed, summed[-1] * np.array([0.004, 0.996]))
        return float(first), float(last) + 1

    (left, right), (top, bottom) = extent(total.sum(axis=0)), extent(total.sum(axis=1))
    return left, top, right, bottom


def _middle_line(light: Plane, usual: float) -> NDArray[np.float64]:
    """Column of the fire's middle in every row; where there is little light, the usual one."""
    columns = np.arange(light.shape[1]) + 0.5
    weight = light.sum(axis=1).astype(np.float64)
    sure = 0.05 * max(float(weight.max()), 1e-9)
    middle = ((light * columns).sum(axis=1) + sure * usual) / (weight + sure)
    smooth = cv2.GaussianBlur(middle[:, None], (1, 0), sigmaX=1, sigmaY=len(middle) / 10)
    # Only a lean is taken out, not the tongues' own ways.
    return np.asarray(smooth[:, 0], np.float64)


def _best_start(clip: Clip, count: int) -> int:
    """First of ``count`` frames whose successor looks most like it."""
    last = clip.count - count - min(_BLEND, count // 3)
    starts = sorted({round(float(i)) for i in np.linspace(0, last, 12)})

    def seam(i: int) -> float:
        small = [
            cv2.resize(clip.read(n), (48, 48), interpolation=cv2.INTER_AREA) for n in (i, i + count)
        ]
        return float(np.mean((small[0] - small[1]) ** 2))

    return min(starts, key=seam)


def _reach(shape: tuple[int, int]) -> int:
    return min(max(round(_REACH * shape[0]), 3), 9)


def _circle(images: list[Images], count: int) -> Sequence:
    """The first ``count`` images, the further ones blended into their beginning."""
    extra = len(images) - count
    circle = images[:count]
    for i in range(extra):
        share = np.float32((i + 1) / (extra + 1))
        circle[i] = images[i] * share + images[count + i] * (1 - share)
    reach = _reach(circle[0].shape[:2])
    motion = [probable_motion(circle[n], circle[(n + 1) % count], reach) for n in range(count)]
    smooth = [cv2.GaussianBlur(each, (0, 0), 2.0) for each in motion]
    return Sequence(np.stack(circle), as_plane(np.stack(smooth)))
