"""Benchmarks: scripts to run by hand, each prints a table and fails past its bounds."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
