"""Make a looping texture from a clip of fire: key out the fire, straighten it and close a loop.

The key differs from the segmentation of ``effect.flame``, which finds the flame's edges in a
picture that is kept whole. Here the light of the fire is needed without the scene behind it,
however dim that light is.
"""

from itertools import islice

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import REC709, Pixels, Plane, as_plane, unpremultiply
from fire_atlas.generators.silk.colour import unexposed
from fire_atlas.generators.silk.motion_synthesis import (
    SeedImages,
    most_probable_motion,
    smooth_motion,
    synthesise_images,
)
from fire_atlas.generators.silk.texture_loop import Image, TextureLoop, edge_fade
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.warp import sample_at

_SAMPLES = 12
"""Number of frames from which the key is made, and number of loop starts that are tried."""

_MIN_AREA = 0.002
"""Minimum fraction of the frame that changing light must cover, or the clip holds no fire."""

_FILL_WIDTH, _FILL_HEIGHT = 0.84, 0.9
"""Fraction of the sheet's width and height that the fire fills."""

_MAX_DISPLACEMENT = 0.05
"""Maximum displacement from one image to the next, image heights."""

_SETTLING = 20
"""Number of synthesised images after which those that drive them are no longer seen."""

_OVERLAP = 3
"""Maximum number of images over which a loop's end is blended into its beginning."""


def cut_texture(clip: Clip, count: int, shape: tuple[int, int], name: str) -> TextureLoop:
    """Cut a loop of ``count`` consecutive frames from a clip, starting where it closes best.

    Args:
        clip: A clip of fire.
        count: Number of images.
        shape: (height, width) of an image, px.
        name: Of the clip, for messages.

    Raises:
        SourceError: The clip holds no fire, or too few frames.
    """
    check_images(count, clip.count, name)
    extra = _extra(count)
    key = _FireKey(clip, name)
    start = _best_start(clip, count)
    images = [key.upright_image(i, shape) for i in range(start, start + count + extra)]
    return _close_loop(images, count)


