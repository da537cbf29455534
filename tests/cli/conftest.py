"""Runs the real command, on real files."""

import contextlib
import io
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fire_atlas
from fire_atlas.cli import main

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """The environment in which ``python -m fire_atlas`` is the code under test."""
    root = str(Path(fire_atlas.__file__).parent.parent)
    return {**os.environ, "PYTHONPATH": root, "PYTHONWARNINGS": "error", "COLUMNS": "120"}


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run ``fire-atlas`` in the test's folder, in this process: to start one takes most of a second
    each time."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        line, out, err = [*map(str, arguments)], io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main(line)
            except SystemExit as ended:  # as argparse ends --help
                code = int(ended.code or 0)
        return subprocess.CompletedProcess(line, code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture
def run_alone(tmp_path: Path, environment: dict[str, str]) -> Run:
    """Run ``fire-atlas`` in the test's folder, in a process of its own."""

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [sys.executable, "-m", "fire_atlas", *map(str, arguments)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    return run


@pytest.fixture
def campfire(tmp_path: Path) -> Path:
    """A recipe with footage of a small flame: six frames of 24 x 32 px."""
    (tmp_path / "clip").mkdir()
    y, x = np.mgrid[0:32, 0:24]
    for i in range(6):
        height = 14 + 3 * np.sin(i)
        heat = np.clip(1 - np.hypot((x - 11.5) / 7, (y - 24) / height), 0, 1)
        rgba = np.stack([255 * heat**0.3, 255 * heat, 120 * heat**2, 255 * heat**0.5], axis=-1)
        Image.fromarray(rgba.astype(np.uint8)).save(tmp_path / "clip" / f"{i:04}.png")
    path = tmp_path / "campfire.yaml"
    path.write_text("source: {path: clip, fps: 12}\nflakes: {rate: 200, alpha: 0.01}\n")
    return path
