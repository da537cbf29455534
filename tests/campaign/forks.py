"""Commands that run in forks of this process, which has imported all that they need: that is what
makes thousands of them quick."""

import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from fire_atlas.__main__ import main
from fire_atlas.core.interruption import end_on_signals

_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_SECONDS = 60
"""Far more than any command takes; SIGALRM ends one that still runs then."""


def fork(
    line: Sequence[str], said: Path, temporary: Path, before: Callable[[], None] = lambda: None
) -> int:
    """Run a command line of ``fire-atlas`` in a fork; return its process id.

    Args:
        line: Its arguments.
        said: A file for what it prints on stderr.
        temporary: The folder for its temporary files.
        before: Called in the fork first.
    """
    sys.stdout.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)  # until the fork has its own handlers
    pid = os.fork()
    if pid == 0:
        _become(line, said, temporary, before)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    return pid


def _become(
    line: Sequence[str], said: Path, temporary: Path, before: Callable[[], None]
) -> NoReturn:
    code = 99
    try:
        end_on_signals()
        signal.alarm(_SECONDS)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        os.environ["TMPDIR"], tempfile.tempdir = str(temporary), None
        before()
        sys.argv[1:] = line
        code = main()
    finally:
        os._exit(code)


def code_of(pid: int) -> int:
    """Wait for a process and return its exit code; negative where a signal ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def seconds_of(act: Callable[[], object]) -> float:
    """Return how long something takes."""
    begun = time.monotonic()
    act()
    return time.monotonic() - begun


def is_careless(said: str) -> bool:
    """Return whether a command ended as one that nobody had thought of."""
    return "Traceback" in said or "a bug in fire-atlas" in said
