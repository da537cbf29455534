"""What tests of several rooms share."""

import os
import shutil
import sys
from pathlib import Path
from typing import NoReturn

import pytest
from hypothesis import settings

from fire_atlas.core.cpu import pin_kernels

settings.register_profile("untimed", deadline=None)  # timings live in benchmarks
settings.load_profile("untimed")

pin_kernels()  # as the command line does, before any test imports numpy

# Test files are imported one by one (--import-mode=importlib), so helpers need a place on the path.
sys.path += [
    str(Path(__file__).parent / room)
    for room in ("effect", "maps", "profile", "sources", "timeline")
]


WEB = Path(__file__).parent / "exporters" / "web"
PACKAGES = ("pixi.js", "phaser", "phaser4", "playwright-core")


def _missing(advice: str) -> NoReturn:
    """Skip what cannot be run here; but on CI nothing may be missing."""
    if os.environ.get("CI"):
        pytest.fail(f"{advice}; on CI it must not be missing")
    pytest.skip(advice)


@pytest.fixture(scope="session")
def clips() -> Path:
    """Return the folder of real fire clips that FIRE_ATLAS_CLIPS names."""
    named = os.environ.get("FIRE_ATLAS_CLIPS")
    return Path(named) if named else _missing("FIRE_ATLAS_CLIPS does not name a folder of clips")


@pytest.fixture(scope="session")
def node() -> str:
    """Return the Node.js that has the web clients and the browser's driver."""
    modules = Path(os.environ.get("FIRE_ATLAS_NODE_MODULES") or WEB / "node_modules")
    found = shutil.which("node")
    if found and all((modules / package).is_dir() for package in PACKAGES):
        return found
    _missing("needs Node.js 20 or later and `npm ci --prefix tests/exporters/web`")


@pytest.fixture(scope="session")
def chromium() -> Path:
    """Return the browser that plays atlases and pages."""
    path = Path(os.environ.get("CHROMIUM") or "/usr/bin/chromium")
    if path.exists():
        return path
    _missing("needs Chromium (Debian: apt-get install chromium), or CHROMIUM to name one")
