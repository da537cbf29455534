"""Appearance: width, streak, colour and light of flying flakes, as rows of the tracks.

An ember is as wide as the pixels and the lens show it; its streak follows eq. 17. It has the one
colour of hot charcoal, or colours by its speed (Figure 9).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, pairwise, repeat

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane, decode_unit
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.brightness import (
    defocus,
    ember_brightness,
    flicker,
    held_share,
    light_over_life,
)
from fire_atlas.effect.flakes.drawing import HALO_WIDTH, SEEN_LENGTH, drawn_width
from fire_atlas.effect.flakes.emission import SPARK, TICK, Spawns
from fire_atlas.effect.flakes.particles import FlakeView, ParticleState
from fire_atlas.effect.flakes.texture import MIN_WIDTH, TextureCells
from fire_atlas.effect.flakes.tracks import COLUMNS
from fire_atlas.vision.pixel_grid import PixelGrid

Column = NDArray[np.float64]

EMBER_LIGHT = (1.0, 0.123, 0.014)
"""Linear R, G, B of a glowing ember, a black body of about 1400 K: all embers have this colour, and
only exposure, which compresses bright light, makes the bright ones yellow."""

_FULL_SPEED, _FULL_SPEED_OF_PAPER = 0.9, 0.3
"""Speed, heights/s, at which a flake has the last of the colours; with the paper's preset, whose
fields are slower."""

_BORDER, _BORDER_FRAMES = 0.05, 3.0
"""Flakes fade in a strip along the frame's border. It is the larger of this many heights and the
distance that the flake travels in this many frames."""

_MAX_HALF_LENGTH = 0.25
"""Limit on a sprite's half length in the border fade, as a fraction of the frame's shorter side: a
larger sprite would be at the border wherever it is."""

_OUT_OF_FOCUS, _DEFOCUS = 0.4, (1.5, 3.4)
"""Share of embers out of focus, and by how much the lens makes them wider, in widths of the median
one: the least and the most."""

_BLINDING = 2.0
"""Light from which embers are in focus: as large, bright discs they would be all that one sees."""

_HOT = 4.0
"""Light from which an ember is at most as wide as the median one, and one that would be wider is as
much narrower: small ones burn hottest, and a large one that overexposes the film is a pale bar,
without the core and rim of those in footage."""

_SPARK = 1.7
"""Light of a spark relative to that of an ember: what is thrown comes from the hottest part."""

_WIDE = 0.65
"""Power of the ratio of widths above the median to it: wide ones of middling light are even, brown
bars."""

_DIMMED_BY_LENGTH = 0.35
"""How much the light of a pixel falls with the length of a streak, in widths."""

_GLARE = (0.06, 0.4)
"""Light of the flame as shown, linear, from which an ember is dimmer there, and from which it is
lost. Film shows little of what is added to a light near white; but the green and blue of flames are
graded darker than their red, and would still show all that an ember adds to them, as beige."""

_PIXEL_SHADES = 3
"""Number of brightness steps of hard flakes."""

_BRIGHTEST_SHOWN = 0.98
"""Light up to which a colour of pixel art is met: film shows 1 of endless light alone."""

_EVEN_LIGHT, _EVEN_HELD = 5.0, 0.225
"""Light of all flakes where none is brighter than another, and the fraction of its life from which
each dies: about the means of those that differ."""

_PIXEL_LIGHT = 11.0
"""Light of all hard flakes: that of bright ones, because so few shades cannot show dim ones."""

_BATCH = 4096
"""Minimum number of flakes per numpy call: a call for only a few takes as long."""

_FLICKERS = 1 << 12
"""Number of flickers computed. Flakes whose ids are this far apart share one, unseen."""


@dataclass(frozen=True, slots=True)
class Appearance:
    """How the flakes of a recipe look.

    Attributes:
        seed: The recipe's seed.
        colours: (stops, 3) linear light by speed, slow to fast, of hard squares by age, old to
            young; one stop for one colour.
        intensity: Factor of the light of all flakes.
        stretch: Streak length besides motion blur, in frames of travel.
        shutter: Fraction of a frame during which the shutter is open.
        kappa: (H, W) κ of each pixel, a factor of a flake's blur (eq. 17).
        glare: (frames, rows, columns) uint8, brightest channel of the flame in each cell, sRGB, in
            each frame of a round; all 0 if no flake is lost in it.
        cell: Side of a cell, px.
        fades: Whether flakes fade towards the frame's border.
        art: The pixels of the art, of which flakes are hard squares; None: they are soft.
        fps: Frames per second.
        texture: The picture that flakes show; None for streaks and squares.
        view: The camera that sees them, if the fire has depth.
        count: Number of frames of the clip, after which a loop repeats.
        is_even: Whether flakes differ in neither brightness nor focus, nor flicker (the paper).
    """

    seed: int
    colours: NDArray[np.float64]
    intensity: float
    stretch: float
    shutter: float
    kappa: Plane
    glare: NDArray[np.uint8]
    cell: int
    fades: bool
    art: PixelGrid | None
    fps: float
    texture: TextureCells | None = None
    view: FlakeView | None = None
    count: int = 1
    is_even: bool = False

    @property
    def tiles(self) -> bool:
        """Whether flakes that leave the frame at one side enter at the other."""
        return self.view is not None and self.view.camera.tiles

    def columns(self, x: Column, count: int, side: int = 1) -> NDArray[np.intp]:
        """Return in which of ``count`` columns, each ``side`` px wide, flakes at ``x``, px, are."""
        x = np.mod(x, self.kappa.shape[1]) if self.tiles else x
        return np.clip((x / side).astype(np.intp), 0, count - 1)


@dataclass(frozen=True, slots=True)
class _FixedLook:
    """What of the look of flakes, embers and sparks, stays the same for life. Arrays (flakes,).

    Attributes:
        spawns: All flakes.
        light: Light at the brightest, were it wider than a pixel.
        held: Fraction of its life from which the flake fades.
        size: Drawn width, px, without and with the blur of the lens.
        blur: Part of the drawn width by which the flake is out of focus, px.
    """

    spawns: Spawns
    light: NDArray[np.float64]
    held: NDArray[np.float64]
    size: NDArray[np.float64]
    blur: NDArray[np.float64]

    @classmethod
    def of(cls, spawns: Spawns, look: Appearance) -> "_FixedLook":
        """Decide the light and the drawn width of each flake."""
        if look.texture is not None:
            return cls._of_texture(spawns, look, look.texture)
        count = len(spawns.tick)
        if look.art is not None or look.is_even:
            light, degree = (
                np.full(count, _EVEN_LIGHT if look.art is None else _PIXEL_LIGHT),
                np.zeros(count),
            )
        else:
            light = ember_brightness(count, look.seed) * np.where(spawns.kind == SPARK, _SPARK, 1.0)
            degree = defocus(count, _OUT_OF_FOCUS, look.seed)
        blurred = (degree > 0) & (light < _BLINDING)
        if count and look.art is None:
            spawns = replace(spawns, size=_thinned(spawns.size, blurred | (light >= _HOT)))
        size, (least, most) = drawn_width(spawns.size, look.art), _DEFOCUS
        median_width = np.median(size) if count else 0.0
        blur = np.where(blurred, (least + (most - least) * degree) * median_width, 0.0)
        return cls(spawns, light * look.intensity, _held(count, look), size + blur, blur)

    @classmethod
    def _of_texture(cls, spawns: Spawns, look: Appearance, texture: TextureCells) -> "_FixedLook":
        """Return flakes that are pictures: all in focus and, if as painted, equally bright."""
        count = len(spawns.tick)
        differs = texture.tinted and not look.is_even
        light = ember_brightness(count, look.seed) if differs else np.ones(count)
        held, size = _held(count, look), np.maximum(spawns.size, MIN_WIDTH)
        return cls(spawns, light * look.intensity, held, size, np.zeros(count))


def _held(count: int, look: Appearance) -> NDArray[np.float64]:
    """Return the fraction of its life from which each of ``count`` flakes dies."""
    return np.full(count, _EVEN_HELD) if look.is_even else held_share(count, look.seed)


def _thinned(size: Column, most: NDArray[np.bool_]) -> Column:
    """Return widths of which those above the median are less wide, and of ``most`` as much
    narrower as they were wider."""
    median = np.median(size)
    wider = size / median
    thin = np.where(most, 1 / wider, wider**_WIDE)
    return np.asarray(median * np.where(wider > 1, thin, wider), np.float64)


def track_rows(
    states: Iterable[ParticleState], spawns: Spawns, look: Appearance, workers: Workers
) -> Iterator[NDArray[np.float64]]:
    """Yield one table (flakes, columns) per frame, as in ``Tracks``, while the flight goes on.

    ``states`` and ``spawns`` of a fire with depth are as the camera of the view sees them.

    A row's velocity leads to the flake's place in the next frame, so that an engine that moves it
    by ``v / fps`` arrives there; in a flake's last row it is the simulated velocity.
    """
    embers = _FixedLook.of(spawns, look)
    if look.art is not None and look.art.side > 1:
        art = look.art
        states = (_on_pixels(state, embers.size, art) for state in states)
    moving = (
        _with_frame_velocity(*pair, look.fps)
        for pair in pairwise(chain(states, [ParticleState.empty()]))
    )
    count = min(len(spawns.tick), _FLICKERS)
    flickers = repeat(np.ones(count)) if look.is_even else flicker(count, look.fps, look.seed)
    shown = (
        (
            state,
            factor.take(state.id & (_FLICKERS - 1))
            * _seen_in(look.glare[i % len(look.glare)], state, look)
            * _shown(state, i, embers, look),
        )
        for i, (state, factor) in enumerate(zip(moving, flickers, strict=False))
    )
    for tables in workers.map(lambda batch: _tables(batch, embers, look), _batches(shown)):
        yield from tables


def _on_pixels(state: ParticleState, size: Column, art: PixelGrid) -> ParticleState:
    """Return the state of squares, ``size`` px wide by their ids, that lie on pixels of the art."""
    half = size.take(state.id) / 2
    x = art.x + art.side * np.rint((state.x - half - art.x) / art.side) + half
    y = art.y + art.side * np.rint((state.y - half - art.y) / art.side) + half
    return replace(state, x=x, y=y)


def _with_frame_velocity(
    state: ParticleState, following: ParticleState, fps: float
) -> ParticleState:
    """Return the state of a frame, velocities (px/s) leading to the places of the following one."""
    # Both are sorted by id: find where each flake would be in the following frame's arrays.
    there = np.searchsorted(following.id, state.id)
    here = np.flatnonzero(np.append(following.id, -1)[there] == state.id)
    there = there[here]
    vx, vy, vz = state.vx.copy(), state.vy.copy(), state.vz.copy()
    vx[here] = (following.x[there] - state.x[here]) * fps
    vy[here] = (following.y[there] - state.y[here]) * fps
    vz[here] = (following.z[there] - state.z[here]) * fps
    return replace(state, vx=vx, vy=vy, vz=vz)


def _shown(state: ParticleState, i: int, embers: _FixedLook, look: Appearance) -> Column | float:
    """Return the factor of the light of flakes in frame ``i``: 0 if any part of one is behind
    something opaque."""
    if look.view is None or not len(state.id):
        return 1.0
    travel = np.hypot(state.vx, state.vy)
    half = embers.size.take(state.id) * look.view.magnification(state.z) / 2
    half_length = half + travel / look.fps * (look.stretch + look.shutter) / 2
    along, across = np.stack([state.vx, state.vy]) / np.maximum(travel, 1e-9), half
    hidden = np.zeros(len(state.id), np.bool_)
    for ahead, aside in ((0, 0), (half_length, 0), (-half_length, 0), (0, across), (0, -across)):
        x = state.x + along[0] * ahead - along[1] * aside
        y = state.y + along[1] * ahead + along[0] * aside
        hidden |= look.view.hidden(i % look.count, x, y, state.z)
    return (~hidden).astype(np.float64)


def _seen_in(
    glare: NDArray[np.uint8], state: ParticleState, look: Appearance
) -> NDArray[np.float64]:
    """Return which part of its light is seen of each flake in the ``glare`` of the flame."""
    rows, columns = glare.shape
    row = np.clip((state.y / look.cell).astype(np.intp), 0, rows - 1)
    column = look.columns(state.x, columns, look.cell)
    shown = decode_unit(as_plane(glare[row, column] / 255))
    lost = (shown - _GLARE[0]) / (_GLARE[1] - _GLARE[0])
    return 1 - smooth_step(lost.astype(np.float64))


_Seen = tuple[ParticleState, NDArray[np.float64]]
"""The flakes of a frame, and the factor of each one's light by flicker and by glare."""


