"""The first pass over a clip: features, flow and births of every frame, and the recorded field.

Frames are looked at in the pool; the air is carried from one to the next in one thread.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window, cropped
from fire_atlas.core.picture import as_light, brightness_of
from fire_atlas.core.pixels import Bytes, Plane, magnitude
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.field.air import grid_shape
from fire_atlas.effect.field.ambient import Ambient
from fire_atlas.effect.field.buoyancy import Drive, Physics, advance, settle
from fire_atlas.effect.field.drive import cell_means, flow_on_grid, rising
from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.record import FieldRecord, overlap_frames
from fire_atlas.effect.flakes.drawing import drawn_width
from fire_atlas.effect.flakes.emission import Brood, Spawns, crackle, emit, plenty
from fire_atlas.effect.flame.features import feature_vectors, refine
from fire_atlas.effect.flame.palette import clip_palette
from fire_atlas.effect.flame.scene import above
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.recipe.effect import Flakes
from fire_atlas.recipe.models import Recipe
from fire_atlas.vision.flow import SMALL, optical_flow, shrunk_flow, thumbnail

_MANY = 5
"""So many births are not left out by chance."""

_LEAD = 0.5
"""Last seconds of a loop that the air meets before its first frame, to begin as it ends."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """What is known of a clip once all its frames were seen.

    Attributes:
        study, field: What holds for the clip, and the recorded field.
        spawns: Births of all flakes.
        palette: (colours, 3) sRGB in 0..1 that flakes are limited to, if the recipe says so.
    """

    study: FlameStudy
    field: FieldRecord
    spawns: Spawns
    palette: NDArray[np.float32] | None


@dataclass(frozen=True, slots=True)
class _FrameLook:
    """What one frame of the clip says, before its neighbours are known.

    Attributes:
        thumb: (h, w) uint8, for the optical flow.
        flow: (h, w, 2), px of the thumbnail a frame, where the clip knows its own motion.
        mask: (H, W) float32, how surely each pixel is flame.
        lit: (rows, columns), how bright each cell is, 0..1.
        feature_x, feature_y: (rows, columns), mean Fv* of each cell in typical lengths.
        spawns: Flakes born in this frame.
        is_reversed: Whether the clip goes backwards from this frame to the next.
    """

    thumb: Bytes
    flow: NDArray[np.float32] | None
    mask: Plane
    lit: Plane
    feature_x: Plane
    feature_y: Plane
    spawns: Spawns
    is_reversed: bool


def analyse(
    clip: Clip, recipe: Recipe, study: FlameStudy, workers: Workers, progress: Progress
) -> Analysis:
    """Find features, flow and births of every frame and record the buoyancy field."""
    progress.stage("analyse", clip.count)
    brood = _brood(clip, recipe, study)
    physics = Physics.of(recipe.buoyancy, clip.height)
    lead = min(max(1, round(_LEAD * clip.fps)), clip.count) if clip.loop else 0
    order = [*range(clip.count - lead, clip.count), *range(clip.count - lead)]
    # The paper's candidates are anywhere in the image; else only where something moves.
    everywhere = recipe.features.preset == "paper"
    window = (
        Window(0, 0, clip.width, clip.height) if everywhere else study.active_window(physics.cell)
    )
    part, known = cropped(clip, window), study.within(window)
    is_small = clip.width * clip.height <= SMALL
    looks = workers.map(lambda i: _look(i, part, recipe, known, brood, is_small), order)
    births: dict[int, Spawns] = {}

    def drives() -> Iterator[Drive]:
        pairs = _pairs(looks, clip.loop)
        met = workers.map(lambda pair: _drive(pair, part, known, physics, is_small), pairs)
        row, column = window.top // physics.cell, window.left // physics.cell
        shape = grid_shape(clip.width, clip.height, physics.cell)
        for i, (spawns, drive) in zip(order, met, strict=True):
            births[i] = spawns.moved(window.left, window.top)
            progress.advance()
            yield drive.placed(row, column, shape)

    field = _record(_met_by_the_air(drives(), clip, lead), clip, recipe, physics)
    palette = clip_palette(clip, workers) if recipe.composite.palette == "clip" else None
    spawns = Spawns.joined([births[i] for i in sorted(births)])
    if study.burns_out and not clip.loop and not clip.tail:
        spawns = spawns.cold_by((clip.count - 1) / clip.fps)
    if not len(spawns.tick) and brood.rate * clip.body / clip.fps > _MANY:
        progress.note(
            "no flake is born: nothing in the clip is flame that moves, or features.epsilon, "
            "features.clamp or flakes.alpha is above all of its edges"
        )
    return Analysis(study, field, spawns, palette)


def _record(
    drives: Iterator[tuple[int, Drive]], clip: Clip, recipe: Recipe, physics: Physics
) -> FieldRecord:
    """Carry the air through all ``drives`` (frame, drive) and record it from frame 0 on."""
    shape = grid_shape(clip.width, clip.height, physics.cell)
    field = FieldRecord.blank(clip.count, shape, physics.cell, clip.fps, clip.loop)
    speed = recipe.buoyancy.turbulence * clip.height
    period = clip.count / clip.fps if clip.loop else None
    eddies = Eddies.random(recipe.seed, shape[0], speed, period)
    ambient = Ambient(eddies, recipe.wind, clip.height)
    air = None
    for n, drive in drives:
        air = air or settle(drive, ambient, physics, shape)
        air = advance(air, drive, ambient, physics, n / clip.fps, 1 / clip.fps)
        if n >= 0:
            field.write(n, air, drive.lit)
    return field


def _met_by_the_air(drives: Iterator[Drive], clip: Clip, lead: int) -> Iterator[tuple[int, Drive]]:
    """Frames and their drives in the order in which the air meets them.

    ``drives`` are those of the last ``lead`` frames of a loop, then all others; with a lead of 0
    they are those of a clip that plays once. A loop's last frames come before its first one, again
    at its end, and then some frames more, for the end to pass into the beginning.
    """
    count, overlap = clip.count, overlap_frames(clip.fps) if lead else 0
    last = list(islice(drives, lead))
    yield from zip(range(-lead, 0), last, strict=True)
    first = []
    for n, drive in enumerate(drives):
        if n < overlap:
            first.append(drive)
        yield n, drive
    yield from zip(range(count - lead, count), last, strict=True)
    if lead:
        # Where the loop is so short that its first frames are among its last, these follow.
        again = first + last
        yield from ((count + n, again[n % count]) for n in range(overlap))


def _brood(clip: Clip, recipe: Recipe, study: FlameStudy) -> Brood:
    """What the recipe says of newborn flakes, in px and s."""
    # Without flakes the flame may still be blurred along the field: nothing is born then.
    flakes = recipe.flakes if isinstance(recipe.flakes, Flakes) else Flakes(rate=0, bursts=0)
    size = (flakes.size[0] * clip.height, flakes.size[1] * clip.height)
    middling = np.sqrt(size[0] * size[1])
    shown = float(middling / drawn_width(middling, flakes.sprite == "pixel"))
    seconds = math.inf if clip.loop else clip.body / clip.fps
    rate = plenty(study.extent, shown, seconds) if flakes.rate == "auto" else flakes.rate
    return Brood(
        seed=recipe.seed,
        rate=rate,
        bursts=crackle(rate) if flakes.bursts == "auto" else flakes.bursts,
        candidates=study.candidates,
        alpha=study.alpha if flakes.alpha == "auto" else flakes.alpha,
        life=flakes.life,
        size=size,
        height=clip.height,
        fps=clip.fps,
    )


def _look(
    i: int, clip: Clip, recipe: Recipe, study: FlameStudy, brood: Brood, is_small: bool
) -> _FrameLook:
    """Everything a frame says on its own: runs in the pool."""
    picture = clip.picture(i)
    bright = brightness_of(picture, clip.blend_space)
    mask = study.mask.of(bright, lambda: as_light(picture))
    features, cell = recipe.features, recipe.buoyancy.cell
    fx, fy = refine(
        *feature_vectors(bright, features.sigma, study.epsilon, study.kappa),
        study.buoyancy, features.beta, features.clamp,
    )  # fmt: skip
    strength = magnitude(fx, fy)
    if features.preset == "auto":
        strength = strength * mask
    unit = np.float32(1 / study.typical)
    thumb = thumbnail(bright, is_small)
    height, width = thumb.shape
    return _FrameLook(
        thumb,
        None if clip.flow is None else shrunk_flow(clip.flow(i), (height, width), clip.fps),
        mask,
        cell_means(above(bright, study.mask.dim, study.mask.bright), cell),
        cell_means(fx, cell) * unit,
        cell_means(fy, cell) * unit,
        emit(i, strength, brood) if i < clip.body else Spawns.none(),
        i in clip.backwards,
    )


def _drive(
    pair: "tuple[_FrameLook, _FrameLook, bool]",
    clip: Clip,
    study: FlameStudy,
    physics: Physics,
    is_small: bool,
) -> tuple[Spawns, Drive]:
    """Births and drive of a frame, now that its neighbour is known: runs in the pool."""
    here, other, is_last = pair
    # Where nothing follows, motion goes on as before; where the clip runs backwards, the gas of the
    # flame does not.
    before, after = (other, here) if is_last or here.is_reversed else (here, other)
    flow = here.flow
    if flow is None:
        flow = optical_flow(before.thumb, after.thumb, is_small)
    u, v = flow_on_grid(flow, here.mask, (clip.width, clip.height), physics.cell, clip.fps)
    u, v = rising(u, v, study.buoyancy)
    flame = cell_means(here.mask, physics.cell)
    return here.spawns, Drive(flame, here.lit, u, v, here.feature_x, here.feature_y)


def _pairs(
    looks: Iterator[_FrameLook], closes: bool
) -> Iterator[tuple[_FrameLook, _FrameLook, bool]]:
    """Each look with the one that follows it.

    In a circle that ``closes`` the first follows the last. Otherwise nothing does: the last comes
    with the one before it, and True.
    """
    first = previous = here = next(looks)
    for following in looks:
        yield here, following, False
        previous, here = here, following
    yield (here, first, False) if closes else (here, previous, True)
