"""Simulate in a process of its own, so that the same bytes come of any CPU of an architecture.

OpenCV's look-ups round otherwise with newer instruction sets, and gas is chaotic: after two seconds
a last bit is another plume. ``cv2.setUseOptimized(False)`` ends that, at no cost that was measured,
but it is a setting of the whole process, in which other threads may draw. A process can also be
ended in the middle of a step.
"""

import pickle
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress

import cv2

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.interruption import if_interrupted
from fire_atlas.core.memory import LARGEST, keep_freed_memory
from fire_atlas.core.process import start_module
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.recording import record
from fire_atlas.generators.fluid.scene import Scene
from fire_atlas.generators.fluid.simulation import MOST_THREADS
from fire_atlas.generators.fluid.volume import Volume

_FRAME, _VOLUME, _RESULT = b".", b"+", b"\n"
"""What the process writes after each frame that is simulated, and before the gas of one and its
result."""

_SWITCH = 1e-4
"""Time, s, that a thread waits for the interpreter before another one, whose calls into numpy are
shorter than waking up takes, has to hand it over. Python's is 5e-3."""


def record_apart(
    scene: Scene, jobs: int, keep: Callable[[Volume], None], count: Callable[[], None]
) -> float | None:
    """Do what ``record`` does in a process with up to ``jobs`` threads.

    If a signal ends the build, the process is killed.

    Raises:
        RecipeError: A field is not finite any more.
    """
    with (
        start_module(__name__, stderr=subprocess.PIPE) as process,
        if_interrupted(process.kill),
    ):
        to, answers, errors = process.stdin, process.stdout, process.stderr
        assert to is not None
        assert answers is not None
        assert errors is not None
        result: float | str | None = None
        try:
            with suppress(BrokenPipeError), to:  # if it has ended, its exit code is told below
                to.write(pickle.dumps((scene, jobs)))
            # If it ends in the middle of what it says, its exit code is told below.
            with suppress(EOFError, pickle.UnpicklingError):
                while told := answers.read(1):
                    if told == _FRAME:
                        count()
                    elif told == _VOLUME:
                        keep(pickle.load(answers))
                    else:
                        result = pickle.load(answers)
            said = errors.read()
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        raise RuntimeError(f"the simulation ended early: {said.decode(errors='replace')}")
    if isinstance(result, str):
        raise RecipeError(result, key=("source",))
    return result


def main() -> None:
    """Simulate the scene of stdin, and write its gas, and what broke it if so, to stdout."""
    cv2.setUseOptimized(False)
    sys.setswitchinterval(_SWITCH)
    scene, jobs = pickle.load(sys.stdin.buffer)
    out = sys.stdout.buffer

    def keep(volume: Volume) -> None:
        out.write(_VOLUME)
        pickle.dump(volume, out)

    def count() -> None:
        out.write(_FRAME)
        out.flush()

    with Workers(min(jobs, MOST_THREADS)) as workers:
        # Each step makes its fields anew: to map them page by page took a tenth of the time.
        keep_freed_memory(LARGEST)
        try:
            result: float | str | None = record(scene, workers, keep, count)
        except RecipeError as error:
            result = str(error)
    out.write(_RESULT)
    pickle.dump(result, out)


if __name__ == "__main__":
    main()
