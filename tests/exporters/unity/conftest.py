"""Mono, which compiles and runs the C# that Unity would."""

import os
import shutil

import pytest


@pytest.fixture(scope="session")
def mono() -> None:
    """Be sure of a C# compiler and what runs its programs."""
    if shutil.which("mcs") and shutil.which("mono"):
        return
    advice = "needs Mono (Debian: apt-get install mono-mcs mono-runtime libmono-system-core4.0-cil)"
    if os.environ.get("CI"):
        pytest.fail(advice)
    pytest.skip(advice)
