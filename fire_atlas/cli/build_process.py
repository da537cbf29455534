"""Build recipes one after the other in a process that another ``fire-atlas build`` has started.

Each line of stdin is a JSON array: the arguments of one ``build --json``. Its events go to stdout,
then a line ``{"event": "exit", "code": ..., "errors": ...}`` with what it printed on stderr. The
process ends when its stdin closes, even in the middle of a build, so that none goes on when nobody
waits for it. numpy and OpenCV are imported once, for the first recipe.
"""

import os
import signal
import sys
from queue import SimpleQueue
from threading import Thread

from fire_atlas.core.interruption import end_on_signals, if_interrupted


def main() -> None:
    """Answer requests until stdin closes."""
    end_on_signals()  # before anything else is imported
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no event
    requests = SimpleQueue[str | None]()
    Thread(target=_read, args=(requests,), daemon=True).start()
    with if_interrupted(_silence):
        while request := requests.get():
            _answer(request)


def _read(requests: "SimpleQueue[str | None]") -> None:
    """Pass on the lines of stdin; at its end, end the process as a signal would."""
    for line in sys.stdin:
        requests.put(line)
    requests.put(None)
    os.kill(os.getpid(), signal.SIGTERM)


def _silence() -> None:
    """Print nothing more on stderr: the process that started this one says what happened."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def _answer(request: str) -> None:
    import json
    from contextlib import redirect_stderr
    from io import StringIO

    from fire_atlas.cli import main as run

    with redirect_stderr(StringIO()) as errors:
        code = run(["build", *json.loads(request)])
    print(json.dumps({"event": "exit", "code": code, "errors": errors.getvalue()}), flush=True)


if __name__ == "__main__":
    main()
