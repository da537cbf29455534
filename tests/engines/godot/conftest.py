"""Godot 3, which opens and plays what a build writes."""

import pytest

from tests.engines.godot.engine import PROGRAMS, missing_programs
from tests.support.requirements import missing


@pytest.fixture(scope="session")
def godot() -> None:
    """Require the engine."""
    if missing_programs():
        missing(f"needs Godot 3 (Debian: apt-get install {' '.join(PROGRAMS[:2])} xvfb)")
