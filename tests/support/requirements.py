"""What tests need besides Python packages: programs and folders that a machine may lack."""

import os
from pathlib import Path
from typing import NoReturn

import pytest


def missing(advice: str) -> NoReturn:
    """Skip a test that cannot be run here, saying what it needs; on CI nothing may be missing."""
    if os.environ.get("CI"):
        pytest.fail(f"{advice}; on CI it must not be missing")
    pytest.skip(advice)


def real_clips() -> Path:
    """Return the folder of real clips that FIRE_ATLAS_CLIPS names; skip the test without it."""
    named = os.environ.get("FIRE_ATLAS_CLIPS")
    return Path(named) if named else missing("FIRE_ATLAS_CLIPS does not name a folder of clips")


def node_modules() -> Path:
    """Return the folder of the Node.js packages, which ``FIRE_ATLAS_NODE_MODULES`` can name."""
    own = Path(__file__).parents[1] / "formats" / "web" / "node_modules"
    return Path(os.environ.get("FIRE_ATLAS_NODE_MODULES") or own)
