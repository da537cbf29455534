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
from fire_atlas.core.process import start_module
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.recording import FluidRecording, record
from fire_atlas.generators.fluid.scene import Scene
from fire_atlas.generators.fluid.simulation import MOST_THREADS

_FRAME, _RESULT = b".", b"\n"
"""What the process writes after each frame, and before its result."""


def record_apart(scene: Scene, jobs: int, count: Callable[[], None]) -> FluidRecording:
    """Simulate a scene in a process with up to ``jobs`` threads.

    ``count`` is called after each frame.

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
        result: FluidRecording | str = ""
        try:
            with suppress(BrokenPipeError), to:  # if it has ended, its exit code is told below
                to.write(pickle.dumps((scene, jobs)))
            while (told := answers.read(1)) == _FRAME:
                count()
            if told == _RESULT:
                # If it ends in the middle of it, its exit code is told below.
                with suppress(EOFError, pickle.UnpicklingError):
                    # Each frame is read into the memory that it is kept in.
                    result = pickle.load(answers)
            said = errors.read()
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        raise RuntimeError(f"the simulation ended early: {said.decode(errors='replace')}")
    if isinstance(result, FluidRecording):
        return result
    raise RecipeError(result, key=("source",))


def main() -> None:
    """Simulate the scene of stdin, and write the recording, or what broke it, to stdout."""
    cv2.setUseOptimized(False)
    scene, jobs = pickle.load(sys.stdin.buffer)

    def count() -> None:
        sys.stdout.buffer.write(_FRAME)
        sys.stdout.buffer.flush()

    with Workers(min(jobs, MOST_THREADS)) as workers:
        try:
            result: FluidRecording | str = record(scene, workers, count)
        except RecipeError as error:
            result = str(error)
    sys.stdout.buffer.write(_RESULT)
    pickle.dump(result, sys.stdout.buffer)


if __name__ == "__main__":
    main()
