"""Progress of a build: who is informed of it, and how long each stage takes."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol


class Progress(Protocol):
    """Receives every stage of a build; the command line decides how people see it."""

    def stage(self, name: str, total: int) -> None:
        """Begin stage ``name``, which has ``total`` steps."""

    def advance(self, done: int = 1) -> None:
        """Count ``done`` more steps of the stage as done."""

    def note(self, message: str) -> None:
        """Pass a sentence on to the user: something worth knowing that is no error."""


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
    """Seconds spent in each stage of a build; a stage may be entered several times."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Add the time spent inside this context to that of ``stage``."""
        start = time.perf_counter()
        yield
        spent = self.seconds.get(stage, 0.0) + time.perf_counter() - start
        self.seconds[stage] = round(spent, 4)
