"""Build recipes in processes of this machine, which share its cores."""

import json
import signal
import subprocess
import time
from argparse import Namespace
from collections.abc import Container
from contextlib import ExitStack, suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Self

from fire_atlas.cli.side_by_side import BuildEvent, build_arguments
from fire_atlas.core.cpu import default_jobs
from fire_atlas.core.interruption import if_interrupted
from fire_atlas.core.process import start_module

_MODULE = "fire_atlas.cli.build_process"

_EXIT_SECONDS = 0.3
"""Seconds that processes get to remove their temporary files when a signal ends the command."""

_LAST_SECONDS = 5
"""Seconds that idle processes get to end by themselves."""


class BuildProcesses:
    """A ``Builder`` with up to ``--jobs`` processes.

    Recipes are built with one thread each, as long as there is one for every thread: that takes
    less time than one after the other with all threads, of which some always wait. A process builds
    many recipes, as importing numpy and OpenCV takes longer than a small recipe.
    """

    def __init__(self, args: Namespace) -> None:
        """Start no process yet; ``args`` are those of the command."""
        self._args = args
        self._jobs = args.jobs or default_jobs()
        self._stack = ExitStack()
        self._idle: list[subprocess.Popen[bytes]] = []
        self._busy: dict[subprocess.Popen[bytes], Path] = {}
        self._events: SimpleQueue[tuple[subprocess.Popen[bytes], BuildEvent]] = SimpleQueue()

    @property
    def has_room(self) -> bool:
        """Whether a thread is left for another recipe."""
        return len(self._busy) < self._jobs

    def start(self, recipe: Path, unfinished: int, failed: Container[str]) -> None:
        """Start a build with this recipe's share of the threads."""
        process = self._idle.pop() if self._idle else self._new_process()
        self._busy[process] = recipe
        threads = max(1, self._jobs // unfinished)
        request = json.dumps(build_arguments(recipe, self._args, threads, failed))
        assert process.stdin is not None
        with suppress(OSError):  # the process has died: the next event of it says so
            process.stdin.write(request.encode() + b"\n")
            process.stdin.flush()

    def receive(self) -> tuple[Path, BuildEvent]:
        """Wait for the next event of any build, and return it with the recipe."""
        while True:
            process, event = self._events.get()
            if process in self._busy:
                break
            self._idle.remove(process)  # only a process that builds sends anything but its end
        if event["event"] == "lost":
            return self._busy.pop(process), event
        recipe = self._busy[process]
        if event["event"] == "exit":
            self._idle.append(process)
            del self._busy[process]
        return recipe, event

    def _terminate(self) -> None:
        """End all processes, and give them time to remove their temporary files."""
        processes = [*self._busy, *self._idle]
        for process in processes:
            process.terminate()
        latest = time.monotonic() + _EXIT_SECONDS
        while time.monotonic() < latest and any(process.poll() is None for process in processes):
            time.sleep(0.01)

    def __enter__(self) -> Self:
        """Return the builder; leaving the context, or a signal inside it, ends its processes."""
        self._stack.enter_context(if_interrupted(self._terminate))
        return self

    def __exit__(self, *_: object) -> None:
        """Close the stdin of all processes, which ends them, and wait for that."""
        with self._stack:
            self._close()

    def _close(self) -> None:
        processes = [*self._busy, *self._idle]
        for process in processes:
            assert process.stdin is not None
            with suppress(OSError):
                process.stdin.close()
        for process in processes:
            try:
                process.wait(_LAST_SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()

    def _new_process(self) -> "subprocess.Popen[bytes]":
        process = start_module(_MODULE)
        Thread(target=self._read, args=(process,), daemon=True).start()
        return process

    def _read(self, process: "subprocess.Popen[bytes]") -> None:
        """Receive what a process sends until it ends."""
        assert process.stdout is not None
        with process.stdout as lines:
            for line in lines:
                if line.endswith(b"\n"):  # else it died while it wrote
                    self._events.put((process, json.loads(line)))
        message = how_it_ended(process.wait())
        self._events.put((process, {"event": "lost", "message": message}))


def how_it_ended(code: int) -> str:
    """Return what the exit code of a process that ended unexpectedly means."""
    if code >= 0:
        return f"the process that built it has ended with exit code {code}"
    message = f"the process that built it was ended by {signal.Signals(-code).name}"
    if -code == getattr(signal, "SIGKILL", None):
        return f"{message}, as systems do when memory runs out; fewer --jobs need less"
    return message
