"""Two commands at the same time in one folder, with slow renames too: never a mixture."""

import os
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.campaign.forks import code_of
from tests.campaign.stage import NEW, OLD, Stage

_COUNT = 200
_SLOWEST = 0.03
"""Seconds that a slow rename takes at most."""


def run(count: int | None, seed: int) -> list[str]:
    """Run ``count`` pairs of commands and return what was wrong."""
    chance, faults = random.Random(seed), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        for i in range(count or _COUNT):
            stage.reset()
            is_slow, is_clean = i % 2 == 1, i % 5 == 4
            slow = _slowly(chance.random()) if is_slow else lambda: None
            first = stage.start("build", *NEW, "--force", before=slow)
            time.sleep(chance.uniform(0, 0.1))
            other = ("clean",) if is_clean else ("build", *OLD, "--force")
            second = stage.start(*other, before=slow)
            codes = code_of(first), code_of(second)
            found = [] if codes == (0, 0) else [f"exit codes {codes}"]
            states = [stage.new, stage.others] if is_clean else [stage.new, stage.old]
            found += stage.faults_after(*states)
            kind = f"{'slow ' if is_slow else ''}{'build and clean' if is_clean else 'builds'}"
            faults += [f"{i} ({kind}): {fault}" for fault in found]
    print(f"{count or _COUNT} pairs")
    return faults


def _slowly(pace: float) -> Callable[[], None]:
    """Return what makes every rename and removal of a process take its time."""

    def slow_down() -> None:
        for name in ("replace", "unlink", "link"):
            setattr(os, name, _delayed(getattr(os, name), pace * _SLOWEST))

    return slow_down


def _delayed(call: Callable[..., Any], seconds: float) -> Callable[..., Any]:
    def delayed(*arguments: Any, **keys: Any) -> Any:
        time.sleep(seconds)
        return call(*arguments, **keys)

    return delayed
