"""The table of docs/promises.md: each promise, measured, and whether it is kept."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.support.promises.of_effect import PROMISES, WITHOUT, run
from tests.support.promises.of_fluid import PROMISES_OF_FLUID, WITHOUT_OF_FLUID, simulate_gas
from tests.support.promises.of_profile import PROMISES_OF_PROFILE, generate
from tests.support.promises.of_silk import PROMISES_OF_SILK, WITHOUT_OF_SILK, burn
from tests.support.promises.promise import OF_THE_TABLE, SEEDS, Promise, Scale, mean

PAGE = Path(__file__).parents[3] / "docs" / "promises.md"

ALL = (*PROMISES, *PROMISES_OF_PROFILE, *PROMISES_OF_SILK, *PROMISES_OF_FLUID)


def measured(promise: Promise, value: Any, seed: int, scale: Scale = OF_THE_TABLE) -> float:
    """Return the promise's figure with its key at ``value``."""
    make = {"clip": run, "profile": generate, "silk": burn, "fluid": simulate_gas}[promise.fire]
    return promise.figure.of(make(promise, value, seed, scale))


@dataclass(frozen=True)
class Kept:
    """A promise, measured over the seeds: its figure at the low value, by default, at the high."""

    promise: Promise
    low: float
    default: float
    high: float
    spread: float

    @classmethod
    def of(cls, promise: Promise) -> "Kept":
        """Measure a promise."""
        at = [
            [measured(promise, value, seed) for seed in SEEDS]
            for value in (promise.low, None, promise.high)
        ]
        spread = max(np.ptp(at[0]), np.ptp(at[2]))
        return cls(promise, mean(at[0]), mean(at[1]), mean(at[2]), float(spread))

    @property
    def is_seen(self) -> bool:
        """Whether the figure goes the promised way, by as much as can be seen."""
        change = self.high - self.low if self.promise.rises else self.low - self.high
        unit = self.promise.figure.unit
        return change > 2 * self.spread and unit.is_seen(self.low, self.high)

    def row(self) -> str:
        """Return the row of the table."""
        promise = self.promise
        text = promise.sentence.replace("``", "`")
        figures = " | ".join(f"{each:.3g}" for each in (self.low, self.default, self.high))
        values = f"`{_shown(promise.low)}` | `{_shown(promise.high)}`"
        seen = "yes" if self.is_seen else "**no**"
        return (
            f"| `{promise.key}` | {text} | {promise.label} | {values} | {figures} "
            f"| {self.spread:.2g} | {seen} |"
        )


def _shown(value: Any) -> str:
    return (
        yaml.safe_dump(value, default_flow_style=True, width=1000).removesuffix("\n...\n").strip()
    )


HEAD = """\
# What the keys of the effect do, in figures

<!-- Written by python -m tools.bench.promises --write: do not edit by hand. -->

For every key of `features`, `buoyancy`, `flakes`, `motion_blur`, `composite` and `wind` whose text
in the [reference](recipe.md) promises something to be seen: that sentence, a figure of what it is
about, and how far the figure goes from a low value to a high one that an artist would use. The
effect is run on a sample, the campfire where no other is named, 160 px high, with four seeds; the
spread is the largest difference between two seeds at one value. It is *seen* if it goes the
promised way by more than twice the spread, and by at least 2 px, 2 % of the height, 3°, 5 % of a
number or of light, or 5 of a hundred.

"""

COLUMNS = """\
| key | says | figure | low | high | at low | by default | at high | spread | seen |
|---|---|---|---|---|---|---|---|---|---|
"""

OF_PROFILE = """\

## Fire learnt from a clip

Of `source.kind: profile`, the wind on it and its views, measured on two seconds of fire from the
sample torch where no other is named.

"""

OF_SILK = """\

## Silk flames

Of `source.kind: silk`, measured on a second of fire of five crossed sheets of wood, 160 px high.

"""

OF_FLUID = """\

## Simulated gas

Of `source.kind: fluid`, measured on the later half of two thirds of a second of the ready fire that
is named, 160 px high, in cubes of a twenty-fourth of a square frame.

"""


def page(rows: list[Kept]) -> str:
    """Return docs/promises.md."""
    effect, profile, silk, fluid = (
        COLUMNS + "".join(f"{row.row()}\n" for row in rows if row.promise.fire == fire)
        for fire in ("clip", "profile", "silk", "fluid")
    )
    without, without_of_silk, without_of_fluid = (
        "\nThese promise nothing that is seen:\n\n"
        + "".join(f"- `{key}` {why}.\n" for key, why in reasons.items())
        for reasons in (WITHOUT, WITHOUT_OF_SILK, WITHOUT_OF_FLUID)
    )
    return "".join([
        HEAD, effect, without,
        OF_PROFILE, profile,
        OF_SILK, silk, without_of_silk,
        OF_FLUID, fluid, without_of_fluid,
    ])  # fmt: skip
