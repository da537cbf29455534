"""Commands that the docs show are ones that the command line knows."""

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from fire_atlas.cli import main
from fire_atlas.cli.arguments import parse
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.shipped import shipped
from tests.docs.markdown import PAGES, ROOT, code_blocks, page_text, prose, section

_COMMAND = re.compile(r"(?:^|&& +)(fire-atlas [^&\n]*)", re.MULTILINE)
_INDENTED = re.compile(r"^    (fire-atlas [^\n]*)", re.MULTILINE)
_INLINE = re.compile(r"`(fire-atlas [^`]*)`")
_MODULE = re.compile(r"python -m ((?:tests|fire_atlas)[\w.]*)")


def commands(page: str) -> Iterator[str]:
    """Yield each command of a page, in its blocks and in its text."""
    for block in code_blocks(page, "sh"):
        yield from _COMMAND.findall(block)
    yield from _INDENTED.findall(prose(page))
    for command in _INLINE.findall(" ".join(prose(page).split())):
        yield command.replace("[PRESET or PATH] [DIR]", "PRESET DIR").removesuffix("...")


@pytest.mark.parametrize("page", PAGES)
def test_every_command_parses(page: str) -> None:
    for command in commands(page):
        words = shlex.split(command.partition(" > ")[0].replace("...", ""), comments=True)[1:]
        try:
            assert parse(words).command == words[0], command
        except RecipeError:  # a text may name a command, or an option, without what it is about
            parse([*words, "campfire.json"])


def test_the_docs_show_commands() -> None:
    shown = {command.split()[1] for page in PAGES for command in commands(page)}
    assert {
        "build",
        "check",
        "init",
        "learn",
        "watch",
        "clean",
        "preview",
        "inspect",
        "cache",
    } <= shown


@pytest.mark.parametrize("page", PAGES)
def test_every_preset_that_is_copied_is_there(page: str) -> None:
    for command in commands(page):
        if found := re.match(r"fire-atlas init ([a-z_]+)(?![\w./])", command):
            assert (shipped("recipes") / f"{found[1]}.yaml").exists(), command


def test_json_lines_have_the_keys_of_their_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = section("docs/command-line.md", "JSON lines").splitlines()
    rows = [re.findall(r"`(\w+)`", line) for line in lines if line.startswith("| `")]
    keys = {event: {"event", "recipe", *known} for event, *known in rows}
    recipe = tmp_path / "fire.yaml"
    recipe.write_text("{extends: candle, timeline: {frames: 4}, source: {height: 64}}")
    for options in (["--dry-run"], ["--force", "--cache", str(tmp_path / "cache")]):
        main(["build", str(recipe), "--json", *options])
    main(["build", str(recipe), "--json", "--set", "flakes.rate=much"])
    said = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {line["event"] for line in said} == set(keys)
    for line in said:
        assert set(line) <= keys[line["event"]], line


@pytest.mark.parametrize("page", PAGES)
def test_every_module_that_is_run_is_there(page: str) -> None:
    for module in _MODULE.findall(page_text(page)):
        path = ROOT / module.replace(".", "/")
        assert path.with_suffix(".py").exists() or (path / "__main__.py").exists(), module
