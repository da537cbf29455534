"""Progress for people at a terminal."""

import io
from pathlib import Path

import pytest

from fire_atlas.cli.progress import BarView, BuildView, JsonView, LineView, view_for
from fire_atlas.outputs.outcome import Outcome


class FakeTerminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_bars_and_files_and_programs_get_lines(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert type(view_for(json_lines=False, quiet=False, verbose=False)) is LineView
    assert type(view_for(json_lines=True, quiet=False, verbose=False)) is JsonView
    assert type(view_for(json_lines=False, quiet=True, verbose=False)) is BuildView
    monkeypatch.setattr("sys.stderr", FakeTerminal())
    assert type(view_for(json_lines=False, quiet=False, verbose=False)) is BarView


def test_bars_show_stages_and_notes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    terminal = FakeTerminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    view = BarView(verbose=False)
    view.begin(Path("campfire.yaml"))
    view.stage("render", 4)
    view.advance(3)
    view.note("a [note] in brackets")
    view.advance()
    view.done(Outcome(files=[Path("build/campfire.png")]))
    shown = terminal.getvalue()
    assert "campfire.yaml" in shown
    assert "a [note] in brackets" in shown
    assert "4/4" in shown
    assert capsys.readouterr().out == "campfire.yaml: 1 files in build (0.0 s)\n"


def test_a_note_before_the_first_stage_is_a_plain_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    view = BarView(verbose=False)
    view.begin(Path("campfire.yaml"))
    view.note("hello")
    view.failed("so it goes")
    assert capsys.readouterr().err == "campfire.yaml: hello\n"


def test_json_stages_are_throttled_but_begin_and_end(capsys: pytest.CaptureFixture[str]) -> None:
    view = JsonView()
    view.stage("render", 1000)
    for _ in range(1000):
        view.advance()
    lines = capsys.readouterr().out.splitlines()
    assert '"done": 0,' in lines[0]
    assert '"done": 1000,' in lines[-1]
    assert len(lines) < 20
