"""What makes the bytes of an output, and so makes it stale when it is another."""

from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from unittest.mock import Mock

import pytest

from fire_atlas.outputs.digest import libraries, tool_digest

BEHIND_THE_BYTES = [
    "av", "jinja2", "numpy", "opencv-contrib-python-headless", "pillow", "pydantic", "pyoxipng",
    "pyyaml", "scipy",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _looked_at_anew() -> Iterator[None]:
    tool_digest.cache_clear()
    yield
    tool_digest.cache_clear()


@pytest.fixture(params=["installed", "checkout"])
def _origin(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> list[str]:
        raise metadata.PackageNotFoundError(name)

    if request.param == "checkout":
        monkeypatch.setattr(metadata, "requires", absent)
        project = Path(__file__).parents[2] / "pyproject.toml"
        monkeypatch.setattr("fire_atlas.outputs.digest._CHECKOUT", project)


@pytest.mark.usefixtures("_origin")
def test_every_library_that_makes_outputs_counts_and_no_other() -> None:
    assert set(BEHIND_THE_BYTES) <= set(libraries())
    assert {"pytest", "mypy", "ruff", "hypothesis", "fsspec"}.isdisjoint(libraries())


@pytest.mark.parametrize("library", BEHIND_THE_BYTES)
def test_another_version_of_a_library_is_another_tool(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, known = tool_digest(), metadata.distribution
    newer = Mock(read_text=lambda _: f"Name: {library}\nVersion: 99\n\nVersion: 1\n")
    monkeypatch.setattr(
        metadata, "distribution", lambda name: newer if name == library else known(name)
    )
    tool_digest.cache_clear()
    assert tool_digest() != before
