"""Fixtures of the whole-build tests."""

from pathlib import Path

import pytest

from .desk import Desk


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    """Return an empty folder to work in."""
    return Desk(tmp_path / "desk")


@pytest.fixture
def recipe(desk: Desk) -> Path:
    """Return a recipe that was built once; with another seed it gives other files."""
    desk.clip()
    recipe = desk.recipe()
    desk.built(recipe)
    return recipe
