"""Modules of the tool that run in a process of their own."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from fire_atlas.core.process import run_module

_TEMPLATES = "fire_atlas.formats.templates.render_process"


def test_a_module_answers_on_what_it_is_given() -> None:
    request = {"template": "{{ name }}!", "to": "{{ name }}.txt", "context": {"name": "fire"}}
    done = run_module(_TEMPLATES, json.dumps(request).encode())
    assert json.loads(done.stdout) == {"name": "fire.txt", "text": "fire!"}


@pytest.mark.parametrize("name", ["json", "jinja2", "fire_atlas"])
def test_nothing_in_the_working_folder_passes_for_a_module(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recipe may come in a folder that holds more than recipes."""
    (tmp_path / f"{name}.py").write_text("open('came here', 'w'); raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep)
    request = {"template": "", "to": "x", "context": {}}
    assert run_module(_TEMPLATES, json.dumps(request).encode()).returncode == 0
    assert not (tmp_path / "came here").exists()


@pytest.mark.slow
def test_what_takes_too_long_is_killed() -> None:
    endless = "{% for a in range(9999) %}{% for b in range(99999) %}{% endfor %}{% endfor %}"
    request = {"template": endless, "to": "x", "context": {}}
    with pytest.raises(subprocess.TimeoutExpired):
        run_module(_TEMPLATES, json.dumps(request).encode(), seconds=1)
