"""What tests of several rooms share."""

import os
import sys
from pathlib import Path

import pytest

# Test files are imported one by one (--import-mode=importlib), so helpers need a place on the path.
sys.path += [str(Path(__file__).parent / room) for room in ("sources", "effect")]


@pytest.fixture(scope="session")
def clips() -> Path:
    """Return the folder of real fire clips that FIRE_ATLAS_CLIPS names."""
    named = os.environ.get("FIRE_ATLAS_CLIPS")
    if named:
        return Path(named)
    advice = "FIRE_ATLAS_CLIPS does not name a folder of real clips"
    if os.environ.get("CI"):
        pytest.fail(f"{advice}, and on CI they must not be missing")
    pytest.skip(advice)
