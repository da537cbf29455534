"""Recipe block ``wind``: one wind for every source."""

import math
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from fire_atlas.recipe.base import LIST, Settings

LEVEL = 0.15
"""One level of wind, frame heights per second."""

Level = Annotated[float, Field(ge=0, le=5)]
"""Strength; one level is 0.15 frame heights per second."""


def _degrees(value: Any) -> Any:
    """Read ``right`` and ``left`` as degrees."""
    return {"right": 0.0, "left": 180.0}.get(value, value) if isinstance(value, str) else value


Heading = Annotated[float, BeforeValidator(_degrees), Field(ge=-360, le=360)]
"""Where wind blows to: ``right``, ``left``, or degrees seen from above (0 right, 90 away)."""


class WindKeyframe(Settings):
    """Wind at one moment; between moments it changes evenly."""

    t: float = Field(ge=0, le=3600)
    """Seconds from the first frame."""
    level: Level = 0.0
    """Strength, 0-5."""
    direction: Heading = 0.0
    """``right``, ``left`` or degrees."""


class Gusts(Settings):
    """Wind that swells and falls, and begins anew every period."""

    mean: Level = 1.0
    """Strength around which it swings, 0-5."""
    strength: Level = 1.0
    """How far it swings, levels."""
    period: float = Field(default=2.0, ge=0.1, le=600)
    """Seconds from gust to gust."""


class Wind(Settings):
    """A steady wind (``level``), one that changes (``keyframes``) or ``gusts``."""

    level: Level = 0.0
    """Strength of a steady wind, 0-5; one level is 0.15 frame heights per second."""
    direction: Heading = 0.0
    """Where a steady wind or gusts blow to: ``right``, ``left``, or degrees seen from above (0
    right, counter-clockwise)."""
    keyframes: Annotated[tuple[WindKeyframe, ...], LIST] = ()
    """Wind that changes over time, in order of ``t``."""
    gusts: Gusts | None = None
    """Wind that swells and falls."""

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

    def at(self, time: float) -> tuple[float, float]:
        """Where the air goes at ``time`` s, seen from above: (to the right, away), levels."""
        if self.keyframes:
            return _between(self.keyframes, time)
        level = self.level
        if self.gusts is not None:
            # Two harmonics, whose highest sum is 1.2147: a gust swells faster than it falls.
            # It begins, and a loop closes, in the lull.
            turn = 2 * math.pi * time / self.gusts.period - 1.0921
            swell = (math.sin(turn) + 0.4 * math.sin(2 * turn)) / 1.2147
            level = max(self.gusts.mean + self.gusts.strength * swell, 0.0)
        return _parts(level, self.direction)

    def strongest(self) -> float:
        """Return the highest level the wind ever has."""
        if self.keyframes:
            return max(keyframe.level for keyframe in self.keyframes)
        return self.gusts.mean + self.gusts.strength if self.gusts else self.level

    def fitted(self, seconds: float) -> Self:
        """Return the wind with a whole number of gusts in ``seconds``, so that it closes."""
        if self.gusts is None:
            return self
        period = seconds / max(round(seconds / self.gusts.period), 1)
        return self.model_copy(update={"gusts": self.gusts.model_copy(update={"period": period})})

    def seen_from(self, azimuth: float) -> Self:
        """Return this wind as an eye sees it that has gone ``azimuth`` degrees round the fire,
        counter-clockwise."""
        keyframes = tuple(
            k.model_copy(update={"direction": k.direction - azimuth}) for k in self.keyframes
        )
        turned = {"direction": self.direction - azimuth, "keyframes": keyframes}
        return self.model_copy(update=turned)


def _parts(level: float, direction: float) -> tuple[float, float]:
    """Split a wind into its parts to the right and away."""
    angle = math.radians(direction)
    return level * math.cos(angle), level * math.sin(angle)


def _between(keyframes: tuple[WindKeyframe, ...], time: float) -> tuple[float, float]:
    """Wind between keyframes, each part changing evenly; before and after, that of the nearest."""
    for before, after in pairwise(keyframes):
        if before.t <= time < after.t:
            share = (time - before.t) / (after.t - before.t)
            x, y = _parts(before.level, before.direction)
            to_x, to_y = _parts(after.level, after.direction)
            return x + share * (to_x - x), y + share * (to_y - y)
    nearest = keyframes[0] if time < keyframes[0].t else keyframes[-1]
    return _parts(nearest.level, nearest.direction)
