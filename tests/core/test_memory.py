"""Freed memory is used again."""

import platform
import sys

import pytest

from tests.support.repo import run_alone

_FAULTS = """
import sys
from resource import RUSAGE_SELF, getrusage
from threading import Thread
import numpy as np
from fire_atlas.core.memory import keep_freed_memory

def page_faults():
    return getrusage(RUSAGE_SELF).ru_minflt

def make_and_free(times):
    for _ in range(times):
        arrays = [np.ones(3_000_000, np.uint8) for _ in range(8)]
        del arrays

def work():
    make_and_free(3)
    before = page_faults()
    make_and_free(50)
    print(page_faults() - before)

if sys.argv[1] == "kept":
    keep_freed_memory()
worker = Thread(target=work)
worker.start()
worker.join()
"""


def page_faults(freed: str) -> int:
    """Return how many pages of memory the system gave to 400 arrays of 3 MB in a worker's thread,
    after others; memory that is ``freed`` is ``returned``, or ``kept``."""
    ran = run_alone([sys.executable, "-c", _FAULTS, freed])
    assert ran.code == 0, ran.err
    return int(ran.out)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc can be told")
def test_freed_memory_is_used_again() -> None:
    returned, kept = page_faults("returned"), page_faults("kept")
    assert returned > 10_000
    assert kept < returned / 10
