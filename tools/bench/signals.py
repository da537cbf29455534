"""Where a command does not hear a signal for long: ``python -m tools.bench.signals build RECIPE``.

A timer sends signals all the time. Python runs their handler in the main thread between two of its
instructions, so a gap between two of these is a call that takes long. Bound: 1 s, at pages of
4096 x 4096 px on two cores.
"""

import signal
import sys
import time
import traceback
from types import FrameType

from fire_atlas.cli import main

_EVERY = 0.02
_WORTH_TELLING = 0.25


class Gaps:
    """How long no signal was heard, and where the main thread was."""

    def __init__(self) -> None:
        self.longest: list[tuple[float, str]] = []
        self._last = time.monotonic()

    def heard(self, _: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if now - self._last > _WORTH_TELLING:
            lines = [f"{each.filename}:{each.lineno}" for each in traceback.extract_stack(frame)]
            self.longest.append((now - self._last, " < ".join(reversed(lines[-4:]))))
        self._last = now


if __name__ == "__main__":
    gaps = Gaps()
    signal.signal(signal.SIGALRM, gaps.heard)
    signal.setitimer(signal.ITIMER_REAL, _EVERY, _EVERY)
    code = main(sys.argv[1:])
    signal.setitimer(signal.ITIMER_REAL, 0)
    for seconds, where in sorted(gaps.longest, reverse=True)[:10]:
        print(f"{seconds:.2f} s at {where}")
    print(f"exit code {code}; {len(gaps.longest)} gaps of more than {_WORTH_TELLING} s")
