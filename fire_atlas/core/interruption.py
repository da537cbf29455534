"""End the process at once on SIGINT and SIGTERM, with no half-written file on the disk.

By default Python raises ``KeyboardInterrupt`` at any line of the main thread. The exception may be
swallowed by a finalizer or an import, may leave locks taken, and waits for running threads. So
here the signal handler itself ends the process, after it has run the registered clean-up actions.

A handler runs only between two instructions of Python. So the main thread must not make long calls
into C: these go to the pool (``core/workers.py``), and the main thread waits for their results.

The handlers are installed as early as possible, so this module imports as little as possible.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from types import FrameType

EXIT_CODE = 130
"""Exit code of a process that a signal ended."""

MESSAGE = "interrupted; every build's outputs are whole: as they were before it, or all new"

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_CLEANUP_SECONDS = 5.0
"""Time limit for all actions together: a busy disk takes its time to remove files."""

_FLUSH_SECONDS = 0.5
"""Time limit for flushing stdout, which never returns if it is a pipe that nobody reads."""

_registered: list[Callable[[], object]] = []
_expected: list[str] = []
"""Messages of the contexts that SIGINT ends as meant, innermost last."""


def end_on_signals() -> None:
    """Install the handlers: from now on, SIGINT and SIGTERM end the process with ``EXIT_CODE``,
    unless it is meant to end so (``ends_by_interrupt``).

    Signals that the parent process had ignored (``nohup``) stay ignored.
    """
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def ignore_signals() -> None:
    """Ignore SIGINT and SIGTERM from now on, because the process is about to end."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def if_interrupted(action: Callable[[], object]) -> Iterator[None]:
    """Run ``action`` if a signal ends the process inside this context.

    Actions of nested contexts run innermost first. They must not take a lock: the main thread,
    which the signal stopped anywhere, may hold it.
    """
    _registered.append(action)
    try:
        yield
    finally:
        _registered.remove(action)


@contextmanager
def ends_by_interrupt(message: str) -> Iterator[None]:
    """Inside this context SIGINT is how the process is meant to end: with ``message`` and code 0.

    SIGTERM, by which others end it, stays an interruption.
    """
    _expected.append(message)
    try:
        yield
    finally:
        _expected.remove(message)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Handle signals that arrive inside this context only after it."""
    import threading

    if threading.current_thread() is not threading.main_thread():  # only that one gets signals
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


def _end(number: int, _: FrameType | None) -> None:
    ignore_signals()
    is_meant = number == signal.SIGINT and _expected
    ending = (0, _expected[-1]) if is_meant else (EXIT_CODE, f"error: {MESSAGE}\n")
    leave = partial(_leave, *ending)
    _leave_after(_CLEANUP_SECONDS, leave)
    for action in reversed(_registered):
        with suppress(Exception):
            action()
    _leave_after(_FLUSH_SECONDS, leave)
    with suppress(Exception):
        sys.stdout.flush()
    leave()


def _leave_after(seconds: float, leave: Callable[..., None]) -> None:
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.signal(signal.SIGALRM, leave)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _leave(code: int, message: str, *_: object) -> None:
    with suppress(OSError):
        os.write(2, message.encode())
    os._exit(code)