def _batches(states: Iterable[_Seen]) -> Iterator[list[_Seen]]:
    """Yield the states in groups of successive frames, each of ``_BATCH`` flakes or more."""
    batch, flakes = list[_Seen](), 0
    for state in states:
        batch.append(state)
        flakes += len(state[1])
        if flakes >= _BATCH:
            yield batch
            batch, flakes = [], 0
    if batch:
        yield batch


def _tables(batch: list[_Seen], embers: _FixedLook, look: Appearance) -> list[NDArray[np.float64]]:
    """Return the table of rows of each state."""
    states, factors = zip(*batch, strict=True)
    ends = np.cumsum([len(state.id) for state in states])
    state, factor = ParticleState.concatenate(states), np.concatenate(factors)
    return np.split(_table(state, factor, embers, look), ends[:-1])


def _table(
    state: ParticleState, factor: NDArray[np.float64], embers: _FixedLook, look: Appearance
) -> NDArray[np.float64]:
    """Return the rows of flakes; their streaks follow x(δ) = x(t) + (δ − t) v κ (eq. 17).

    κ is of the gas, so it shortens the streaks of embers alone, not of sparks thrown out of it.
    ``factor`` is that of each flake's light by flicker and by glare.
    """
    ids, spawns = state.id, embers.spawns
    travel, kind = np.hypot(state.vx, state.vy) / look.fps, spawns.kind.take(ids)
    size, life = embers.size.take(ids), spawns.life.take(ids)
    size, own_size = _magnified(size, spawns.size.take(ids), state, look)
    depth = [] if look.view is None else [state.z, state.vz]
    height, width = look.kappa.shape
    weight = look.kappa[
        np.clip(state.y.astype(np.intp), 0, height - 1),
        look.columns(state.x, width),
    ]
    light = light_over_life(state.age / life, embers.held.take(ids)) * factor
    streak = travel * _exposed(state, np.where(kind == SPARK, 1.0, weight), look)
    if look.texture is not None:
        stretch, tail = look.texture.aspect + streak / size, np.ones_like(size)
        light = np.minimum(light, 1.0) if not look.texture.tinted else light
        # One thinner than a pixel is drawn larger, but its light stays the same in sum.
        thin, ratio = spawns.size.take(ids), look.texture.aspect
        light *= thin * (ratio * thin + streak) / (size * (ratio * size + streak))
        if look.texture.tinted:
            light /= 1 + _DIMMED_BY_LENGTH * (1 + streak / size)
    elif look.art is not None:
        stretch, tail = np.ones_like(size), np.ones_like(size)
        light = np.ceil(np.minimum(light, 1.0) * _PIXEL_SHADES) / _PIXEL_SHADES
    else:
        # It fades towards its ends: as drawn it is longer than it is seen.
        longer = streak / SEEN_LENGTH
        stretch = 1 + longer / size
        tail = 1 / stretch  # a round one has none; that of a long one is dark
        # Spread over pixels and by the lens, the light stays the same in sum.
        light *= (own_size + longer) * own_size
        light /= (size + longer) * size * (1 + _DIMMED_BY_LENGTH * stretch)
    if look.texture is None and look.art is not None and len(look.colours) > 1:
        light = np.ones_like(size)
        colour = look.intensity * colour_by_age(state.age / life, look.colours)
    else:
        full = (_FULL_SPEED_OF_PAPER if look.is_even else _FULL_SPEED) * height
        colour = colour_by_speed(state.smoothed_speed / full, look.colours) * embers.light.take(ids)
    if look.fades:
        is_soft = look.art is None and look.texture is None
        halo = size * HALO_WIDTH if is_soft else size
        half_length = (size * (stretch - 1) + halo) / 2
        light = light * _border_fade(state, half_length, travel, look)
    # Each column is contiguous in memory, because tables are read by column.
    return np.stack([
        ids, state.x, state.y, state.vx, state.vy, size, stretch,
        np.arctan2(state.vy, state.vx), *colour, light, state.age, life,
        kind, embers.blur.take(ids), tail, *depth,
    ]).T  # fmt: skip