def synthesise_from_clip(
    clip: Clip,
    seeds: tuple[int, int],
    count: int,
    shape: tuple[int, int],
    name: str,
    seed: int,
) -> TextureLoop:
    """Synthesise a loop of ``count`` images from two frames of a clip, ``seeds`` (Appendix B).

    For ``seed`` see ``synthesise_images``, for the others ``cut_texture``.

    Raises:
        SourceError: The clip holds no fire, or does not have these frames.
    """
    check_seeds(seeds, clip.count, name)
    key = _FireKey(clip, name)
    one, other = (key.upright_image(i, shape) for i in seeds)
    images = synthesise_images(SeedImages(one, other, _search_radius(shape)), seed, count)
    # They repeat once they no longer show the first seeds.
    settled = count * -(-_SETTLING // count)
    return _loop_of(list(islice(images, settled, settled + count)))


def check_images(count: int, available: int, name: str) -> None:
    """Refuse to cut a loop of ``count`` images from a clip of ``available`` frames.

    Raises:
        SourceError: The clip, called ``name``, has too few.
    """
    needed = count + _extra(count)
    if available < needed:
        raise SourceError(
            f"{name}: has {available} frames, but {count} images need {needed}; set "
            f"source.texture.images to at most {max(available - _OVERLAP, 4)}, or use synthesis: "
            f"motion",
            key=("source", "texture", "images"),
        )


def _extra(count: int) -> int:
    """Return how many images more than ``count`` a loop is closed with."""
    return min(_OVERLAP, count // 3)


def check_seeds(seeds: tuple[int, int], available: int, name: str) -> None:
    """Refuse to synthesise from ``seeds`` of a clip of ``available`` frames.

    Raises:
        SourceError: They are not two frames of the clip, which is called ``name``.
    """
    if max(seeds) >= available or seeds[0] == seeds[1]:
        raise SourceError(
            f"{list(seeds)} must be two different frames of {name}: 0 to {available - 1}",
            key=("source", "texture", "seeds"),
        )


class _FireKey:
    """Keys out a clip's fire, the light above its background; refuses clips without fire."""

    def __init__(self, clip: Clip, name: str) -> None:
        self._clip = clip
        samples = [clip.read(i) for i in evenly_spread(0, clip.count - 1, _SAMPLES)]
        self._background: Plane | None = None
        if clip.matte == "none":
            self._background = _background([_luminance(sample[..., :3]) for sample in samples])
        lights = [_luminance(self._fire(sample)) for sample in samples]
        peak = np.maximum.reduce(lights)
        self._threshold = 0.12 * float(np.quantile(peak, 0.998))
        flickers = peak - np.minimum.reduce(lights) > self._threshold
        warm = np.mean([_warm_share(sample[flickers]) for sample in samples])
        if self._threshold < 2e-3 or flickers.mean() < _MIN_AREA or warm < 0.3:
            raise SourceError(
                f"{name}: shows no fire: nothing in it is bright, warm-coloured and moving; "
                f"source.texture.path needs a clip of fire",
                key=("source", "texture", "path"),
            )
        excess = [np.maximum(light - self._threshold, 0) for light in lights]
        self._box = _bounding_box(np.add.reduce(excess))

    def _fire(self, frame: Pixels) -> NDArray[np.float32]:
        """Return the light (H, W, 3) of a frame where it is brighter than the background."""
        light = frame[..., :3]
        if self._background is None:
            return light
        excess = _luminance(light) - 1.3 * self._background
        share = np.clip(excess / (0.7 * self._background + 1e-3), 0, 1)
        return np.asarray(light * share[..., None], np.float32)

    def upright_image(self, i: int, shape: tuple[int, int]) -> Image:
        """Return frame ``i`` as an image for a sheet: the fire alone, its middle line straight."""
        light = self._fire(self._clip.read(i))
        opacity = as_plane(np.clip(_luminance(light) / self._threshold - 0.5, 0, 1))
        light = light * opacity[..., None]
        left, top, right, bottom = self._box
        height, width = shape
        middle = _middle_line(_luminance(light), (left + right) / 2)
        v = (np.arange(height) + 0.5) / height
        rows = bottom - (bottom - top) * (1 - v - 0.05) / _FILL_HEIGHT
        across = ((np.arange(width) + 0.5) / width - 0.5) * (right - left) / _FILL_WIDTH
        columns = np.interp(rows, np.arange(len(middle)), middle)[:, None] + across[None]
        rows = np.broadcast_to(rows[:, None], columns.shape)
        upright = sample_at(light, as_plane(columns), as_plane(rows), border=cv2.BORDER_CONSTANT)
        # Undo the exposure of the filmed clip, because drawing the sheets exposes them again.
        light = unexposed(np.clip(as_plane(upright), 0.0, 0.97))
        return as_plane(light * _flame_fade(shape)[..., None])


def _background(luminances: list[Plane]) -> Plane:
    """Return the luminance of the scene behind the fire: each pixel's minimum over all frames."""
    least, peak = np.minimum.reduce(luminances), np.maximum.reduce(luminances)
    # Pixels that are always as bright as only fire can be are the fire's core, not background.
    core = np.clip(least / max(0.35 * float(np.quantile(peak, 0.995)), 1e-6) - 1, 0, 1)
    return as_plane(least * (1 - core))


def _flame_fade(shape: tuple[int, int]) -> Plane:
    """Return weights (height, width) with soft sides and a round foot, to hide straight cuts."""
    height, width = shape
    u = np.abs((np.arange(width) + 0.5) / width - 0.5) * 2
    v = 1 - (np.arange(height) + 0.5) / height
    side = smooth_step((1 - u) / 0.35)
    foot = np.clip((v[:, None] - 0.09 * u[None] ** 2) / 0.07, 0, 1)
    return as_plane(edge_fade(shape) * side[None] * foot)


def _luminance(light: NDArray[np.float32]) -> Plane:
    return as_plane(cv2.transform(np.ascontiguousarray(light), REC709[None]))


def _warm_share(pixels: NDArray[np.float32]) -> float:
    """Return the share of pixels (n, 4) that are more red than blue, or almost white."""
    if not len(pixels):
        return 0.0
    colour = unpremultiply(pixels[None])[0]
    return float(np.mean((colour[:, 0] > 1.15 * colour[:, 2]) | (colour.min(axis=1) > 0.8)))


def _bounding_box(light: Plane) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom, px, that enclose 99 % of the light along each axis."""

    def extent(profile: NDArray[np.float32]) -> tuple[float, float]:
        summed = np.cumsum(profile, dtype=np.float64)
        first, last = np.searchsorted(summed, summed[-1] * np.array([0.004, 0.996]))
        return float(first), float(last) + 1

    (left, right), (top, bottom) = extent(light.sum(axis=0)), extent(light.sum(axis=1))
    return left, top, right, bottom


def _middle_line(light: Plane, fallback: float) -> NDArray[np.float64]:
    """Return x of the fire's centre of light in every row; near ``fallback`` in dark rows."""
    columns = np.arange(light.shape[1]) + 0.5
    weight = light.sum(axis=1).astype(np.float64)
    prior = 0.05 * max(float(weight.max()), 1e-9)
    middle = ((light * columns).sum(axis=1) + prior * fallback) / (weight + prior)
    # Smooth, so that only the lean of the whole is removed, not the curves of its tongues.
    smooth = cv2.GaussianBlur(middle[:, None], (1, 0), sigmaX=1, sigmaY=len(middle) / 10)
    return np.asarray(smooth[:, 0], np.float64)


def _best_start(clip: Clip, count: int) -> int:
    """Return the first of ``count`` frames such that the frame after them is most like it."""
    last = clip.count - count - min(_OVERLAP, count // 3)

    def seam(i: int) -> float:
        first, successor = (
            cv2.resize(clip.read(n), (48, 48), interpolation=cv2.INTER_AREA) for n in (i, i + count)
        )
        return float(np.mean((first - successor) ** 2))

    return min(evenly_spread(0, last, _SAMPLES), key=seam)


def _search_radius(shape: tuple[int, int]) -> int:
    return min(max(round(_MAX_DISPLACEMENT * shape[0]), 3), 9)


def _close_loop(images: list[Image], count: int) -> TextureLoop:
    """Return the first ``count`` images as a loop: those after them are blended into its start."""
    extra = len(images) - count
    loop = images[:count]
    for i in range(extra):
        share = np.float32((i + 1) / (extra + 1))
        loop[i] = images[i] * share + images[count + i] * (1 - share)
    return _loop_of(loop)


def _loop_of(images: list[Image]) -> TextureLoop:
    """Return images that close as a loop, with the motion from each to the next."""
    radius = _search_radius(images[0].shape[:2])
    following = [*images[1:], images[0]]
    motion = [
        smooth_motion(most_probable_motion(image, after, radius))
        for image, after in zip(images, following, strict=True)
    ]
    return TextureLoop(np.stack(images), as_plane(np.stack(motion)))
