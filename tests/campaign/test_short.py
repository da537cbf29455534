"""A short run of each campaign; a long one is for whoever changes how files are put in place."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="forks and signals of POSIX"),
]


@pytest.mark.parametrize(
    ("campaign", "count"),
    [
        ("kill", 3),
        ("commit", 3),
        ("disk", 2),
        ("exchange", 2),
        ("limit", 2),
        ("watch", 2),
        ("concurrent", 3),
        ("power", 3),
        ("fuzz", 20),
        ("stale", 3),
        ("cache", 6),
        ("agree", 100),
    ],
)
def test_a_short_campaign_finds_no_fault(campaign: str, count: int) -> None:
    line = [sys.executable, "-m", "tests.campaign", campaign, "--count", str(count), "--seed", "18"]
    done = subprocess.run(
        line, cwd=PROJECT, env={**os.environ, "PYTHONPATH": str(PROJECT)}, capture_output=True,
        text=True, timeout=200, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
