"""What people and programs see of a build: lines, bars, JSON or nothing."""

import json
import sys
import time
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fire_atlas.cli.text import printable
from fire_atlas.core.interruption import MESSAGE, if_interrupted

if TYPE_CHECKING:
    from fire_atlas.cli.bars import Bars

_JSON_INTERVAL = 0.1
"""Least seconds between two JSON lines of a stage; its first and its last always come."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a build did.

    Attributes:
        files: What was written.
        timings: Seconds by stage.
        statistics: Figures about the result.
        fresh: The outputs were up to date: nothing was done.
    """

    files: list[Path] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    fresh: bool = False


class Quiet:
    """A ``Progress`` that shows nothing; what the others show, they override."""

    def begin(self, recipe: Path) -> None:
        """The build of ``recipe`` begins."""

    def stage(self, name: str, total: int) -> None:
        """Stage ``name`` begins; it has ``total`` steps."""

    def advance(self, done: int = 1) -> None:
        """``done`` more steps of the stage are done."""

    def note(self, message: str) -> None:
        """Something worth knowing, as a sentence."""

    def planned(self, why: str | None) -> None:
        """The recipe would be built for this reason, or not at all."""

    def done(self, outcome: Outcome) -> None:
        """The build succeeded."""

    def failed(self, message: str) -> None:
        """The build failed (``message`` is printed by the caller), or was interrupted."""

    def close(self) -> None:
        """Nothing more will be told of this build."""


class Lines(Quiet):
    """One plain line for each stage and note on stderr, one for each recipe on stdout."""

    def __init__(self, verbose: bool) -> None:
        """``verbose``: list files and timings too."""
        self.verbose = verbose
        self._recipe = Path()

    def begin(self, recipe: Path) -> None:
        """Remember whose lines follow."""
        self._recipe = recipe

    def stage(self, name: str, total: int) -> None:
        """Print its name."""
        print(printable(f"{self._recipe}: {name} ({total})"), file=sys.stderr)

    def note(self, message: str) -> None:
        """Print it."""
        print(printable(f"{self._recipe}: {message}"), file=sys.stderr)

    def planned(self, why: str | None) -> None:
        """Print it."""
        plan = f"would be built: {why}" if why else "up to date"
        print(printable(f"{self._recipe}: {plan}"))

    def done(self, outcome: Outcome) -> None:
        """Say what was written."""
        print(printable(f"{self._recipe}: {_summary(outcome)}"))
        if self.verbose:
            for path in outcome.files:
                print(printable(f"  {path}"))
            for name, seconds in outcome.timings.items():
                print(printable(f"  {name}: {seconds:.2f} s"))


class Terminal(Lines):
    """Bars on stderr that move, instead of its lines."""

    _bars: "Bars | None" = None

    def stage(self, name: str, total: int) -> None:
        """Add a bar. Only now is rich imported: an up-to-date build does without."""
        if self._bars is None:
            from fire_atlas.cli.bars import Bars

            self._bars = Bars(str(self._recipe))
        self._bars.stage(name, total)

    def advance(self, done: int = 1) -> None:
        """Move the bar."""
        if self._bars is not None:
            self._bars.advance(done)

    def note(self, message: str) -> None:
        """Print it above the bars."""
        if self._bars is None:
            super().note(message)
        else:
            self._bars.note(message)

    def done(self, outcome: Outcome) -> None:
        """Leave the bars standing and say what was written."""
        self.close()
        super().done(outcome)

    def failed(self, message: str) -> None:
        """Leave the bars standing as they are."""
        self.close()

    def close(self) -> None:
        """Stop redrawing the bars."""
        if self._bars is not None:
            self._bars.close()
        self._bars = None


class JsonLines(Quiet):
    """One JSON object a line on stdout."""

    def __init__(self) -> None:
        """Begin outside of any stage."""
        self._recipe, self._stage = "", ""
        self._done = self._total = 0
        self._last = 0.0

    def begin(self, recipe: Path) -> None:
        """Name the recipe in every line that follows."""
        self._recipe = str(recipe)

    def stage(self, name: str, total: int) -> None:
        """Print its first line."""
        self._stage, self._done, self._total = name, 0, total
        self._print_stage()

    def advance(self, done: int = 1) -> None:
        """Print a line now and then, and the last one."""
        self._done += done
        is_due = time.monotonic() - self._last >= _JSON_INTERVAL
        if is_due or self._done >= self._total:
            self._print_stage()

    def note(self, message: str) -> None:
        """Print it."""
        self._print("note", message=message)

    def planned(self, why: str | None) -> None:
        """Print it."""
        self._print("plan", fresh=why is None, why=why)

    def done(self, outcome: Outcome) -> None:
        """Print all there is to know."""
        self._print(
            "done",
            fresh=outcome.fresh,
            files=[str(path) for path in outcome.files],
            timings=outcome.timings,
            statistics=outcome.statistics,
        )

    def failed(self, message: str) -> None:
        """Print why."""
        self._print("error", message=message)

    def _print_stage(self) -> None:
        self._last = time.monotonic()
        self._print("stage", stage=self._stage, done=self._done, total=self._total)

    def _print(self, event: str, **values: Any) -> None:
        print(json.dumps({"event": event, "recipe": self._recipe, **values}), flush=True)


def told_if_interrupted(view: Quiet) -> AbstractContextManager[None]:
    """Let ``view`` tell of a signal that ends the process inside this context."""
    return if_interrupted(partial(view.failed, MESSAGE))


def view_for(json_lines: bool, quiet: bool, verbose: bool) -> Quiet:
    """Return what suits the options and whether anyone is watching."""
    if json_lines:
        return JsonLines()
    if quiet:
        return Quiet()
    return Terminal(verbose) if sys.stderr.isatty() else Lines(verbose)


def _summary(outcome: Outcome) -> str:
    if outcome.fresh:
        return "up to date"
    seconds = sum(outcome.timings.values())
    folder = outcome.files[0].parent if outcome.files else ""
    return f"{len(outcome.files)} files in {folder} ({seconds:.1f} s)"
