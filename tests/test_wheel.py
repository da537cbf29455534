"""What a wheel of the project holds, and what an index of packages would show of it."""

import re
import subprocess
import sys
from email import message_from_bytes
from email.message import Message
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.support.requirements import missing

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    if not find_spec("hatchling"):
        missing("needs hatchling: pip install 'fire-atlas[test]'")
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=120)
    (path,) = folder.glob("*.whl")
    return ZipFile(path)


@pytest.fixture(scope="module")
def metadata(wheel: ZipFile) -> Message:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    return message_from_bytes(wheel.read(name))


@pytest.mark.slow
def test_a_wheel_says_that_the_package_is_typed(wheel: ZipFile) -> None:
    assert "fire_atlas/py.typed" in wheel.namelist()


@pytest.mark.slow
def test_all_samples_travel_without_the_scripts_that_make_them(wheel: ZipFile) -> None:
    shipped = {name for name in wheel.namelist() if name.startswith("fire_atlas/shipped/samples/")}
    assert shipped == {
        f"fire_atlas/shipped/{path.relative_to(ROOT).as_posix()}"
        for path in (ROOT / "samples").rglob("*")
        if path.is_file() and path.suffix not in {".py", ".pyc"}
    }


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["recipes", "templates"])
def test_recipes_and_templates_travel(wheel: ZipFile, folder: str) -> None:
    names = wheel.namelist()
    for path in (ROOT / folder).rglob("*"):
        if path.is_file():
            assert f"fire_atlas/shipped/{path.relative_to(ROOT).as_posix()}" in names


@pytest.mark.slow
def test_links_and_pictures_of_the_description_lead_somewhere(metadata: Message) -> None:
    text = str(metadata.get_payload())
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert "fire-atlas build campfire.yaml" in text
    links = re.findall(r"\]\(([^)]+)\)|(?:src|href)=[\"']([^\"']+)", text)
    assert all(link.startswith("https://") for pair in links for link in pair if link)