def _exposed(state: ParticleState, weight: Column, look: Appearance) -> Column:
    """Return the frames of travel that each flake's streak shows; κ, ``weight``, shortens it.

    A streak lies evenly about its middle, and does not reach back to before the flake's birth.
    """
    return np.minimum(look.stretch + look.shutter * weight, 2 * look.fps * state.age)


def _magnified(
    size: Column, own_size: Column, state: ParticleState, look: Appearance
) -> tuple[Column, Column]:
    """Return the drawn and the own width of flakes, px, as large as the camera sees them."""
    if look.view is None:
        return size, own_size
    nearer = look.view.magnification(state.z)
    # The reach of a pixel, which is part of the drawn width, is the same at any distance.
    return size + own_size * (nearer - 1), own_size * nearer


def _border_fade(
    state: ParticleState,
    half_length: NDArray[np.float64],
    travel: NDArray[np.float64],
    look: Appearance,
) -> NDArray[np.float64]:
    """Factor by which sprites fade near the frame's border: 0 at the border, 1 inside the strip.

    Sprites extend ``half_length`` px from their centre and move ``travel`` px per frame. The sides
    of a tile are no border.
    """
    height, width = look.kappa.shape
    sides = [] if look.tiles else [state.x, width - state.x]
    gap = np.minimum.reduce([state.y, height - state.y, *sides])
    gap -= np.minimum(half_length, _MAX_HALF_LENGTH * min(height, width))
    strip = np.maximum(travel * _BORDER_FRAMES, _BORDER * height)
    return smooth_step(np.asarray(gap / strip, np.float64))


