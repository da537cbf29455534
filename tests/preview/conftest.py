"""The browser in which pages are looked at."""

from pathlib import Path

import pytest

from tests.preview.browser import Browser


@pytest.fixture(scope="session")
def browser(node: str, chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Browser:
    return Browser(node, tmp_path_factory.mktemp("browser"))
