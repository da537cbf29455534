"""Fixtures of the whole-build tests."""

from pathlib import Path

import pytest

from tests.support.repo import Repo


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    """Return an empty folder to work in."""
    return Repo(tmp_path / "repo")


@pytest.fixture
def recipe(repo: Repo) -> Path:
    """Return a recipe that was built once; with another seed it gives other files."""
    repo.clip()
    recipe = repo.recipe()
    repo.built(recipe)
    return recipe
