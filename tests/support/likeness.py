"""How like its clip a generated fire is: what tests and the benchmark of profiles measure."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import repeat
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Pixels, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate
from fire_atlas.generators.profile.fire import learn_profile
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    ProfileFireSettings,
)
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.generators.profile.learn.colour_table import cell_sums, colour_table
from fire_atlas.generators.profile.learn.features import FireMask, feature_points, flame_lean
from fire_atlas.generators.profile.model import ColourTable, FeaturePoints, Profile
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind
from tests.generators.profile.colour_difference import delta_e, lab_of
from tests.generators.profile.flames import swaying
from tests.support.clips import open_clip, proxied

Array = NDArray[np.float64]

REAL = (
    "real_candle_red",
    "sim_unity_flame03",
    "cartoon_tauran_flame_sheet",
    "real_fireplace_gif",
    "cartoon_wesnoth_campfire",
)
"""The clips a generated fire is held against."""


@dataclass(frozen=True, slots=True)
class Look:
    """What is seen of a fire, frame by frame.

    Attributes:
        points: Six points of every frame.
        leans: (frames,) lean of the flame, degrees.
        table: Its colour table.
        frames: The fire alone.
    """

    points: list[FeaturePoints]
    leans: Array
    table: ColourTable
    frames: list[Pixels]

    @property
    def height(self) -> float:
        return float(np.median([each.height for each in self.points]))

    @property
    def width(self) -> float:
        return float(np.median([each.width for each in self.points]))

    @property
    def steps(self) -> Array:
        """Root of the summed squared difference of neighbouring frames, linear light."""
        pairs = zip(self.frames, self.frames[1:], strict=False)
        return np.array([np.sqrt(((b - a) ** 2).sum()) for a, b in pairs])


def learnt(*clips: Clip, **options: Any) -> Profile:
    """Learn a profile of one clip, or of two at a right angle."""
    with Workers(2) as workers:
        return learn_profile(
            {f"clip {i}": proxied(clip) for i, clip in enumerate(clips)}, workers, **options
        )


@cache
def learnt_kite() -> Profile:
    """Learn the profile of a kite that sways."""
    return learnt(swaying()[0])


@cache
def learnt_from(name: str, height: Literal["source"] | None = None) -> Profile:
    """Learn the profile of a sample or a real clip as ``open_clip`` opens it."""
    return learnt(open_clip(name, height))


def settings(
    frames: int = 48,
    fps: float = 24.0,
    wind: Wind | None = None,
    seed: int = 0,
    loop: bool = True,
    slices: int = 12,
    particles: int = 100,
    detail: float = 1.0,
) -> ProfileFireSettings:
    """Return what a recipe would set of a fire."""
    generation = GenerationSettings(seed, wind or Wind(), frames, fps, loop, Views())
    return ProfileFireSettings(generation, slices, particles, detail)


def fire_of(profile: Profile, wanted: ProfileFireSettings) -> GeneratedFire:
    """Generate fire, to be seen by any number of cameras."""
    with Workers(2) as workers:
        return calibrate(profile, wanted, workers).fire


def seen(
    fire: GeneratedFire,
    azimuths: Sequence[float] = (0.0,),
    height: int | None = None,
    elevation: float = 0.0,
) -> list[Clip]:
    """Return a clip of a fire from each azimuth."""
    views = renderings(fire, azimuths, elevation, height)
    return [rendered_clip(view, fire.settings, "srgb", ()) for view in views]


def generated(
    profile: Profile,
    wanted: ProfileFireSettings,
    azimuths: Sequence[float] = (0.0,),
    height: int | None = None,
) -> list[Clip]:
    """Generate fire, and return a clip of it from each azimuth."""
    return seen(fire_of(profile, wanted), azimuths, height)


@cache
def learnt_narrow_and_wide() -> Profile:
    """Learn the profile of a flame that is 28 px wide from the front, and 60 px from its side."""
    return learnt(swaying(half=14.0)[0], swaying(half=30.0)[0])


def look_at_clip(clip: Clip, cells: int = 5) -> Look:
    """Look at the fire of a clip as learning does."""
    return _look(clip, FireMask.of(clip), cells)


def look_at_fire(clip: Clip, threshold: float, cells: int = 5) -> Look:
    """Look at generated fire: there is nothing else in its frames."""
    everywhere = np.ones((clip.height, clip.width), np.float32)
    return _look(clip, FireMask(threshold, everywhere, everywhere, False, clip.blend_space), cells)


def _look(clip: Clip, mask: FireMask, cells: int) -> Look:
    frames, flames = [], []
    for i in range(clip.count):
        pixels = clip.read(i)
        binarized = mask.binarized(pixels)
        frames.append(mask.isolated(pixels))
        flames.append(largest_flame(binarized))
    table = colour_table(np.sum([*map(cell_sums, frames, flames, repeat(cells))], axis=0))
    lit = [flame for flame in flames if flame.any()]
    leans = np.array([flame_lean(flame) for flame in lit])
    return Look([feature_points(flame) for flame in lit], leans, table, frames)


def colour_error(one: ColourTable, other: ColourTable, least: float = 0.05) -> float:
    """Largest ΔE2000 of two tables, of the cells that both fill to at least ``least``."""
    filled = (one.coverage > least) & (other.coverage > least)
    return float(delta_e(lab_of(one.colours), lab_of(other.colours))[filled].max())


def silhouette(pixels: Pixels) -> tuple[float, float, float]:
    """Area (px) of what is at least half covered, and the centroid (x, y) of all coverage."""
    alpha = pixels[..., 3].astype(np.float64)
    total = max(float(alpha.sum()), 1e-9)
    height, width = alpha.shape
    x = float((alpha.sum(axis=0) * (np.arange(width) + 0.5)).sum()) / total
    y = float((alpha.sum(axis=1) * (np.arange(height) + 0.5)).sum()) / total
    return float(np.count_nonzero(alpha >= 0.5)), x, y


def detail(pixels: Pixels) -> float:
    """Share of a frame's light (its root, as the eye has it) that is finer than a pixel or two."""
    light = np.sqrt(np.maximum(luminance(pixels), 0))
    fine = light - cv2.GaussianBlur(light, (0, 0), 1.0)
    return float(np.sqrt(np.square(fine).sum() / np.square(light).sum()))


