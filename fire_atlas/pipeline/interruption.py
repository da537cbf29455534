"""Ctrl-C and SIGTERM end a build only where that does no harm."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

from fire_atlas.core.progress import Progress

_TOO_LATE = "interrupted when the outputs of this build were in place already"


class Interruptible:
    """A ``Progress`` at whose steps, and nowhere else, a signal ends the build.

    Python would raise ``KeyboardInterrupt`` wherever the main thread happens to be. Inside one of
    the pool's locks, that leaves the lock taken for good; while outputs are put in place, it makes
    them a mixture.
    """

    def __init__(self, progress: Progress) -> None:
        """Pass on to ``progress`` whatever is told."""
        self._progress = progress
        self._caught: list[int] = []
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        """Take the signals over, but for those that this process was told to ignore."""
        if threading.current_thread() is threading.main_thread():  # others never get any
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._before[number] = signal.signal(number, self._catch)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Give the signals back, to be handled as they would have been."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
        for caught in self._caught:
            try:
                signal.raise_signal(caught)
            except KeyboardInterrupt:
                raise KeyboardInterrupt(*([] if kind else [_TOO_LATE])) from None

    def stage(self, name: str, total: int) -> None:
        """Pass it on."""
        self._heed()
        self._progress.stage(name, total)

    def advance(self, done: int = 1) -> None:
        """Pass it on."""
        self._heed()
        self._progress.advance(done)

    def note(self, message: str) -> None:
        """Pass it on."""
        self._heed()
        self._progress.note(message)

    def _catch(self, number: int, _: FrameType | None) -> None:
        self._caught.append(number)

    def _heed(self) -> None:
        if self._caught:
            raise KeyboardInterrupt
