"""End the process at once on SIGINT and SIGTERM, leaving nothing half-written on the disk.

Python would raise ``KeyboardInterrupt`` out of any line of the main thread. That may be lost in a
finalizer or an import, leaves locks of a pool taken, and then waits for threads that still work.
So the process exits from within the handler of the signal, after it has run what was registered
here. The main thread must therefore make no call that takes long without returning to Python: such
calls go to the pool (``core/workers.py``), where waiting for them ends as soon as a signal comes.

Imported before anything else, so it imports next to nothing. What comes before, while Python
starts, is Python's own to handle.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

EXIT_CODE = 130
"""Exit code of a process that a signal ended."""

MESSAGE = "interrupted; every build's outputs are whole: as they were before it, or all new"

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_CLEANUP_SECONDS = 0.5
"""Time for all registered actions: writing into a pipe that nobody reads would take for ever."""

_registered: list[Callable[[], object]] = []


def end_on_signals() -> None:
    """Install the handlers: from now on, SIGINT and SIGTERM end the process with ``EXIT_CODE``.

    Signals that the parent process had ignored (``nohup``) stay ignored.
    """
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def ignore_signals() -> None:
    """Ignore signals from now on: only the end of the process is left to do."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def if_interrupted(action: Callable[[], object]) -> Iterator[None]:
    """Run ``action`` if a signal ends the process inside this context; the innermost runs first.

    It runs in the main thread between any two of its instructions, so it must need no lock.
    """
    _registered.append(action)
    try:
        yield
    finally:
        _registered.remove(action)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Defer signals that come inside this context until after it, whatever their handlers are."""
    import threading

    if threading.current_thread() is not threading.main_thread():  # others never get any
        yield
        return
    caught: list[int] = []
    before = {
        number: signal.signal(number, lambda received, _: caught.append(received))
        for number in _SIGNALS
        if signal.getsignal(number) not in (signal.SIG_IGN, None)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for received in caught:
            signal.raise_signal(received)


def _end(_: int, __: FrameType | None) -> None:
    ignore_signals()
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.signal(signal.SIGALRM, _leave)
        signal.setitimer(signal.ITIMER_REAL, _CLEANUP_SECONDS)
    for action in (*reversed(_registered), sys.stdout.flush):
        with suppress(Exception):
            action()
    _leave()


def _leave(*_: object) -> None:
    with suppress(OSError):
        os.write(2, f"error: {MESSAGE}\n".encode())
    os._exit(EXIT_CODE)
