"""Freed memory is used again."""

import platform
import subprocess
import sys

import pytest

_FAULTS = """
import sys, threading
from resource import RUSAGE_SELF, getrusage
import numpy as np
from fire_atlas.core.memory import keep_freed_memory

def make_and_free(times):
    for _ in range(times):
        arrays = [np.ones(1 << 20, np.uint8) for _ in range(16)]

if sys.argv[1] == "kept":
    keep_freed_memory()
thread = threading.Thread(target=make_and_free, args=(3,))
thread.start()
thread.join()
before = getrusage(RUSAGE_SELF).ru_minflt
thread = threading.Thread(target=make_and_free, args=(50,))
thread.start()
thread.join()
print(getrusage(RUSAGE_SELF).ru_minflt - before)
"""


def page_faults(kept: str) -> int:
    """Return how often the system had to give a page of memory to 800 arrays of 1 MiB."""
    run = [sys.executable, "-c", _FAULTS, kept]
    return int(subprocess.run(run, capture_output=True, text=True, check=True).stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc can be told")
def test_freed_memory_is_used_again() -> None:
    by_default, kept = page_faults("returned"), page_faults("kept")
    assert by_default > 1000
    assert kept < by_default / 10
