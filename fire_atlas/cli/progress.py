"""Show the progress and the result of builds: as lines, bars, JSON or not at all."""

import json
import re
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fire_atlas.cli.text import printable
from fire_atlas.core.interruption import MESSAGE, if_interrupted
from fire_atlas.core.progress import SilentProgress
from fire_atlas.outputs.outcome import Outcome

if TYPE_CHECKING:
    from fire_atlas.cli.console import ProgressBars, RecipeBars

_JSON_INTERVAL = 0.1
"""Minimum seconds between two JSON lines of a stage, except its first and its last."""


class BuildView(SilentProgress):
    """A ``Progress`` that shows nothing: the base of all views, and the one for ``--quiet``."""

    def plan(self, count: int) -> None:
        """Show that ``count`` recipes will be built at the same time."""

    def begin(self, recipe: Path) -> None:
        """Begin, or continue, the build of ``recipe``: all that follows is about it."""

    def remark(self, message: str) -> None:
        """Show a sentence that is about no recipe."""

    def planned(self, why: str | None) -> None:
        """Show why the recipe would be built; None if it is up to date."""

    def cache(self, result: str, why: str) -> None:
        """Show what the cache did: a "hit", a "miss", "stored" or "not stored"."""

    def done(self, outcome: Outcome) -> None:
        """Show that the build succeeded."""

    def failed(self, message: str) -> None:
        """Show that the build failed; the caller prints ``message``."""

    def close(self) -> None:
        """Stop redrawing."""

    def interrupted(self) -> None:
        """Show that a signal ends the command; the caller prints a message."""
        self.close()

    def finish(self, count: int) -> None:
        """Show what became of all ``count`` recipes."""


class LineView(BuildView):
    """Plain lines: for each stage and note on stderr, for each recipe on stdout."""

    def __init__(self, verbose: bool) -> None:
        """With ``verbose``, also list files and timings."""
        self.verbose = verbose
        self._recipe = Path()
        self._results: dict[Path, Outcome | str] = {}  # or why it failed

    def begin(self, recipe: Path) -> None:
        """Name the recipe in the lines that follow."""
        self._recipe = recipe

    def stage(self, name: str, total: int) -> None:
        """Print the name of the stage."""
        print(printable(f"{self._recipe}: {name} ({total})"), file=sys.stderr)

    def note(self, message: str) -> None:
        """Print the message."""
        print(printable(f"{self._recipe}: {message}"), file=sys.stderr)

    def remark(self, message: str) -> None:
        """Print the message."""
        print(printable(message), file=sys.stderr)

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
        self._results[self._recipe] = outcome
        self._print(self._recipe, outcome)

    def failed(self, message: str) -> None:
        """Remember why the recipe failed."""
        self._results[self._recipe] = message

    def finish(self, count: int) -> None:
        """Print a line with totals if there are several recipes, and what failed."""
        if count > 1:
            self._print_totals(count)

    def _print_totals(self, count: int) -> None:
        print(printable(_totals(list(self._results.values()), count)))
        print_failed({path: why for path, why in self._results.items() if isinstance(why, str)})

    def _print(self, recipe: Path, outcome: Outcome) -> None:
        print(printable(f"{recipe}: {_summary(outcome)}"))
        if self.verbose:
            for path in outcome.files:
                print(printable(f"  {path}"))
            for name, seconds in outcome.timings.items():
                print(printable(f"  {name}: {seconds:.2f} s"))


class BarView(LineView):
    """Moving bars on stderr instead of lines, for one recipe at a terminal."""

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
        super().failed(message)

    def close(self) -> None:
        """Stop redrawing the bars."""
        if self._bars is not None:
            self._bars.close()
        self._bars = None


class TableView(LineView):
    """A bar on stderr for each recipe that is being built, and at last a table, for a terminal."""

    _bars: "RecipeBars | None" = None

    def plan(self, count: int) -> None:
        """Show a bar for the recipes that are done."""
        from fire_atlas.cli.console import RecipeBars

        self._bars = RecipeBars(count)

    def stage(self, name: str, total: int) -> None:
        """Show the stage in the bar of the recipe."""
        if self._bars is not None:
            self._bars.stage(self._recipe, name, total)

    def advance(self, done: int = 1) -> None:
        """Move the bar of the recipe."""
        if self._bars is not None:
            self._bars.advance(self._recipe, done)

    def note(self, message: str) -> None:
        """Print the sentence above the bars."""
        if self._bars is None:
            super().note(message)
        else:
            self._bars.note(f"{self._recipe}: {message}")

    def done(self, outcome: Outcome) -> None:
        """Remove the bar of the recipe."""
        self._results[self._recipe] = outcome
        self._remove_bar()

    def failed(self, message: str) -> None:
        """Remove the bar of the recipe."""
        super().failed(message)
        self._remove_bar()

    def close(self) -> None:
        """Stop redrawing the bars."""
        if self._bars is not None:
            self._bars.close()

    def finish(self, count: int) -> None:
        """Print a table of all recipes that were not up to date."""
        self.close()
        stale = {
            recipe: outcome
            for recipe, outcome in self._results.items()
            if isinstance(outcome, str) or not outcome.fresh
        }
        if self.verbose:
            for recipe, outcome in stale.items():
                if not isinstance(outcome, str):
                    self._print(recipe, outcome)
        if stale:
            from fire_atlas.cli.console import print_results

            print_results({path: _cells(outcome) for path, outcome in stale.items()})
        self._print_totals(count)

    def _remove_bar(self) -> None:
        if self._bars is not None:
            self._bars.remove(self._recipe)


