"""Recipe block ``wind``: the wind on the fire, for every kind of source."""

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from fire_atlas.recipe.base import LIST, Settings
from fire_atlas.recipe.problem import did_you_mean

MAX_LEVEL = 5.0
"""Strongest wind."""

Level = Annotated[float, Field(ge=0, le=MAX_LEVEL)]
"""Strength of wind; one level is 0.15 frame heights per second."""

MIN_LOOP_IN_WIND = 6
"""Minimum frames of the loops of ``Wind.levels``."""


_WORDS = {"right": 0.0, "left": 180.0}


def _degrees(value: Any) -> Any:
    """Read ``right`` and ``left`` as degrees."""
    if not isinstance(value, str):
        return value
    if value in _WORDS:
        return _WORDS[value]
    if value in ("up", "down"):
        raise ValueError(
            f"wind blows level: to the right, to the left, or at degrees as seen from above; what "
            f"makes fire rise is buoyancy.lift, or source.lift of silk and fluid; got {value}"
        )
    raise ValueError(
        f"must be right, left or degrees as seen from above (90: away from the viewer); got "
        f"{value}{did_you_mean(value, _WORDS)}"
    )


Heading = Annotated[
    float,
    BeforeValidator(_degrees),
    Field(ge=-360, le=360),
    WithJsonSchema(
        {
            "oneOf": [
                {"enum": ["right", "left"], "type": "string"},
                {"type": "number", "minimum": -360, "maximum": 360},
            ]
        }
    ),
]
"""Direction the wind blows towards: ``right``, ``left`` or degrees, as seen from above."""


class WindKeyframe(Settings):
    """Wind at one time; between keyframes it is interpolated linearly."""

    t: float = Field(ge=0, le=3600)
    """Seconds from the first frame."""
    level: Level = 0.0
    """Strength, 0-5."""
    direction: Heading = 0.0
    """Direction the wind blows towards: ``right``, ``left``, or degrees, as seen from above: 0
    right, 90 away from the viewer, 180 left."""


class Gusts(Settings):
    """Wind that rises and falls periodically, up to level 5."""

    mean: Level = 1.0
    """Mean strength, 0-5."""
    strength: Level = 1.0
    """Amplitude: how far it rises above and falls below the mean. If it exceeds the mean, the wind
    is calm for a while between gusts."""
    period: float = Field(default=2.0, ge=0.1, le=600)
    """Time from gust to gust, s."""

    @model_validator(mode="after")
    def _within_levels(self) -> Self:
        if self.mean + self.strength > MAX_LEVEL:
            raise ValueError(
                f"blow up to level {self.mean + self.strength:g}, mean and strength together; the "
                f"highest is {MAX_LEVEL:g}"
            )
        return self


class Wind(Settings):
    """A steady wind (``level``), one that changes (``keyframes``), ``gusts``, or a choice of steady
    winds for a game to change between (``levels``)."""

    level: Level = 0.0
    """Strength of a steady wind, 0-5; one level is 0.15 frame heights per second."""
    levels: Annotated[tuple[Level, ...], LIST] = ()
    """Strengths of steady wind, 0-5 and increasing, of generated fire that changes between them
    while a game runs: a loop for each of them (``wind_0``, ``wind_1``, ...), and a short transition
    from each to its neighbours (``wind_0_1``, ``wind_1_0``, ...)."""
    direction: Heading = 0.0
    """Direction a steady wind or gusts blow towards: ``right``, ``left``, or degrees, as seen from
    above: 0 right, 90 away from the viewer, 180 left."""
    keyframes: Annotated[tuple[WindKeyframe, ...], LIST] = ()
    """Wind that changes over time, in order of ``t``."""
    gusts: Gusts | None = None
    """Wind that rises and falls periodically."""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [
            name
            for name, is_given in (
                ("level", self.level > 0),
                ("keyframes", bool(self.keyframes)),
                ("gusts", self.gusts is not None),
                ("levels", bool(self.levels)),
            )
            if is_given
        ]
        if len(given) > 1:
            raise ValueError(f"has both {given[0]} and {given[1]}; keep one of them")
        times = [keyframe.t for keyframe in self.keyframes]
        if times != sorted(times):
            raise ValueError("keyframes must be in order of t")
        if self.levels and (len(self.levels) < 2 or list(self.levels) != sorted({*self.levels})):
            raise ValueError("levels must be two or more that increase, like [0, 1, 3, 5]")
        return self

    @property
    def peak(self) -> float:
        """The highest level that the wind reaches at any time, but for ``levels``."""
        if self.keyframes:
            return max(keyframe.level for keyframe in self.keyframes)
        return self.gusts.mean + self.gusts.strength if self.gusts else self.level

    def steady(self) -> tuple[Self, ...]:
        """Return the steady wind of each of the ``levels``; this wind alone if it has none."""
        if not self.levels:
            return (self,)
        return tuple(
            self.model_copy(update={"level": level, "levels": ()}) for level in self.levels
        )
