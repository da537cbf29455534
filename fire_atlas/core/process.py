"""Run a module of the tool in a separate process.

For code that might crash the build, or that holds Python's interpreter lock for long.
"""

import os
import subprocess
import sys
from pathlib import Path

from fire_atlas.core.interruption import if_interrupted

_IMPORT_ROOT = str(Path(__file__).resolve().parents[2])


def start_module(
    module: str, *arguments: str, stderr: int | None = None
) -> "subprocess.Popen[bytes]":
    """Start a module of this tool, with pipes to its stdin and from its stdout.

    Files in the working folder cannot shadow modules (``-P``). Ctrl-C does not reach the process.
    """
    # An empty entry would mean the working folder.
    given = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    search = os.pathsep.join([_IMPORT_ROOT, *given])
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        env={**os.environ, "PYTHONPATH": search},
        start_new_session=True,
    )


def run_module(
    module: str, data: bytes, seconds: float | None = None
) -> "subprocess.CompletedProcess[bytes]":
    """Run a module of this tool with ``data`` as its stdin, and return its exit code and output.

    If a signal ends the build, the process is killed.

    Raises:
        subprocess.TimeoutExpired: It took longer than ``seconds``, and was killed.
    """
    with start_module(module, stderr=subprocess.PIPE) as process, if_interrupted(process.kill):
        try:
            out, err = process.communicate(data, seconds)
        except BaseException:
            process.kill()
            raise
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)
