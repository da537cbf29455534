"""A promise of a key: its sentence, the figure that it is about, and two values."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal

import numpy as np

SEEDS = (0, 1, 2, 3)


@dataclass(frozen=True)
class Scale:
    """How large, how long and how fine the fire is that is measured.

    Attributes:
        height: Height of its frames, px.
        profile_frames, silk_frames, gas_frames: Frames of fire that is generated.
        sheets: Sheets of silk.
        mesh: Rows and columns of a sheet.
        cubes: Cubes of gas across a square frame.
    """

    height: int
    profile_frames: int
    silk_frames: int
    gas_frames: int
    sheets: int
    mesh: tuple[int, int]
    cubes: int


OF_THE_TABLE = Scale(160, 48, 24, 16, 5, (12, 8), 24)
"""That of the figures in docs/promises.md."""

COARSE = Scale(64, 24, 12, 14, 3, (8, 6), 20)
"""Which way a figure goes is seen here too: shorter, and hardly finer than can be."""


class Unit(Enum):
    """What a figure is of, and the least change of it that is seen."""

    PX = "px"
    HEIGHT = "% of height"
    DEGREES = "°"
    SHARE = "%"
    NUMBER = ""

    def is_seen(self, low: float, high: float) -> bool:
        """Return whether the change from ``low`` to ``high`` is as large as can be seen."""
        change = abs(high - low)
        match self:
            case Unit.PX | Unit.HEIGHT:
                return change >= 2
            case Unit.DEGREES:
                return change >= 3
            case Unit.SHARE:
                return change >= 5
            case Unit.NUMBER:
                return change >= 0.05 * max(abs(low), abs(high))


@dataclass(frozen=True)
class Figure:
    """A figure of what was made, as the table names it."""

    name: str
    unit: Unit
    of: Callable[[Any], float]


@dataclass(frozen=True)
class Promise:
    """What a key promises to be seen.

    Attributes:
        key: The key, with its block.
        sentence: What its text in docs/recipe.md says, word by word.
        figure: What is measured.
        low, high: Values that an artist would use.
        rises: Whether the figure is larger with the high one.
        needs: Other keys with which the figure is measured.
        clip: The sample that it is measured on.
        texture: Whether its flakes show a painted blue square.
        fire: What it is measured on: the effect on a clip, or fire that is generated.
    """

    key: str
    sentence: str
    figure: Figure
    low: Any
    high: Any
    rises: bool = True
    needs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    clip: str = "campfire"
    texture: bool = False
    fire: Literal["clip", "profile", "silk", "fluid"] = "clip"

    @property
    def label(self) -> str:
        """The figure with its unit, and the clip if that is not the usual one."""
        unit = self.figure.unit.value
        label = self.figure.name + (f", {unit}" if unit else "")
        usual = {"clip": "campfire", "profile": "torch"}.get(self.fire, self.clip)
        return label if self.clip == usual else f"{label} ({self.clip})"


def mean(values: Any) -> float:
    """Return the mean of values; 0 of none."""
    return float(np.mean(values)) if len(values) else 0.0


def merged(*blocks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of all blocks; later ones win."""
    result: dict[str, Any] = {}
    for block in blocks:
        for key, value in block.items():
            both = isinstance(value, Mapping) and isinstance(result.get(key), Mapping)
            result[key] = merged(result[key], value) if both else value
    return result


def nested(key: str, value: Any) -> dict[str, Any]:
    """Return ``value`` within the blocks of a key path."""
    for name in reversed(key.split(".")):
        value = {name: value}
    return dict(value)
