"""Godot 4, which opens and plays what a build writes."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.godot4 import PACKAGE, Godot4
from tests.support.requirements import missing, node_modules


@pytest.fixture(scope="session")
def godot4(chromium: Path) -> Iterator[Godot4]:
    """Yield Godot 4.6, whose web runtime the browser runs."""
    runtime = node_modules() / PACKAGE / "godot"
    if not runtime.is_dir():
        missing("needs Godot 4's web runtime: `npm ci --prefix tests/formats/web`")
    with Godot4(runtime, chromium) as engine:
        yield engine
