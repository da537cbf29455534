"""Mono, which compiles and runs the C# that Unity would."""

import shutil

import pytest

from tests.support.requirements import missing

PACKAGES = "mono-mcs mono-runtime libmono-system-core4.0-cil"


@pytest.fixture(scope="session")
def mono() -> None:
    """Require a C# compiler and what runs its programs."""
    if not (shutil.which("mcs") and shutil.which("mono")):
        missing(f"needs Mono (Debian: apt-get install {PACKAGES})")
