"""SIGKILL at random instants of a build over an older good one; then the next command.

Every other kill waits until files are put in place, which is short beside all the rest.
"""

import os
import random
import signal
import tempfile
import time
from pathlib import Path

from fire_atlas.outputs.recovery import staging_folder
from tests.campaign.stage import NEW, NEXT, Stage, code_of, seconds_of

_COUNT = 1000
_COMMIT = 0.01
"""Seconds that a commit takes at most."""


def run(count: int | None, seed: int) -> list[str]:
    """Kill ``count`` builds and return what was wrong."""
    chance, faults, killed, halfway = random.Random(seed), list[str](), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        journal = staging_folder(stage.out, "fire").journal
        whole = max(seconds_of(lambda: stage.run("build", *NEW, "--force")) for _ in range(3))
        for i in range(count or _COUNT):
            stage.reset()
            is_late = i % 2 == 1
            instant = chance.uniform(0, _COMMIT if is_late else whole)
            killed += _kill(stage, instant, journal if is_late else None)
            halfway += journal.exists()
            command = chance.choice(NEXT)
            found = stage.faults_after_death() + stage.then(command)
            if command in {"check", "clean"}:
                found += stage.then("build new")
            when = f"{instant:.4f} s into the {'commit' if is_late else 'build'}"
            faults += [f"{i}: {when}, then {command}: {fault}" for fault in found]
    print(f"{count or _COUNT} builds, {killed} killed before they ended, {halfway} in a commit")
    return faults


def _kill(stage: Stage, seconds: float, journal: Path | None) -> bool:
    """Kill a build some time after it began, or after ``journal`` appeared; return whether it had
    not ended by then."""
    pid = stage.start("build", *NEW)
    ended, status = 0, 0
    while journal is not None and not journal.exists() and not ended:
        ended, status = os.waitpid(pid, os.WNOHANG)
    if ended:
        return os.waitstatus_to_exitcode(status) < 0
    time.sleep(seconds)
    os.kill(pid, signal.SIGKILL)
    return code_of(pid) < 0
