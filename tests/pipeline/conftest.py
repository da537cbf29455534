"""Fixtures of the whole-build tests."""

import shutil
from pathlib import Path

import pytest

from tests.support.repo import Repo


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    """Return an empty folder to work in."""
    return Repo(tmp_path / "repo")


@pytest.fixture(scope="session")
def built_repo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a repo whose recipe was built."""
    repo = Repo(tmp_path_factory.mktemp("built") / "repo")
    repo.clip()
    repo.built(repo.recipe())
    return repo.folder


@pytest.fixture
def recipe(repo: Repo, built_repo: Path) -> Path:
    """Return a recipe that was built once; with another seed it gives other files."""
    shutil.copytree(built_repo, repo.folder, dirs_exist_ok=True)
    return repo.folder / "fire.yaml"
