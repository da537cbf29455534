"""What a budget was spent on, and what others would have given: as text and as a plot."""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

from pydantic import TypeAdapter, ValidationError

from fire_atlas.recipe.gpu import blocks_suffix

_MIB = 1 << 20

_WIDTH, _HEIGHT = 260, 96
"""Size of the plot, px."""

_BAR = 24
"""Characters of the longest bar of a table."""


@dataclass(frozen=True, slots=True)
class Spending:
    """What some memory gives.

    Attributes:
        frames: Number of frames.
        height: Their height, px.
        memory: Bytes that the pages take.
        error: How far what is played is from the whole: root mean square, linear light, of white.
        budget: Bytes that they may take; None if memory has no limit.
        blocks: How they are compressed, if there was a choice: ``astc-6x6``, ...
    """

    frames: int
    height: int
    memory: int
    error: float
    budget: int | None = None
    blocks: tuple[str, ...] = ()

    @property
    def compressed(self) -> str:
        """How the pages are compressed, to be said behind the height; empty without a choice."""
        return blocks_suffix(self.blocks)

    @property
    def percent(self) -> str:
        """How far what is played is from the whole, % of white, as text."""
        return f"{100 * self.error:.2g} %"


class Mark(NamedTuple):
    """A point of the plot: its place, px, the label of its memory, and whether it was chosen."""

    x: float
    y: float
    label: str
    is_chosen: bool


@dataclass(frozen=True, slots=True)
class Budget:
    """What a budget was spent on.

    Attributes:
        chosen: What the pages hold.
        of: Number and height, px, of the frames that there were.
        curve: What other budgets would have given, by increasing memory.
    """

    chosen: Spending
    of: tuple[int, int]
    curve: tuple[Spending, ...]

    @classmethod
    def read(cls, statistics: dict[str, Any]) -> Self | None:
        """Return what the statistics of a manifest say; None of a build without a budget.

        Raises:
            ValueError: They are invalid.
        """
        if "fit" not in statistics:
            return None
        try:
            found = dict(statistics["fit"])
            of, curve = found.pop("of"), found.pop("curve", ())
            chosen = TypeAdapter(Spending).validate_python(found)
            points = TypeAdapter(tuple[Spending, ...]).validate_python(tuple(curve))
            return cls(chosen, (of["frames"], of["height"]), points)
        except (ValidationError, TypeError, KeyError) as error:
            raise ValueError(f"fit: {error}") from None

    def sentence(self) -> str:
        """Return what the pages hold of the whole."""
        frames, height = self.of
        chosen = self.chosen
        return (
            f"{chosen.frames} of {frames} frames, {chosen.height} of {height} px high"
            f"{chosen.compressed}, in {chosen.memory / _MIB:.2f} MiB; as it is played it is "
            f"{chosen.percent} of white off the whole"
        )

    def rows(self) -> list[tuple[str, ...]]:
        """Return the curve as rows of text: budget, frames, height, memory, error, a bar of it."""
        most = max((point.error for point in self.curve), default=0) or 1
        return [
            (
                f"{(point.budget or 0) / _MIB:.4g} MiB",
                str(point.frames),
                f"{point.height} px{point.compressed}",
                f"{point.memory / _MIB:.2f} MiB",
                point.percent,
                "#" * math.ceil(_BAR * point.error / most),
            )
            for point in self.curve
        ]

    def marks(self) -> list[Mark]:
        """Return the curve as points of a plot of ``_WIDTH`` × ``_HEIGHT`` px: memory, by powers of
        two, to the right; the error upwards from 0."""
        if not self.curve:
            return []
        budgets = [math.log2(point.budget or 1) for point in self.curve]
        width = (budgets[-1] - budgets[0]) or 1
        most = max(point.error for point in self.curve) or 1
        return [
            Mark(
                round(20 + (_WIDTH - 40) * (at - budgets[0]) / width, 1),
                round(_HEIGHT - 20 - (_HEIGHT - 40) * point.error / most, 1),
                f"{(point.budget or 0) / _MIB:.3g}",
                replace(point, budget=None) == self.chosen,
            )
            for at, point in zip(budgets, self.curve, strict=True)
        ]
