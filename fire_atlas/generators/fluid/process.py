"""Simulate in a process of its own, so that the same bytes come of any CPU of an architecture.

OpenCV's look-ups round otherwise with newer instruction sets, and gas is chaotic: after two seconds
a last bit is another plume. ``cv2.setUseOptimized(False)`` ends that, at no cost that was measured,
but it is a setting of the whole process, in which other threads may draw. A process can also be
ended in the middle of a step.
"""

import pickle
import sys

import cv2

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.process import run_module
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.recording import FluidRecording, record
from fire_atlas.generators.fluid.scene import Scene


def record_apart(scene: Scene, jobs: int) -> FluidRecording:
    """Simulate a scene in a process with ``jobs`` threads.

    Raises:
        RecipeError: A field is not finite any more.
    """
    done = run_module(__name__, pickle.dumps((scene, jobs)))
    if done.returncode:
        raise RuntimeError(f"the simulation ended early: {done.stderr.decode(errors='replace')}")
    result = pickle.loads(done.stdout)
    if isinstance(result, FluidRecording):
        return result
    raise RecipeError(result, key=("source",))


def main() -> None:
    """Simulate the scene of stdin, and write the recording, or what broke it, to stdout."""
    cv2.setUseOptimized(False)
    scene, jobs = pickle.load(sys.stdin.buffer)
    with Workers(jobs) as workers:
        try:
            result: FluidRecording | str = record(scene, workers)
        except RecipeError as error:
            result = str(error)
    sys.stdout.buffer.write(pickle.dumps(result))


if __name__ == "__main__":
    main()
