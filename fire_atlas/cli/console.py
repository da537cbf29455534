"""A console and progress bars by rich that print text without interpreting it."""

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


class ProgressBars:
    """Bars on stderr for the stages of one build: steps done, rate, time left."""

    def __init__(self, title: str) -> None:
        """Show the bars under ``title``."""
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            _RateColumn(),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=PlainConsole(stderr=True),
        )
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
