"""Show the progress and the result of builds: as lines, bars, JSON or not at all."""

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
from fire_atlas.core.progress import SilentProgress

if TYPE_CHECKING:
    from fire_atlas.cli.console import ProgressBars

_JSON_INTERVAL = 0.1
"""Minimum seconds between two JSON lines of a stage, except its first and its last."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a build, as a view shows it.

    Attributes:
        files: The files that were written.
        timings: Seconds by stage.
        statistics: Figures about the result.
        fresh: Whether the outputs were up to date, so that nothing was done.
    """

    files: list[Path] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    fresh: bool = False


class BuildView(SilentProgress):
    """A ``Progress`` that shows nothing: the base of all views, and the one for ``--quiet``."""

    def begin(self, recipe: Path) -> None:
        """Begin the build of ``recipe``."""

    def planned(self, why: str | None) -> None:
        """Show why the recipe would be built; None if it is up to date."""

    def cache(self, result: str, why: str) -> None:
        """Show what the cache did: a "hit", a "miss", "stored" or "not stored"."""

    def done(self, outcome: Outcome) -> None:
        """Show that the build succeeded."""

    def failed(self, message: str) -> None:
        """Show that the build failed or was interrupted; the caller prints ``message``."""

    def close(self) -> None:
        """End the view of this build."""


class LineView(BuildView):
    """Plain lines: for each stage and note on stderr, for each recipe on stdout."""

    def __init__(self, verbose: bool) -> None:
        """With ``verbose``, also list files and timings."""
        self.verbose = verbose
        self._recipe = Path()

    def begin(self, recipe: Path) -> None:
        """Name the recipe in the lines that follow."""
        self._recipe = recipe

    def stage(self, name: str, total: int) -> None:
        """Print the name of the stage."""
        print(printable(f"{self._recipe}: {name} ({total})"), file=sys.stderr)

    def note(self, message: str) -> None:
        """Print the message."""
        print(printable(f"{self._recipe}: {message}"), file=sys.stderr)

    def planned(self, why: str | None) -> None:
        """Print whether and why the recipe would be built."""
        plan = f"would be built: {why}" if why else "up to date"
        print(printable(f"{self._recipe}: {plan}"))

    def cache(self, result: str, why: str) -> None:
        """Print what the cache did, if ``verbose``."""
        if self.verbose:
            self.note(f"cache: {result}: {why}")

    def done(self, outcome: Outcome) -> None:
        """Print how many files were written where."""
        print(printable(f"{self._recipe}: {_summary(outcome)}"))
        if self.verbose:
            for path in outcome.files:
                print(printable(f"  {path}"))
            for name, seconds in outcome.timings.items():
                print(printable(f"  {name}: {seconds:.2f} s"))


class BarView(LineView):
    """Moving bars on stderr instead of lines, for a terminal."""

    _bars: "ProgressBars | None" = None

    def stage(self, name: str, total: int) -> None:
        """Add a bar; rich is imported only now, as an up-to-date build does not need it."""
        if self._bars is None:
            from fire_atlas.cli.console import ProgressBars

            self._bars = ProgressBars(str(self._recipe))
        self._bars.stage(name, total)

    def advance(self, done: int = 1) -> None:
        """Move the bar."""
        if self._bars is not None:
            self._bars.advance(done)

    def note(self, message: str) -> None:
        """Print the sentence above the bars."""
        if self._bars is None:
            super().note(message)
        else:
            self._bars.note(message)

    def done(self, outcome: Outcome) -> None:
        """Leave the bars as they are, and print how many files were written where."""
        self.close()
        super().done(outcome)

    def failed(self, message: str) -> None:
        """Leave the bars as they are."""
        self.close()

    def close(self) -> None:
        """Stop redrawing the bars."""
        if self._bars is not None:
            self._bars.close()
        self._bars = None


class JsonView(BuildView):
    """JSON lines on stdout: one object for each event."""

    def __init__(self) -> None:
        """Start outside of any stage."""
        self._recipe, self._stage = "", ""
        self._done = self._total = 0
        self._last = 0.0

    def begin(self, recipe: Path) -> None:
        """Name the recipe in every line that follows."""
        self._recipe = str(recipe)

    def stage(self, name: str, total: int) -> None:
        """Print the first line of the stage."""
        self._stage, self._done, self._total = name, 0, total
        self._print_stage()

    def advance(self, done: int = 1) -> None:
        """Print a line if the last one was some time ago or the stage is complete."""
        self._done += done
        is_due = time.monotonic() - self._last >= _JSON_INTERVAL
        if is_due or self._done >= self._total:
            self._print_stage()

    def note(self, message: str) -> None:
        """Print the message."""
        self._print("note", message=message)

    def planned(self, why: str | None) -> None:
        """Print whether and why the recipe would be built."""
        self._print("plan", fresh=why is None, why=why)

    def cache(self, result: str, why: str) -> None:
        """Print what the cache did."""
        self._print("cache", result=result, why=why)

    def done(self, outcome: Outcome) -> None:
        """Print files, timings and statistics."""
        self._print(
            "done",
            fresh=outcome.fresh,
            files=[str(path) for path in outcome.files],
            timings=outcome.timings,
            statistics=outcome.statistics,
        )

    def failed(self, message: str) -> None:
        """Print the message."""
        self._print("error", message=message)

    def _print_stage(self) -> None:
        self._last = time.monotonic()
        self._print("stage", stage=self._stage, done=self._done, total=self._total)

    def _print(self, event: str, **values: Any) -> None:
        print(json.dumps({"event": event, "recipe": self._recipe, **values}), flush=True)


def shows_interruption(view: BuildView) -> AbstractContextManager[None]:
    """Let ``view`` show it if a signal ends the process inside this context."""
    return if_interrupted(partial(view.failed, MESSAGE))


def view_for(json_lines: bool, quiet: bool, verbose: bool) -> BuildView:
    """Return the view for these options; bars only if stderr is a terminal."""
    if json_lines:
        return JsonView()
    if quiet:
        return BuildView()
    return BarView(verbose) if sys.stderr.isatty() else LineView(verbose)


def _summary(outcome: Outcome) -> str:
    if outcome.fresh:
        return "up to date"
    seconds = sum(outcome.timings.values())
    folder = outcome.files[0].parent if outcome.files else ""
    return f"{len(outcome.files)} files in {folder} ({seconds:.1f} s)"