def colour_by_speed(speed: NDArray[np.float64], stops: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colour (3, flakes), linear light, of flakes by their ``speed``, 1 for the last of the
    ``stops``."""
    at = np.clip(speed, 0, 1) * (len(stops) - 1)
    known = np.arange(len(stops))
    return np.stack([np.interp(at, known, stops[:, c]) for c in range(3)])


def colour_by_age(
    age_share: NDArray[np.float64], stops: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Light (3, flakes), linear, that film shows as exactly one of the ``stops``: as the last of
    them at birth, as the first before a flake dies.

    Args:
        age_share: (flakes,) age of each flake, in lives.
        stops: (stops, 3) linear light, from dark to bright.
    """
    left = np.ceil((1 - np.clip(age_share, 0, 1)) * len(stops)) - 1
    shown = np.minimum(stops, _BRIGHTEST_SHOWN)[np.maximum(left, 0).astype(np.intp)]
    return np.asarray((shown / (1 - shown)).T, np.float64)  # the inverse of ``expose``


def spawn_table(
    states: list[ParticleState],
    spawns: Spawns,
    frames: list[NDArray[np.float64]],
    has_depth: bool = False,
) -> NDArray[np.float64]:
    """Return the spawn data of all flakes ever seen, (flakes, columns), as in ``Tracks``.

    ``frames`` are the rows of ``states``, which have the sizes as drawn.
    """
    order = np.concatenate([state.id for state in states])
    seen, first = np.unique(order, return_index=True)
    velocity = [np.concatenate([getattr(s, f"v{axis}") for s in states])[first] for axis in "xyz"]
    size = np.concatenate([rows[:, COLUMNS.index("size")] for rows in frames])[first]
    return np.column_stack([
        seen, spawns.tick[seen] * TICK, spawns.life[seen], spawns.x[seen], spawns.y[seen],
        *velocity[:2], size, np.zeros(len(seen)),
        *([spawns.z[seen], velocity[2]] if has_depth else []),
    ])  # fmt: skip