@dataclass(slots=True)
class _Stage:
    """A stage of a build, and when it was last printed."""

    name: str = ""
    total: int = 0
    done: int = 0
    printed: float = 0.0


class JsonView(BuildView):
    """JSON lines on stdout: one object for each event."""

    def __init__(self) -> None:
        """Begin no recipe yet."""
        self._recipe = ""
        self._unfinished: dict[str, _Stage] = {}

    def begin(self, recipe: Path) -> None:
        """Name the recipe in every line that follows."""
        self._recipe = str(recipe)
        self._unfinished.setdefault(self._recipe, _Stage())

    def stage(self, name: str, total: int) -> None:
        """Print the first line of the stage."""
        self._unfinished[self._recipe] = _Stage(name, total)
        self._print_stage()

    def advance(self, done: int = 1) -> None:
        """Print a line if the last one was some time ago or the stage is complete."""
        stage = self._unfinished[self._recipe]
        stage.done += done
        is_due = time.monotonic() - stage.printed >= _JSON_INTERVAL
        if is_due or stage.done >= stage.total:
            self._print_stage()

    def note(self, message: str) -> None:
        """Print the message."""
        self._print("note", message=message)

    def remark(self, message: str) -> None:
        """Print the message, without a recipe."""
        print(json.dumps({"event": "note", "message": message}), flush=True)

    def planned(self, why: str | None) -> None:
        """Print whether and why the recipe would be built."""
        self._print_last("plan", fresh=why is None, why=why)

    def cache(self, result: str, why: str) -> None:
        """Print what the cache did."""
        self._print("cache", result=result, why=why)

    def done(self, outcome: Outcome) -> None:
        """Print files, timings and statistics."""
        self._print_last(
            "done",
            fresh=outcome.fresh,
            files=[str(path) for path in outcome.files],
            timings=outcome.timings,
            statistics=outcome.statistics,
        )

    def failed(self, message: str) -> None:
        """Print the message."""
        self._print_last("error", message=message)

    def interrupted(self) -> None:
        """Print for each recipe that is not finished that it was interrupted."""
        for recipe in list(self._unfinished) or [self._recipe]:
            self._recipe = recipe
            self.failed(MESSAGE)

    def _print_stage(self) -> None:
        stage = self._unfinished[self._recipe]
        stage.printed = time.monotonic()
        self._print("stage", stage=stage.name, done=stage.done, total=stage.total)

    def _print_last(self, event: str, **values: Any) -> None:
        self._unfinished.pop(self._recipe, None)
        self._print(event, **values)

    def _print(self, event: str, **values: Any) -> None:
        print(json.dumps({"event": event, "recipe": self._recipe, **values}), flush=True)


def shows_interruption(view: BuildView) -> AbstractContextManager[None]:
    """Let ``view`` show it if a signal ends the process inside this context."""
    return if_interrupted(view.interrupted)


def view_for(json_lines: bool, quiet: bool, verbose: bool, several: bool = False) -> BuildView:
    """Return the view for these options and one recipe or ``several``.

    Bars are shown only if stderr is a terminal.
    """
    if json_lines:
        return JsonView()
    if quiet:
        return BuildView()
    if not sys.stderr.isatty():
        return LineView(verbose)
    return TableView(verbose) if several else BarView(verbose)


def print_failed(failed: Mapping[Path, str]) -> None:
    """Print why recipes have failed; each line begins with the recipe, or with a file it uses."""
    for recipe, why in failed.items():
        for line in why.splitlines():
            is_placed = re.match(r"\S.*:\d+: ", line) or line.startswith(str(recipe))
            print(printable(f"  {line}" if is_placed else f"  {recipe}: {line}"))


def _totals(outcomes: Sequence[Outcome | str], count: int) -> str:
    """Return how many of ``count`` recipes were built, up to date or failed."""
    fresh = [outcome.fresh for outcome in outcomes if not isinstance(outcome, str)]
    numbers = {
        "built": fresh.count(False),
        "up to date": fresh.count(True),
        "failed": len(outcomes) - len(fresh),
        "not built": count - len(outcomes),
    }
    parts = [f"{number} {result}" for result, number in numbers.items() if number]
    return f"{count} recipes: {', '.join(parts)}"


def _cells(outcome: Outcome | str) -> tuple[str, str, str]:
    """Return result, number of files and seconds of a recipe in the table."""
    if isinstance(outcome, str):
        return "failed", "", ""
    return "built", str(len(outcome.files)), f"{sum(outcome.timings.values()):.1f}"


def _summary(outcome: Outcome) -> str:
    if outcome.fresh:
        return "up to date"
    seconds = sum(outcome.timings.values())
    folder = outcome.files[0].parent if outcome.files else ""
    return f"{len(outcome.files)} files in {folder} ({seconds:.1f} s)"
