"""What tests of several rooms share."""

import os
import shutil
import signal
from pathlib import Path

import pytest
from hypothesis import settings

from fire_atlas.core.cpu import pin_kernels
from tests.support.requirements import missing, node_modules, real_clips

settings.register_profile("untimed", deadline=None)  # timings live in benchmarks
settings.load_profile("untimed")

pin_kernels()  # as the command line does, before any test imports numpy

os.environ.pop("FIRE_ATLAS_CACHE", None)  # what a test builds is built

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell's background jobs ignore Ctrl-C, and so would every command that a test interrupts.
    signal.signal(signal.SIGINT, signal.default_int_handler)

PACKAGES = (
    "ktx-parse", "melonjs", "pixi.js", "phaser", "phaser360", "phaser370", "phaser4",
    "playwright-core", "three",
)  # fmt: skip


MARKS = {
    "clips": "clips",
    "godot": "engine",
    "godot4": "engine",
    "mono": "engine",
    "node": "engine",
    "chromium": "browser",
}
"""Marks of the tests that use a fixture."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by what they need, so that ``-m "not engine and not browser"`` leaves them out."""
    for item in items:
        for fixture in MARKS.keys() & set(getattr(item, "fixturenames", ())):
            item.add_marker(MARKS[fixture])


@pytest.fixture(scope="session")
def clips() -> Path:
    """Return the folder of real fire clips that FIRE_ATLAS_CLIPS names."""
    return real_clips()


@pytest.fixture(scope="session")
def node() -> str:
    """Return the Node.js that has the web clients and the browser's driver."""
    found = shutil.which("node")
    if not (found and all((node_modules() / package).is_dir() for package in PACKAGES)):
        missing("needs Node.js 20 or later and `npm ci --prefix tests/formats/web`")
    return found


@pytest.fixture(scope="session")
def imagemagick() -> str:
    """Return ImageMagick's program that converts images."""
    found = (shutil.which(name) for name in ("magick", "convert-im6", "convert"))
    return next(filter(None, found), None) or missing("needs ImageMagick (Debian: imagemagick)")


@pytest.fixture(scope="session")
def chromium() -> Path:
    """Return the browser that plays atlases and pages."""
    path = Path(os.environ.get("CHROMIUM") or "/usr/bin/chromium")
    if not path.exists():
        missing("needs Chromium (Debian: apt-get install chromium), or CHROMIUM to name one")
    return path
