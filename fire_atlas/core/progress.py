"""Report the progress of a build, and measure how long each stage takes."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol


class Progress(Protocol):
    """Receives the progress of a build. The command line implements it to show the user."""

    def stage(self, name: str, total: int) -> None:
        """Begin stage ``name``, which has ``total`` steps."""

    def advance(self, done: int = 1) -> None:
        """Count ``done`` more steps of the stage as done."""

    def note(self, message: str) -> None:
        """Show the user a sentence that is worth knowing but no error."""


@dataclass(frozen=True, slots=True)
class WithNotes:
    """The ``progress`` of a build, for a part of it whose notes ``tell`` is given instead."""

    progress: Progress
    tell: Callable[[str], None]

    def stage(self, name: str, total: int) -> None:
        """Begin a stage of the build."""
        self.progress.stage(name, total)

    def advance(self, done: int = 1) -> None:
        """Count steps of the build."""
        self.progress.advance(done)

    def note(self, message: str) -> None:
        """Tell what is worth knowing of the part."""
        self.tell(message)


class SilentProgress:
    """A ``Progress`` that shows nothing."""

    def stage(self, name: str, total: int) -> None:
        """Do nothing."""

    def advance(self, done: int = 1) -> None:
        """Do nothing."""

    def note(self, message: str) -> None:
        """Do nothing."""


@dataclass(slots=True)
class StageTimer:
    """Seconds spent in each stage of a build; the times of repeated stages are added."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Add the time spent inside this context to the time of ``stage``."""
        start = time.perf_counter()
        yield
        spent = self.seconds.get(stage, 0.0) + time.perf_counter() - start
        self.seconds[stage] = round(spent, 4)
