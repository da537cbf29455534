"""A short run of each campaign; whoever has time runs ``python -m tests.campaign`` for longer."""

import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


def assert_faultless(name: str, count: int) -> None:
    line = [sys.executable, "-m", "tests.campaign", name, "--count", str(count), "--seed", "18"]
    done = subprocess.run(line, cwd=PROJECT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_spoilt_input_of_every_kind_works_or_is_refused() -> None:
    assert_faultless("fuzz", 130)


def test_an_input_that_changes_during_a_build_is_never_called_fresh() -> None:
    assert_faultless("stale", 13)
