"""Node.js and the web clients."""

import os
import shutil
from pathlib import Path

import pytest

WEB = Path(__file__).parent / "web"
PACKAGES = ("pixi.js", "phaser", "phaser4", "playwright-core")


def _missing(advice: str) -> None:
    """Skip what cannot be run here; but on CI nothing may be missing."""
    if os.environ.get("CI"):
        pytest.fail(advice)
    pytest.skip(advice)


@pytest.fixture(scope="session")
def node() -> str:
    """Return the Node.js that has the web clients."""
    modules = Path(os.environ.get("FIRE_ATLAS_NODE_MODULES") or WEB / "node_modules")
    found = shutil.which("node")
    if not found or not all((modules / package).is_dir() for package in PACKAGES):
        _missing("needs Node.js 20 or later and `npm ci --prefix tests/exporters/web`")
    assert found is not None
    return found


@pytest.fixture(scope="session")
def chromium() -> Path:
    """Return the browser that plays atlases."""
    path = Path(os.environ.get("CHROMIUM") or "/usr/bin/chromium")
    if not path.exists():
        _missing("needs Chromium (Debian: apt-get install chromium), or CHROMIUM to name one")
    return path
