"""Class of a fire: which kind of fire a clip shows, by its colours, its shape and its motion."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.effect.flame.colour import FlameColours
from fire_atlas.effect.flame.direction import UP
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.recipe.effect import FireClass, FlakeStyle
from fire_atlas.vision.flat_art import ends_at_outlines

_NO_FLAME = 0.0004
"""Area, heights², below which what was found is no flame."""

GREY, GREY_FIRE = 0.06, 0.85
"""Maximum chroma of grey, and minimum peak of grey fire: smoke is duller."""

_DULL_CHROMA, _DULL_PEAK = 0.25, 0.6
"""Maximum chroma and peak of smoke with a tinge."""

_GAS_HUES, _STEADY = (180.0, 275.0), 0.12
"""Hues of burning gas, degrees, and the maximum speed of its flame, heights/s."""

_FULL, _STILL = 0.9, 0.08
"""Minimum part of the frame, of its width and of its height that lava fills, and the maximum
velocity upwards of its surface, heights/s."""

_CLEAR = 8
"""Coverage, 0..255, up to which a pixel counts as transparent."""

_SCATTERED, _FAST = 0.2, 0.45
"""Maximum of mean velocity / mean speed where parts fly apart in all directions, and the minimum
speed, heights/s, of those of a sparkler."""

_FLASH = 1.2
"""Maximum time, s, for which an explosion is at least half as bright as at its peak."""

_SMALL, _CALM = 0.12, 0.1
"""Maximum area, heights², of a candle's flame, and its maximum velocity upwards, heights/s: the gas
of a smooth flame rises unseen."""

_NARROW = 2.5
"""Minimum height of a torch's flame relative to its width."""

_WIDE, _WALL_WIDTH = 0.7, 0.8
"""Maximum height of a wall of fire relative to its width, and minimum part of the frame's width."""

_HUE_NAMES = ((15, "red"), (45, "orange"), (70, "yellow"), (165, "green"), (200, "cyan"),
              (255, "blue"), (290, "purple"), (345, "pink"), (361, "red"))  # fmt: skip
"""Names of hues, each up to an angle, degrees."""


class Classified(NamedTuple):
    """The class of a fire, and why, as a clause for the user."""

    fire_class: FireClass
    reason: str


@dataclass(frozen=True, slots=True)
class FlameMeasures:
    """What decides the class of a fire.

    Attributes:
        colours: Figures about its colours.
        width, height: Size of a frame, px.
        area: Mean area of the flame, heights².
        moving_area: Area in which the fire moves, heights².
        box_width, box_height: Size of the flame's box as a part of the frame's, 0..1.
        tallness: Height of the flame's box relative to its width, in px.
        speed: Mean speed of the flame's parts, heights/s; None of a single picture.
        rise: Mean velocity upwards, heights/s.
        coherence: Mean velocity / mean speed: 1 where all of the flame moves alike.
        flash: If the fire plays once and dies out: the time, s, for which it is at least half as
            bright as at its peak; else None.
        moves: Where the flame moves, in words.
        art_side: Side of a pixel of the art, px.
        outlined: Whether its shades end at an outline, as in art.
        covered: Share of the frame that is not transparent, 0..1.
    """

    colours: FlameColours
    width: int
    height: int
    area: float
    moving_area: float
    box_width: float
    box_height: float
    tallness: float
    speed: float | None
    rise: float
    coherence: float
    flash: float | None
    moves: str
    art_side: int
    outlined: bool
    covered: float

    @classmethod
    def of(cls, clip: Clip, study: FlameStudy) -> Self:
        """Measure a clip by its study, which must have samples."""
        samples, box = study.samples, study.box
        if samples is None:
            raise ValueError("the class of a fire is measured on samples")
        frames = list(samples.frames.values())
        areas = [float(frame.flame.sum()) / len(frame.flame) ** 2 for frame in frames]
        light = np.array([float((frame.flame * frame.brightness**2).sum()) for frame in frames])
        flash = float(np.mean(light > light.max() / 2)) * clip.body / clip.fps
        velocity = samples.velocities.mean(axis=0)
        width, height = box.right - box.left + 1, box.bottom - box.top + 1
        return cls(
            colours=FlameColours.of(samples),
            width=clip.width,
            height=clip.height,
            area=float(np.mean(areas)),
            moving_area=study.moving_area,
            box_width=width / clip.width,
            box_height=height / clip.height,
            tallness=height / width,
            speed=samples.speed if clip.body > 1 else None,
            rise=-float(velocity[1]),
            coherence=float(np.hypot(*velocity)) / max(samples.speed, 1e-9),
            flash=flash if study.dies_out and not clip.loop else None,
            moves=_motion(study.buoyancy),
            art_side=study.art.side,
            outlined=ends_at_outlines(clip),
            covered=float(np.mean([(frame.colours[..., 3] > _CLEAR).mean() for frame in frames])),
        )