def deepest_nick(pixels: Pixels) -> float:
    """Largest bend of a flame's outline within a row, px: the second difference by row of where its
    sides are, between pixels, in the upper half of what is at least half covered."""
    alpha = pixels[..., 3].astype(np.float64)
    rows = np.flatnonzero((alpha >= 0.5).any(axis=1))
    upper = alpha[rows[1] : rows[0] + len(rows) // 2]
    return max(float(np.abs(np.diff(_edge(side), 2)).max()) for side in (upper, upper[:, ::-1]))


def _edge(alpha: Array) -> Array:
    """Where each row is half covered first, from the left, px."""
    first = (alpha >= 0.5).argmax(axis=1)
    row = np.arange(len(alpha))
    inside, outside = alpha[row, first], alpha[row, first - 1]
    return np.asarray(first - (inside - 0.5) / (inside - outside), np.float64)


def nearest_input(frames: Sequence[Pixels], inputs: Sequence[Pixels]) -> float:
    """Least difference of any of ``frames`` from any of ``inputs``, whose flames are laid over its
    own, as a share of the frame's light. Large frames are compared at half their size, at which
    they are, if anything, more alike."""
    scale = 0.5 if len(inputs[0]) > 160 else 1.0
    others = [_lit_part(frame, scale) for frame in inputs]
    return min(_least_difference(_lit_part(frame, scale), others) for frame in frames)


def _least_difference(lit: Pixels, others: Sequence[Pixels]) -> float:
    best = np.inf
    # A flame that is moved further than half its size is hardly over the other any more.
    y, x = (length // 2 for length in lit.shape[:2])
    for other in others:
        more_y, more_x = (max(lit.shape[axis] - other.shape[axis], 0) for axis in (0, 1))
        room = cv2.copyMakeBorder(other, y, y + more_y, x, x + more_x, cv2.BORDER_CONSTANT)
        found = cv2.matchTemplate(room, lit, cv2.TM_SQDIFF).min()
        best = min(best, float(found))
    return float(np.sqrt(max(best, 0.0) / float((lit**2).sum())))


def _lit_part(frame: Pixels, scale: float) -> Pixels:
    """The colours of what is lit in a frame, of the box around it, at a scale."""
    lit = brightest(frame) > 1e-3
    rows, columns = np.flatnonzero(lit.any(axis=1)), np.flatnonzero(lit.any(axis=0))
    part = frame[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1, :3]
    return np.asarray(cv2.resize(part, None, None, scale, scale, cv2.INTER_AREA), np.float32)
