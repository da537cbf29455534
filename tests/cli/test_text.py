"""Text from outside is printed so that a terminal interprets none of it."""

import ast
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.table import Table

import fire_atlas.cli
from fire_atlas.cli.console import PlainConsole, ProgressBars
from fire_atlas.cli.failure import print_error
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import OutputError

Run = Callable[..., "subprocess.CompletedProcess[str]"]

HOSTILE = "\x1b]0;owned\x07\x1b[2J\u009b31m\u202etxt.exe\r\n[bold]x[/bold] :fire:"
"""Sets the title, clears the screen, turns the text around and pretends to be another line."""

posix = pytest.mark.skipif(sys.platform == "win32", reason="names of POSIX")


def assert_harmless(text: str) -> None:
    lines = text.split("\n")
    assert all(line.isprintable() for line in lines), text
    assert not any(line.removeprefix("error: ").startswith("[bold]") for line in lines), text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("feu-café 火 🔥", "feu-café 火 🔥"),
        ("a\x1b[2Jb", "a\\x1b[2Jb"),
        ("a\nb\tc", "a\\nb\\tc"),
        ("\u009b1m", "\\x9b1m"),
        ("\u202egnp", "\\u202egnp"),
        ("\udcff", "\\udcff"),
        ("全角\u3000空白", "全角\u3000空白"),
        ("C:\\x", "C:\\x"),
    ],
)
def test_only_what_cannot_be_seen_is_spelled_out(text: str, shown: str) -> None:
    assert printable(text) == shown


@pytest.mark.slow
@posix
def test_names_of_files_are_printed_harmless(run: Run, campfire: Path) -> None:
    folder = campfire.parent / HOSTILE.replace("/", "")
    folder.mkdir()
    (campfire.parent / "clip").rename(folder / "clip")
    recipe = campfire.rename(folder / f"{HOSTILE.replace('/', '')}.yaml")
    recipe.write_text(recipe.read_text() + "name: fire\n")
    for arguments in (
        ("build", recipe, "-v"), ("build", recipe), ("build", recipe, "--force", "--dry-run"),
        ("check", recipe), ("clean", recipe), ("check", folder / "gone.yaml"),
        ("build", recipe, "--json"), ("inspect", folder / "gone.json"), ("build", recipe, "-vv"),
    ):  # fmt: skip
        result = run(*arguments)
        assert_harmless(result.stdout)
        assert_harmless(result.stderr)


@pytest.mark.parametrize("with_traceback", [False, True])
def test_a_line_break_in_a_name_is_spelled_out_and_lines_of_a_message_stay(
    with_traceback: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        raise OutputError("a\nerror: b.png: exists", "move it away")
    except OutputError as error:
        print_error(error, with_traceback)
    lines = capsys.readouterr().err.splitlines()
    assert lines[-2:] == ["error: a\\nerror: b.png: exists", "error: move it away"]
    assert not any(line.startswith("error: b.png") for line in lines)
    assert any(__file__ in line for line in lines) == with_traceback


@posix
def test_names_that_are_no_text_are_printed(run: Run, campfire: Path) -> None:
    recipe = campfire.rename(campfire.with_name("fire-\udcff.yaml"))
    recipe.write_text(recipe.read_text() + "name: fire\n")
    result = run("check", recipe)
    assert (result.returncode, result.stdout) == (0, f"{campfire.parent}/fire-\\udcff.yaml: ok\n")


def test_what_an_image_says_of_itself_is_printed_harmless(run: Run, campfire: Path) -> None:
    name = b"\x1b[2J"
    frame = campfire.parent / "clip" / "0003.png"
    data = frame.read_bytes()
    chunk = struct.pack(">I", 0) + name + struct.pack(">I", zlib.crc32(name) ^ 1)
    frame.write_bytes(data[:33] + chunk + data[33:])
    result = run("build", campfire.name)
    assert result.returncode == 1
    assert_harmless(result.stderr)


def test_bars_show_markup_as_it_is_and_no_commands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    bars = ProgressBars(HOSTILE)
    bars.stage(HOSTILE, 3)
    bars.note(HOSTILE)
    bars.close()
    shown = capsys.readouterr().err
    assert_harmless(shown)
    assert shown.count("[bold]x[/bold] :fire:") == 3


def test_tables_show_markup_as_it_is_and_no_commands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    table = Table(HOSTILE, title=HOSTILE, caption=HOSTILE)
    table.add_row(HOSTILE)
    PlainConsole().print(table)
    shown = capsys.readouterr().out
    assert_harmless(shown)
    assert shown.count("[bold]x[/bold] :fire:") == 4


def test_whatever_the_command_line_prints_passes_through_one_owner() -> None:
    """But for JSON and YAML, which spell such characters out in their own way, and for completions,
    which hold none of the user's text."""
    allowed = {"printable", "dumps", "resolved_yaml", "complete"}
    for path in sorted(Path(fire_atlas.cli.__file__).parent.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print":
                assert any(
                    isinstance(inner, ast.Call)
                    and getattr(inner.func, "id", getattr(inner.func, "attr", "")) in allowed
                    for inner in ast.walk(node.args[0])
                ), f"{path.name}:{node.lineno}"
