"""Textures of the sheets, the simulated cloths a silk flame is drawn on: loop, start and speed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import as_plane, luminance
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.clip_texture import (
    check_images,
    check_seeds,
    cut_texture,
    synthesise_from_clip,
)
from fire_atlas.generators.silk.colour import ColourMap
from fire_atlas.generators.silk.procedural_texture import INLET_HEIGHT, synthesise_texture
from fire_atlas.generators.silk.raster import Triangles
from fire_atlas.generators.silk.scene import SilkScene
from fire_atlas.generators.silk.simulation import Recording, mean_square_speed
from fire_atlas.generators.silk.texture_loop import Image, TextureLoop
from fire_atlas.recipe.silk import SilkSource, Texture
from fire_atlas.vision.warp import sample_at

_MAX_LOOPS = 6
"""Maximum number of loops of a fuel; further sheets share them, from another image on."""

_PAPER_IMAGES = 8
"""Number of images of a loop that is cut from a clip (section 4)."""

_IMAGES = 4, 96
"""Minimum and maximum number of images of a synthesised loop."""

_IMAGE_HEIGHT = 48, 320
"""Minimum and maximum height of an image, px."""

_MAX_DARK = 1e-4
"""Maximum light that counts as dark and is not drawn."""


@dataclass(frozen=True, slots=True)
class SheetTextures:
    """Texture of every sheet in every frame.

    Attributes:
        loops: The textures, all of one shape.
        texture_index: (sheets,) index of the loop that each sheet plays.
        mirrored: (sheets,) whether it is mirrored left to right.
        phase: (frames, sheets) position in the loop, in images; fractions blend two images.
        rate: (frames, sheets) speed of playing, images per second.
        colours: (frames, sheets) conversion of images to light.
        height: (frames,) height of the flame as shown, relative to that in the images.
        v_rms: (frames, sheets) root mean square speed of the nodes, heights/s.
        burning: (frames, sheets) 0 where a sheet does not burn yet, 1 where it burns fully.
    """

    loops: tuple[TextureLoop, ...]
    texture_index: NDArray[np.intp]
    mirrored: NDArray[np.bool_]
    phase: NDArray[np.float64]
    rate: NDArray[np.float64]
    colours: tuple[tuple[ColourMap, ...], ...]
    height: NDArray[np.float64]
    v_rms: NDArray[np.float64]
    burning: NDArray[np.float64]

    def light(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """Light and optical depth of ``sheets`` in frame ``i``, stacked vertically:
        (n·height, width, 4)."""
        return np.concatenate([self._light(i, s) for s in range(sheets.start, sheets.stop)])

    def motion(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """Luminance, motion right and motion down (texels/s) as channels, stacked likewise."""
        return np.concatenate([self._motion(i, s) for s in range(sheets.start, sheets.stop)])

    def texel_grid(self, sheets: slice, rows: int, columns: int) -> NDArray[np.float64]:
        """Return x and y of each node in the stacked texture: (sheets, rows, columns, 2) texels."""
        height, width = self.loops[0].images.shape[1:3]
        grid = np.empty((sheets.stop - sheets.start, rows, columns, 2))
        grid[..., 0] = np.linspace(0, width - 1, columns)
        grid[..., 1] = np.linspace(height - 1, 0, rows)[:, None]
        grid[..., 1] += (np.arange(len(grid)) * height)[:, None, None]
        return grid

    def opacity_exponents(self, sheets: slice) -> NDArray[np.float64]:
        """Return exponents (sheets, 1, 1, 3) of the sheets' opacity for red, green and blue."""
        exponents = np.stack([colours.opacity_exponents for colours in self.colours[0][sheets]])
        return exponents[:, None, None]

    def dimming(self, sheets: slice, row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how much an optical depth dims red, green and blue, (3, n), of the light at rows
        (n,) of the stacked texture; (3, 1) if it is the same for all ``sheets``."""
        dimming = as_plane(np.stack([colours.dimming for colours in self.colours[0][sheets]]).T)
        if (dimming == dimming[:, :1]).all():
            return dimming[:, :1]
        height = self.loops[0].images.shape[1]
        return dimming[:, ((row + np.float32(0.5)) * np.float32(1 / height)).astype(np.intp)]

    def image(self, i: int, sheet: int) -> Image:
        """Return the image on a sheet in frame ``i``, heat or light: (height, width, n)."""
        image = self.loops[self.texture_index[sheet]].image_at(float(self.phase[i, sheet]))
        if self.mirrored[sheet]:
            image = np.ascontiguousarray(image[:, ::-1])
        return _lowered(image, float(self.height[i]))

    def _light(self, i: int, sheet: int) -> NDArray[np.float32]:
        image = _catching_fire(self.image(i, sheet), np.float32(self.burning[i, sheet]))
        return self.colours[i][sheet].light(image, float(self.v_rms[i, sheet]))

    def _motion(self, i: int, sheet: int) -> NDArray[np.float32]:
        loop, phase = self.loops[self.texture_index[sheet]], float(self.phase[i, sheet])
        motion = loop.motion_from(int(np.floor(phase)) % len(loop))
        height = float(self.height[i])
        rate = float(self.rate[i, sheet])
        right, down = cv2.split(_lowered(motion, height))
        right, down = right * np.float32(rate), down * np.float32(rate * height)
        if self.mirrored[sheet]:
            right, down = -cv2.flip(right, 1), cv2.flip(down, 1)
        return as_plane(cv2.merge((luminance(self._light(i, sheet)), right, down)))


@dataclass(frozen=True, slots=True)
class FadingTextures(SheetTextures):
    """Textures that fade into those of the same sheets in another wind.

    Attributes:
        after: The textures in the other wind.
        share: (frames,) weight of ``after`` in each frame, 0..1.
    """

    after: SheetTextures
    share: NDArray[np.float64]

    @classmethod
    def between(
        cls, before: SheetTextures, after: SheetTextures, share: NDArray[np.float64]
    ) -> "FadingTextures":
        """Return textures that fade from ``before`` into ``after``."""
        played = before.loops, before.texture_index, before.mirrored, before.phase, before.rate
        burning = before.colours, before.height, before.v_rms, before.burning
        return cls(*played, *burning, after, share)

    def light(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """See ``SheetTextures.light``."""
        return self._faded(i, SheetTextures.light(self, i, sheets), self.after.light(i, sheets))

    def motion(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """See ``SheetTextures.motion``."""
        return self._faded(i, SheetTextures.motion(self, i, sheets), self.after.motion(i, sheets))

    def _faded(
        self, i: int, before: NDArray[np.float32], after: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        return as_plane(before + (after - before) * np.float32(self.share[i]))


def _lowered(image: Image, height: float) -> Image:
    """Return an image of a fire with a flame ``height`` times as high, 0..1: the part above its
    foot, squeezed."""
    if height == 1:
        return image
    rows, columns = image.shape[:2]
    up = 1 - (np.arange(rows) + 0.5) / rows
    from_up = np.where(up > INLET_HEIGHT, INLET_HEIGHT + (up - INLET_HEIGHT) / height, up)
    y = np.broadcast_to(((1 - from_up) * rows - 0.5)[:, None], (rows, columns))
    x = np.broadcast_to(np.arange(columns, dtype=np.float64), (rows, columns))
    lowered = sample_at(image, x, y, border=cv2.BORDER_CONSTANT)
    return as_plane(lowered).reshape(image.shape)


def _catching_fire(image: Image, burning: np.float32) -> Image:
    """Return an image of a fire of which the part ``burning`` burns, 0..1.

    Heat falls as the fuel burns down on its way up. Where less fuel comes, it is used up sooner: so
    the flame is shorter. An image of light is dimmer instead.
    """
    if burning == 1:
        return image
    return image * burning if image.shape[2] == 3 else np.maximum(image - (1 - burning), 0)


def cull_dark(triangles: Triangles, light: NDArray[np.float32]) -> Triangles:
    """Drop triangles whose texture is dark, which is most of a sheet."""
    # Along a short axis numpy is slow, so that corners are taken one by one.
    corners = [triangles.attributes[:, corner, :2] for corner in range(3)]
    low = np.floor(reduce(np.minimum, corners)).astype(np.intp)
    high = np.ceil(reduce(np.maximum, corners)).astype(np.intp) + 1
    # A summed-area table: four entries give the number of bright values in any box of texels, whose
    # channels lie side by side.
    height, width, channels = light.shape
    table = cv2.integral((light > _MAX_DARK).view(np.uint8).reshape(height, width * channels))
    x0, y0 = low[:, 0] * channels, low[:, 1]
    x1, y1 = np.minimum(high[:, 0], width) * channels, np.minimum(high[:, 1], height)
    is_lit = table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0] > 0
    return Triangles(triangles.position[is_lit], triangles.attributes[is_lit])


def make_textures(
    source: SilkSource,
    settings: GenerationSettings,
    footage: Clip | None,
    scene: SilkScene,
    recording: Recording,
) -> SheetTextures:
    """Make the textures that a recipe describes and assign them to the recorded sheets.

    They come from ``footage``, a clip of fire, or are procedural.

    Raises:
        SourceError: The clip holds no fire, or too few frames.
    """
    if isinstance(source.texture, Texture) and footage is not None:
        shape, _ = _image_shape(source, scene)
        loops = [_from_clip(source.texture, footage, shape, settings.seed, scene, recording)]
        texture_index = np.zeros(scene.model.sheets, np.intp)
    else:
        loops, texture_index = _procedural(source, settings, scene, recording)
    played = _played(scene, recording)
    colours = _colours(source, scene, len(recording.x))
    return _play(loops, texture_index, played, recording, scene, colours, settings)


def check_texture(texture: Texture, available: int) -> None:
    """Refuse what cannot be made of a clip of ``available`` frames, as far as their number tells.

    Raises:
        SourceError: There are too few.
    """
    if texture.synthesis == "none":
        check_images(texture.images or _PAPER_IMAGES, available, texture.path)
    elif texture.seeds is not None:
        check_seeds(texture.seeds, available, texture.path)


def _colours(
    source: SilkSource, scene: SilkScene, frames: int
) -> tuple[tuple[ColourMap, ...], ...]:
    """Return the colours of every sheet in every frame.

    They are those of its fuel in the oxygen there is, as bright as its fire is sparse.
    """
    fires = list(zip(scene.fuels, scene.fires, strict=True))
    divisors = {fire: _light_divisor(scene, fire) for fire in set(scene.fires)}

    @cache
    def colours(oxygen: float) -> tuple[ColourMap, ...]:
        maps = {
            (fuel, fire): ColourMap.of(
                fuel, source.grading, oxygen, source.intensity / divisors[fire], source.soot
            )
            for fuel, fire in set(fires)
        }
        return tuple(maps[pair] for pair in fires)

    return tuple(colours(scene.controls.oxygen.at(n / scene.fps)) for n in range(frames))


def _play(
    loops: Sequence[TextureLoop],
    texture_index: NDArray[np.intp],
    played: NDArray[np.float64],
    recording: Recording,
    scene: SilkScene,
    colours: tuple[tuple[ColourMap, ...], ...],
    settings: GenerationSettings,
) -> SheetTextures:
    """Play on every sheet its loop, from a random image on (section 4).

    If the result loops, each sheet plays its texture a whole number of times, so that it shows
    about ``played`` images: its rate is multiplied by what that takes.
    """
    sheets = recording.rate.shape[1]
    images = np.array([len(loops[k]) for k in texture_index])
    chance = generator(settings.seed, RandomStream.SHEETS, 1)
    # Starts are spread evenly over the loop and then shuffled, so that no two are alike.
    start = (chance.permutation(sheets) + chance.uniform(0, 0.8, sheets)) / sheets * images
    rate = recording.rate.copy()
    if settings.loop:
        times = np.maximum(np.rint(played / images), 1)
        rate *= times * images * settings.fps / rate[:-1].sum(axis=0)
    passed = np.concatenate([np.zeros((1, sheets)), np.cumsum(rate[:-1], axis=0) / settings.fps])
    phase = np.mod(start + passed, images)
    if settings.loop:
        # Rounding errors would make the end differ in the last bits.
        phase[-1] = phase[0]
    controls = scene.controls
    # A clip's fire is as high as its sheet at a pressure of 1 already.
    painted = loops[0].images.shape[-1] == 1
    highest = controls.greatest_height if painted else 1.0
    height = [min(controls.flame_height(n / scene.fps), highest) for n in range(len(rate))]
    return SheetTextures(
        loops=tuple(loops),
        texture_index=texture_index,
        mirrored=np.asarray(chance.random(sheets) < 0.5),
        phase=phase,
        rate=rate,
        colours=colours,
        height=np.array(height) / highest,
        v_rms=recording.v_rms,
        burning=np.ones(rate.shape),
    )


def _from_clip(
    texture: Texture,
    clip: Clip,
    shape: tuple[int, int],
    seed: int,
    scene: SilkScene,
    recording: Recording,
) -> TextureLoop:
    if texture.synthesis == "none":
        return cut_texture(clip, texture.images or _PAPER_IMAGES, shape, texture.path)
    images = texture.images or _loop_length(float(_played(scene, recording).mean()))
    middle = max(clip.count // 2 - 1, 0)
    seeds = texture.seeds or (middle, min(middle + 1, clip.count - 1))
    return synthesise_from_clip(clip, seeds, images, shape, texture.path, seed)


def _procedural(
    source: SilkSource, settings: GenerationSettings, scene: SilkScene, recording: Recording
) -> tuple[list[TextureLoop], NDArray[np.intp]]:
    """Synthesise loops, and assign one to every sheet: (loops, index of each sheet's loop).

    A loop has as many images as its sheets play in all frames. Sheets that play about as many share
    one, so that all can play theirs a whole number of times without a change of their speeds.
    """
    shape, aspect = _image_shape(source, scene)
    played = _played(scene, recording)
    loops: list[TextureLoop] = []
    texture_index = np.empty(scene.model.sheets, np.intp)
    for fuel in dict.fromkeys(scene.fuels):
        height = fuel.burner.flame_height * scene.controls.greatest_height
        burner = replace(fuel.burner, flame_height=height)
        sheets = np.flatnonzero([sheet_fuel == fuel for sheet_fuel in scene.fuels])
        slow_to_fast = sheets[np.argsort(played[sheets], kind="stable")]
        for group in np.array_split(slow_to_fast, min(len(sheets), _MAX_LOOPS)):
            images = _loop_length(float(played[group].mean()))
            texture_index[group] = len(loops)
            loops.append(
                synthesise_texture(burner, images, shape, aspect, settings.seed, len(loops))
            )
    return loops, texture_index


def _played(scene: SilkScene, recording: Recording) -> NDArray[np.float64]:
    """Return how many images every sheet plays in all frames, (sheets,).

    In a loop a sheet plays more than those of its fuel with a lower mean v_rms² (eq. 17). The limit
    on rates cuts off more of a sheet that is fast at times, so that their sums can have another
    order.
    """
    if not recording.loops:
        return np.asarray(recording.rate.sum(axis=0) / scene.fps)
    # The last entry of a loop repeats the first.
    played = recording.rate[:-1].sum(axis=0) / scene.fps
    energy = np.mean([mean_square_speed(velocity) for velocity in recording.v[:-1]], axis=0)
    for fuel in set(scene.fuels):
        sheets = np.flatnonzero([sheet_fuel == fuel for sheet_fuel in scene.fuels])
        played[sheets[np.argsort(energy[sheets], kind="stable")]] = np.sort(played[sheets])
    return np.asarray(played)


def _loop_length(played: float) -> int:
    """Return the length of a loop of which ``played`` images are played: once, if it is not too
    long for that."""
    least, most = _IMAGES
    return max(round(played / math.ceil(played / most)), least)


def _image_shape(source: SilkSource, scene: SilkScene) -> tuple[tuple[int, int], float]:
    """Return ((height, width) px, aspect) of images about as fine as the frame shows them."""
    heights, widths = _sheet_sizes(scene)
    least, most = _IMAGE_HEIGHT
    height = int(np.clip(round(0.8 * float(heights.max()) * source.height), least, most))
    aspect = float((widths / heights).mean())
    return (height, int(np.clip(round(height * aspect), least // 2, 2 * most))), aspect


def _sheet_sizes(scene: SilkScene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the heights and widths (sheets,) of all sheets at rest, frame heights."""
    rest = scene.model.rest
    up, across = rest[:, -1, 0] - rest[:, 0, 0], rest[:, 0, -1] - rest[:, 0, 0]
    return np.sqrt((up * up).sum(axis=-1)), np.sqrt((across * across).sum(axis=-1))


def _light_divisor(scene: SilkScene, fire: int) -> float:
    """Return the divisor of the light of each sheet of a fire that keeps overlapping sheets from
    being too bright; the power 0.75 of the mean overlap leaves a fire of more sheets somewhat
    brighter."""
    of_fire = np.equal(scene.fires, fire)
    _, widths = _sheet_sizes(scene)
    ground = scene.model.rest[of_fire][:, 0, :, :2].reshape(-1, 2)
    extent = float(np.ptp(ground, axis=0).max())
    # 0.64 is 2/π, the mean of |cos|: the apparent width of a sheet seen from a random side.
    overlap = 0.64 * float(widths[of_fire].sum()) / max(extent, 1e-6)
    return float(max(1.0, overlap) ** 0.75)