def classify_fire(measures: FlameMeasures, style: FlakeStyle) -> Classified:
    """Return the class of a fire in a style: the first that fits, from those that are easiest to
    tell."""
    is_drawn = style in ("cartoon", "pixel")
    return next(_fitting(measures, is_drawn))


def _fitting(flame: FlameMeasures, is_drawn: bool) -> Iterator[Classified]:
    """Yield the classes that fit, with reasons, in order; the last fits any fire.

    What ``is_drawn`` in few colours moves as drawings do: that tells nothing.
    """
    hue = hue_name(flame.colours.hue)
    if flame.area < _NO_FLAME:
        yield Classified("none", "nothing in it is warm, bright and moves as flame does")
    shape = f"{hue} flame {flame.moves}, area {flame.moving_area:.2f} heights²"
    if not is_drawn:
        yield from _told_by_light(flame, hue)
        if flame.speed is not None and flame.rise < _CALM and flame.moving_area < _SMALL:
            yield Classified("candle", f"small, calm {shape}")
    if flame.tallness >= _NARROW:
        yield Classified("torch", f"narrow {shape}")
    if flame.tallness <= _WIDE and flame.box_width >= _WALL_WIDTH:
        yield Classified("wall", f"wide {shape}")
    yield Classified("campfire", shape)


def _told_by_light(flame: FlameMeasures, hue: str) -> Iterator[Classified]:
    """Yield the classes that fit by colours and motion as of light."""
    colours = flame.colours
    if colours.chroma < GREY and colours.peak < GREY_FIRE:
        yield Classified("none", "grey smoke without flame")
    if GREY <= colours.chroma < _DULL_CHROMA and colours.peak < _DULL_PEAK:
        yield Classified("none", "dull smoke without flame")
    is_steady = flame.speed is not None and flame.speed < _STEADY
    is_blue = colours.warmth < 0.5 and _GAS_HUES[0] <= colours.hue <= _GAS_HUES[1]
    if colours.chroma >= GREY and is_blue and is_steady:
        yield Classified("gas", f"{hue} flame that is steady, {flame.speed:.2f} heights/s")
    fills = min(flame.box_width, flame.box_height) >= _FULL and flame.covered >= _FULL
    if fills and flame.rise < _STILL:
        yield Classified("none", f"{hue} surface that fills the frame and does not rise: lava")
    if flame.flash is not None and flame.flash <= _FLASH:
        yield Classified("explosion", f"{hue} flash of {flame.flash:.1f} s that plays once")
    if flame.speed is not None and flame.speed > _FAST and flame.coherence < _SCATTERED:
        yield Classified("none", f"{hue} sparks that fly in all directions, enough of its own")


def hue_name(hue: float) -> str:
    """Return the name of a hue, degrees."""
    return next(name for end, name in _HUE_NAMES if hue < end)


def _motion(direction: tuple[float, float]) -> str:
    """Return where a flame moves, as a relative clause."""
    x, y = direction
    if direction == UP:
        return "that rises"
    if abs(y) > abs(x):
        return "that falls" if y > 0 else "that leans as it rises"
    return "that flies to the right" if x > 0 else "that flies to the left"
