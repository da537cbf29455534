"""A console and progress bars by rich that print text without interpreting it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from fire_atlas.cli.text import printable


class PlainConsole(Console):
    """A console that interprets no markup, emoji codes or control characters in texts."""

    def __init__(self, *, stderr: bool = False) -> None:
        """Print on stdout or ``stderr``."""
        super().__init__(stderr=stderr, highlight=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return ``text`` without interpreting it."""
        return super().render_str(
            printable(text), **{**options, "markup": False, "emoji": False, "highlight": False}
        )


class _RateColumn(ProgressColumn):
    """A column with the steps per second of a stage."""

    def render(self, task: Task) -> Text:
        """Return the rate of ``task``."""
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.1f}/s" if speed else "", style="progress.data.speed")


def _new_progress() -> Progress:
    """Return an empty display of bars on stderr: steps done, rate, time left."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        _RateColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=PlainConsole(stderr=True),
    )


class ProgressBars:
    """Bars for the stages of one build."""

    def __init__(self, title: str) -> None:
        """Show the bars under ``title``."""
        self._progress = _new_progress()
        self._task: TaskID | None = None
        self._progress.console.print(title, style="bold")
        self._progress.start()

    def stage(self, name: str, total: int) -> None:
        """Add a bar for a stage."""
        self._task = self._progress.add_task(printable(name), total=total)

    def advance(self, done: int) -> None:
        """Move the newest bar."""
        if self._task is not None:
            self._progress.advance(self._task, done)

    def note(self, message: str) -> None:
        """Print a line above the bars."""
        self._progress.console.print(message)

    def close(self) -> None:
        """Stop redrawing; the bars stay as they are."""
        self._progress.stop()


class RecipeBars:
    """A bar for each recipe that is being built, below one for the recipes that are done."""

    def __init__(self, count: int) -> None:
        """Show that none of ``count`` recipes is done yet."""
        self._progress = _new_progress()
        self._total = self._progress.add_task("recipes", total=count)
        self._tasks: dict[Path, TaskID] = {}
        self._progress.start()

    def stage(self, recipe: Path, name: str, total: int) -> None:
        """Show a new stage of a recipe."""
        description = printable(f"{recipe}: {name}")
        if recipe in self._tasks:
            self._progress.reset(self._tasks[recipe], total=total, description=description)
        else:
            self._tasks[recipe] = self._progress.add_task(description, total=total)

    def advance(self, recipe: Path, done: int) -> None:
        """Move the bar of a recipe."""
        self._progress.advance(self._tasks[recipe], done)

    def remove(self, recipe: Path) -> None:
        """Count a recipe as done, and remove its bar."""
        self._progress.advance(self._total)
        if recipe in self._tasks:
            self._progress.remove_task(self._tasks.pop(recipe))

    def note(self, message: str) -> None:
        """Print a line above the bars."""
        self._progress.console.print(message)

    def close(self) -> None:
        """Stop redrawing; the bars stay as they are."""
        self._progress.stop()


def print_results(results: Mapping[Path, tuple[str, str, str]]) -> None:
    """Print a table of recipes on stdout: result, number of files, seconds."""
    table = Table("recipe", "result", box=None, pad_edge=False)
    table.add_column("files", justify="right")
    table.add_column("s", justify="right")
    for recipe, cells in results.items():
        table.add_row(str(recipe), *cells)
    PlainConsole().print(table)
