"""Fixtures of the whole-build tests."""

from pathlib import Path

import pytest

from .desk import Desk


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    """Return an empty folder to work in."""
    return Desk(tmp_path / "desk")
