"""Progress bars on stderr."""

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

from fire_atlas.cli.console import PlainConsole
from fire_atlas.cli.text import printable


class _Rate(ProgressColumn):
    """Steps a second."""

    def render(self, task: Task) -> Text:
        """Return the speed of ``task``."""
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.1f}/s" if speed else "", style="progress.data.speed")


class Bars:
    """A bar for each stage of one build: steps done, rate, time left."""

    def __init__(self, title: str) -> None:
        """Show the bars under ``title``."""
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            _Rate(),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=PlainConsole(stderr=True),
        )
        self._task: TaskID | None = None
        self._progress.console.print(title, style="bold")
        self._progress.start()

    def stage(self, name: str, total: int) -> None:
        """Add a bar."""
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
