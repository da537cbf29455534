"""Recipe block ``wind``: the wind on the fire, for every kind of source."""

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from fire_atlas.recipe.base import LIST, Settings

Level = Annotated[float, Field(ge=0, le=5)]
"""Strength of wind; one level is 0.15 frame heights per second."""


def _degrees(value: Any) -> Any:
    """Read ``right`` and ``left`` as degrees."""
    return {"right": 0.0, "left": 180.0}.get(value, value) if isinstance(value, str) else value


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
    """Wind that rises and falls periodically."""

    mean: Level = 1.0
    """Mean strength, 0-5."""
    strength: Level = 1.0
    """Amplitude: how far it rises above and falls below the mean. If it exceeds the mean, the wind
    is calm for a while between gusts."""
    period: float = Field(default=2.0, ge=0.1, le=600)
    """Time from gust to gust, s."""


class Wind(Settings):
    """A steady wind (``level``), one that changes (``keyframes``) or ``gusts``."""

    level: Level = 0.0
    """Strength of a steady wind, 0-5; one level is 0.15 frame heights per second."""
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
            )
            if is_given
        ]
        if len(given) > 1:
            raise ValueError(f"has both {given[0]} and {given[1]}; keep one of them")
        times = [keyframe.t for keyframe in self.keyframes]
        if times != sorted(times):
            raise ValueError("keyframes must be in order of t")
        return self
