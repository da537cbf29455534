"""What tests need besides Python packages: programs and folders that a machine may lack."""

import os
from typing import NoReturn

import pytest


def missing(advice: str) -> NoReturn:
    """Skip a test that cannot be run here, saying what it needs; on CI nothing may be missing."""
    if os.environ.get("CI"):
        pytest.fail(f"{advice}; on CI it must not be missing")
    pytest.skip(advice)
