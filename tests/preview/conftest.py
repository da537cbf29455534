"""The browser in which pages are looked at."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.preview.browser import Browser


@pytest.fixture(scope="session")
def browser(node: str, chromium: Path) -> Iterator[Browser]:
    with Browser(node) as browser:
        yield browser
