"""The engine."""

import os

import pytest

from .engine import PROGRAMS, missing_programs


@pytest.fixture(scope="session")
def godot() -> None:
    """See that there is an engine to be asked: it may lack here, but not on CI."""
    if not missing_programs():
        return
    advice = f"needs Godot 3 (Debian: apt-get install {' '.join(PROGRAMS[:2])} xvfb)"
    if os.environ.get("CI"):
        pytest.fail(advice)
    pytest.skip(advice)
