"""Scripts and recipes that the pages show are run as they stand there."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.docs.markdown import PAGES, code_blocks, page_text
from tests.support.docs_project import made_tiny, make_project, recipes_named, whole_recipe
from tests.support.repo import PACKAGE

NOT_RUN = "<!-- not run: "
"""Stands before a block that cannot be run here, with the reason."""

PRELUDE = """set -eu
pip() { :; }  # the package under test is installed already
pytest() { :; }  # these tests are being run
"""


COMMAND = f"""#!/bin/sh
"{sys.executable}" -P -m fire_atlas "$@" || exit
# Fire of the recipes that it writes is made small, which is built as any other, but quickly.
[ "$1" != init ] || sed -i "$2.yaml" \\
    -e 's/^  path: .*/&\\n  height: 48/' \\
    -e 's/^  size: game .*/  size: draft\\n  rows: 6\\n  columns: 4/'
"""


@pytest.fixture(scope="module")
def whole_project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The clips that pages name, and ``fire-atlas`` on the path: made once, and copied."""
    folder = tmp_path_factory.mktemp("pages")
    make_project(folder / "project")
    command = folder / "bin" / "fire-atlas"
    command.parent.mkdir()
    command.write_text(COMMAND)
    command.chmod(0o755)
    return folder


@pytest.fixture
def project(whole_project: Path, tmp_path: Path) -> Path:
    """A folder as a page has it in mind, beside one with the command."""
    shutil.copytree(whole_project, tmp_path, dirs_exist_ok=True)
    return tmp_path / "project"


def run(script: str, project: Path) -> None:
    """Run a shell script in the folder; it fails at the first command that does."""
    path = f"{project.parent / 'bin'}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", PRELUDE + script],
        cwd=project,
        env={**os.environ, "PATH": path, "PYTHONPATH": str(PACKAGE.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{script}\n{done.stdout}{done.stderr}"


def runnable_blocks(page: str, language: str) -> Iterator[str]:
    """Yield the blocks of a page that are not marked as ones that cannot be run."""
    for block in code_blocks(page, language):
        before = page_text(page).partition(f"```{language}\n{block}")[0].rstrip()
        if not before.splitlines() or not before.splitlines()[-1].startswith(NOT_RUN):
            yield block


SCRIPTS = [(page, text) for page in PAGES if (text := "\n".join(runnable_blocks(page, "sh")))]
"""Pages, and all their scripts."""

COOKBOOK = page_text("docs/cookbook.md")

RECIPES = [(page, block) for page in PAGES for block in runnable_blocks(page, "yaml")]


def test_pages_show_scripts() -> None:
    assert {"README.md", "docs/command-line.md", "docs/silk.md"} <= {page for page, _ in SCRIPTS}


def test_the_first_page_shows_ready_recipes_in_a_dozen_lines() -> None:
    blocks = list(code_blocks("README.md", "yaml"))
    assert len(blocks[0].strip().splitlines()) == 12
    for name, block in zip(("bonfire", "campfire"), blocks, strict=True):
        text = (shipped("recipes") / f"{name}.yaml").read_text(encoding="utf-8")
        ready = yaml.safe_load(text.replace("../samples/", "samples/"))  # as init writes it
        for key, value in yaml.safe_load(block).items():
            assert value == ready[key] or value.items() <= ready[key].items(), key


@pytest.mark.slow
@pytest.mark.parametrize(("page", "script"), SCRIPTS)
def test_every_script_of_a_page_runs(page: str, script: str, project: Path) -> None:
    """Blocks of a page run one after the other in one folder that has the recipes they name."""
    made = re.findall(r"init (\w+)", script)
    for name in recipes_named(script):
        if name not in made:
            run(f"fire-atlas init {name}", project)
    if "recipes/" in script:
        (project / "recipes").mkdir()
        (project / "recipes/fire.yaml").write_text("extends: candle")
    if "--frozen" in script:
        run("fire-atlas build recipes/", project)
    run(script, project)


@pytest.mark.slow
@pytest.mark.parametrize(("page", "block"), RECIPES)
def test_every_recipe_of_a_page_builds(
    page: str,
    block: str,
    project: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    keys = whole_recipe(yaml.safe_load(block))
    (project / "fire.yaml").write_text(yaml.safe_dump(keys))
    monkeypatch.chdir(project)
    for name in recipes_named(block):
        assert main(["init", name]) == 0
    assert main(["check", "fire.yaml"]) == 0, capsys.readouterr().err
    assert main(["build", "fire.yaml", *made_tiny(keys, 48, 6)]) == 0, capsys.readouterr().err


def test_a_job_of_the_cookbook_takes_six_lines_at_most() -> None:
    jobs = re.findall(r"^### (.+?)\n\n(.+?)\n```yaml\n(.+?)```", COOKBOOK, re.M | re.S)
    assert len(jobs) >= 25
    for title, _, block in jobs:
        assert len(block.splitlines()) <= 6, title
