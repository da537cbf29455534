"""Commands that are killed at random instants, by SIGKILL, SIGTERM or SIGINT; then the next one.

Commands write over what an older one wrote. Every other kill waits until files are put in place,
where it can see that, which is short beside all the rest.

Wrong is a file that is half written, or one that no command may touch and that has changed. After
SIGTERM and SIGINT also: another exit code than 130, or than 0 with all files new; anything else on
stderr than the one line about it; files that are neither all old nor all new; and hidden files that
stay. After the next command: that it fails, or waits; a mixture; and hidden or temporary files.
"""

import os
import random
import signal
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from fire_atlas.core.interruption import EXIT_CODE, MESSAGE
from tests.campaign.forks import code_of, is_careless, seconds_of
from tests.campaign.rows import chosen, run_rows
from tests.campaign.stages import AnyStage, stage_of

_TRIES = {
    "cluster": 24, "build": 52, "movies": 36, "gpu": 36, "exr": 28, "learn": 28, "preview": 22,
    "preview --gif": 14, "init": 20, "plugin godot": 20, "plugin unity": 20,
}  # fmt: skip
"""Kills of a whole campaign; the slowest come first, so that they do not come alone at the end."""

_COMMIT = 0.01
"""Seconds that a commit takes at most."""

_SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


def run(count: int | None, seed: int) -> list[str]:
    """Kill commands, ``count`` of them drawn by chance; a cluster is part of whole campaigns."""
    tries = dict(_TRIES)
    if count is not None:
        del tries["cluster"]
    return run_rows(kills_of, chosen(tries, count, seed), seed)


def kills_of(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Kill one kind of command; return what was wrong each time."""
    with (
        tempfile.TemporaryDirectory(prefix="kill-") as folder,
        stage_of(kind, Path(folder)) as stage,
    ):
        whole = max(_seconds_of_new(stage) for _ in range(2))
        return [
            _kill(stage, number, whole, random.Random(f"{seed} {kind} {number}"))
            for number in numbers
        ]


def _seconds_of_new(stage: AnyStage) -> float:
    stage.reset()
    return seconds_of(lambda: code_of(stage.start_new()))


def _kill(stage: AnyStage, number: int, whole: float, chance: random.Random) -> list[str]:
    """Kill one command, run another, and return what is wrong after either."""
    stage.reset()
    is_late = number % 2 == 1 and bool(stage.journals)
    instant = chance.uniform(0, _COMMIT if is_late else whole)
    killer, command = _SIGNALS[number // 2 % len(_SIGNALS)], chance.choice(stage.next)
    pid = stage.start_new()
    if is_late:
        _wait_for_commit(stage, 2 * whole)
    time.sleep(instant)
    victim = chance.choice(stage.victims(pid))
    with suppress(ProcessLookupError):  # a worker's process has ended by itself
        os.kill(victim, killer)
    code, said = code_of(pid), stage.said.read_text()
    found = stage.faults_after_death()
    if code != -signal.SIGKILL:
        found += _faults_of_end(code, said, is_own=victim == pid)
        found += stage.faults_whole(*([stage.new] if code == 0 else [stage.old, stage.new]))
    found += stage.then(command)
    if command in {"check", "clean"}:
        found += stage.then("build new")
    when = f"{instant:.4f} s into the {'commit' if is_late else 'command'}"
    return [f"{killer.name} {when}, code {code}, then {command}: {fault}" for fault in found]


def _wait_for_commit(stage: AnyStage, seconds: float) -> None:
    """Wait until a command puts files in place, but no longer than it takes."""
    latest = time.monotonic() + seconds
    while not any(journal.exists() for journal in stage.journals) and time.monotonic() < latest:
        pass


def _faults_of_end(code: int, said: str, *, is_own: bool) -> list[str]:
    """Return what is wrong with how a command ended; ``is_own``: it got the signal itself, and not
    a process on a worker."""
    if is_careless(said):
        return [f"it has not thought of this: {said}"]
    if (code, said) in {(0, ""), (EXIT_CODE, f"error: {MESSAGE}\n")}:
        return []
    if not is_own and code == 1 and said.startswith("error: "):
        return []
    return [f"ended with {said!r}"]
