"""One fault at every file operation of a build: the process is killed there, or the system says
that the disk is full, that it is not allowed, or that the device failed."""

import errno
import os
import random
import signal
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.campaign.forks import code_of
from tests.campaign.operations import Operations, operations_of
from tests.campaign.rows import chosen, run_rows
from tests.campaign.stage import NEXT, Stage

_FAULTS = {"killed or full": ("KILL", "ENOSPC"), "not allowed or failed": ("EACCES", "EIO")}
"""Two faults in turn at each operation, by the name of their row."""

_COUNT = 1_200
"""Faults that are tried by default: about half of all."""


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` faults at operations drawn by chance; there are about twice as many of both."""
    with tempfile.TemporaryDirectory() as folder:
        operations = operations_of(Stage(Path(folder)))
    print(f"{len(operations)} operations")
    tries = dict.fromkeys(_FAULTS, 2 * len(operations))
    return run_rows(faulty, chosen(tries, count or _COUNT, seed), seed)


def faulty(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Let operations fail, two numbers for each; return what was wrong each time."""
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        return [
            _try(stage, number // 2, _FAULTS[kind][number % 2], random.Random(f"{seed} {number}"))
            for number in numbers
        ]


def _try(stage: Stage, k: int, fault: str, chance: random.Random) -> list[str]:
    """Let the operation ``k`` fail, and run another command; return what is wrong after either."""
    stage.reset()
    code = code_of(stage.start_new(before=Operations(stage.out, _meets(k, fault)).go))
    found = stage.faults_after_death()
    if code >= 0:  # it could still put things right
        found += stage.faults_after(stage.old, stage.new, litter=True)
    command = chance.choice(NEXT)
    found += stage.then(command)
    if command in {"check", "clean"}:
        found += stage.then("build new")
    return [f"{fault} at operation {k}, then {command}: {each}" for each in found]


def _meets(at: int, fault: str) -> Callable[[int, str], None]:
    """Return what lets the operation ``at`` fail."""

    def meet(number: int, _: str) -> None:
        if number != at:
            return
        if fault == "KILL":
            os.kill(os.getpid(), signal.SIGKILL)
        code = getattr(errno, fault)
        raise OSError(code, os.strerror(code))

    return meet
