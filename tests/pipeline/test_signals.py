"""A signal ends a command at any instant: at once, with exit code 130, and nothing is half done."""

import contextlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from pathlib import Path

import pytest

from fire_atlas.core.interruption import EXIT_CODE, MESSAGE
from fire_atlas.outputs.folder import temporary_folder
from tests.support.repo import (
    Ran,
    Repo,
    command,
    contents,
    environment,
    run_alone,
    script,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
]

SOON = 15
"""Seconds: far more than an exit takes on a busy machine, far less than what is interrupted."""

_AT_IMPORT = """
import os, signal, sys
left = [{after}]
def hook(event, _):
    if event == "import":
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), signal.{name})
from fire_atlas.core.interruption import end_on_signals
end_on_signals()
sys.addaudithook(hook)
"""


@pytest.mark.parametrize(
    ("after", "name"),
    [(after, "SIGINT") for after in (1, 3, 10, 30, 100, 200, 300, 400, 500)]
    + [(after, "SIGTERM") for after in (10, 300)],
)
def test_a_signal_during_imports_ends_the_command(repo: Repo, after: int, name: str) -> None:
    """numpy, OpenCV and others turn an exception in the middle of their import into another."""
    repo.clip()
    code = _AT_IMPORT.format(after=after, name=name)
    ran = run_alone(script(code, "build", repo.recipe(), "-q"))
    assert (ran.code, ran.err) == (EXIT_CODE, f"error: {MESSAGE}\n")
    assert not repo.build.exists()


def interrupted(line: list[str], after: float, number: signal.Signals = signal.SIGINT) -> Ran:
    """Run a command and signal it ``after`` s; it must end soon, if it has not already."""
    with subprocess.Popen(
        line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        time.sleep(after)
        process.send_signal(number)
        try:
            out, err = process.communicate(timeout=SOON)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    return Ran(process.returncode, out, err)


def test_outputs_are_whole_whenever_a_signal_comes(repo: Repo, recipe: Path) -> None:
    old = contents(repo.build)
    changed = ("--set", "seed=5", "--set", "source.height=160", "--force", "-q", "--jobs", "2")
    began = time.monotonic()
    assert run_alone(command("build", recipe, *changed)).code == 0
    seconds = time.monotonic() - began
    new = contents(repo.build)
    assert new != old
    earliest = max(0.2, seconds / 6)  # Python's own start ends in its own way
    for step, number in zip(range(1, 13), 6 * (signal.SIGINT, signal.SIGTERM), strict=True):
        shutil.rmtree(repo.build)
        repo.build.mkdir()
        for name, data in old.items():
            (repo.build / name).write_bytes(data)
        ran = interrupted(
            command("build", recipe, *changed), max(earliest, seconds * step / 12), number
        )
        assert (ran.code, ran.err) in [(EXIT_CODE, f"error: {MESSAGE}\n"), (0, "")]
        assert contents(repo.build) in ((old, new) if ran.code else (new,))


LONG = {
    "a loop that goes on": ("clip", {"timeline": {"frames": 10_000}}),
    "other frame rates": ("clip", {"timeline": {"frames": 10_000, "fps": 240}}),
    "fire that is generated": (
        {"kind": "profile", "path": "clip", "fps": 24}, {"timeline": {"frames": 10_000}},
    ),
    "simulation": ({"kind": "silk"}, {"timeline": {"frames": 10_000}}),
}  # fmt: skip


# Each kind once, and one of them sooner too: kinds and moments are tried apart, as each case takes
# seconds.
@pytest.mark.parametrize(("kind", "after"), [("simulation", 1.0), *((kind, 2.0) for kind in LONG)])
def test_long_builds_end_soon_and_leave_no_folder(repo: Repo, kind: str, after: float) -> None:
    source, keys = LONG[kind]
    repo.clip(count=24)
    recipe = repo.recipe(**(keys if source == "clip" else {"source": source, **keys}))
    ran = interrupted(command("build", recipe, "-q", "--set", "source.height=256"), after)
    assert (ran.code, ran.err) == (EXIT_CODE, f"error: {MESSAGE}\n")
    assert not repo.build.exists()


_WRITES = """
import io, sys
from fire_atlas.core.interruption import end_on_signals
end_on_signals()
import numpy as np
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.recipe.output import Atlas
page = np.random.default_rng(0).integers(0, 256, (4096, 4096, 4), np.uint8)
with Workers(2) as workers:
    print("begun", flush=True)
    write_page(io.BytesIO(), page, Atlas(format=sys.argv[1], compression="small"), workers)
"""


def running(mark: str) -> list[str]:
    """Return the processes with ``mark`` in their environment, where the system shows these."""
    marked = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if mark.encode() in (process / "environ").read_bytes():
                marked.append((process / "cmdline").read_text())
    return marked


@pytest.mark.parametrize("kind", ["png", "webp"])
def test_the_smallest_files_are_not_waited_for(kind: str) -> None:
    """Of a page of noise, the largest there is, they take minutes."""
    mark = uuid.uuid4().hex
    with subprocess.Popen(
        [sys.executable, "-c", _WRITES, kind],
        env=environment(MARK=mark), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        try:
            _, err = process.communicate(timeout=SOON)
        finally:
            process.kill()
    assert (process.returncode, err) == (EXIT_CODE, f"error: {MESSAGE}\n")
    deadline = time.monotonic() + SOON  # a killed process may still be giving back its memory
    while running(mark) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert running(mark) == []


@pytest.mark.skipif(sys.platform != "linux", reason="sets the size of a pipe")
def test_a_pipe_that_nobody_reads_does_not_keep_a_command() -> None:
    with subprocess.Popen(
        command("schema"), env=environment(), pipesize=4096,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        time.sleep(2)
        assert process.poll() is None, "it waits for someone to read"
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=SOON) == EXIT_CODE


def test_an_interrupted_preview_leaves_nothing(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = repo.folder / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", None)
    repo.clip(count=24)
    recipe = repo.recipe(timeline={"frames": 10_000})
    ran = interrupted(command("preview", recipe, "-q"), 3.0)
    assert (ran.code, ran.err) == (EXIT_CODE, f"error: {MESSAGE}\n")
    assert list(temporary.iterdir()) == []


def test_what_a_killed_preview_leaves_goes_with_the_next(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The temporary folder of one that still runs stays."""
    temporary = repo.folder / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", None)
    repo.clip(count=24)
    recipe = repo.recipe(timeline={"frames": 10_000})
    quick = repo.recipe("quick.yaml")
    with temporary_folder() as running:
        (running / "page.png").write_bytes(b"half")
        line = command("preview", recipe, "-q")
        with subprocess.Popen(line, env=environment(), stderr=subprocess.DEVNULL) as process:
            latest = time.monotonic() + SOON
            while len([*temporary.glob("fire-atlas-*/*")]) < 2 and time.monotonic() < latest:
                time.sleep(0.05)
            process.kill()
        assert len([*temporary.glob("fire-atlas-*")]) == 2
        assert repo.run("preview", quick, "-q").code == 0
        assert [*temporary.glob("fire-atlas-*/*")] == [running / "page.png"]
    assert list(temporary.iterdir()) == []


def test_what_ignores_interruptions_goes_on(repo: Repo) -> None:
    """``nohup`` and shells that start something in the background say so."""
    repo.clip()
    line = " ".join(f"'{word}'" for word in command("build", repo.recipe(), "-q"))
    with subprocess.Popen(
        ["sh", "-c", f"trap '' INT; exec {line}"], env=environment(), stderr=subprocess.PIPE
    ) as process:
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
    assert (repo.build / "fire.png").exists()


TAKEN = """
import os, signal, sys
from pathlib import Path
from filelock import FileLock
from fire_atlas.core.interruption import end_on_signals
from fire_atlas.outputs.locks import locked

acquire = FileLock.acquire

def acquired(*args, **kwargs):
    taken = acquire(*args, **kwargs)
    os.kill(os.getpid(), signal.SIGTERM)
    return taken

FileLock.acquire = acquired
end_on_signals()
with locked(Path(sys.argv[1]), print):
    print("held")
"""


def test_a_signal_just_as_a_lock_is_taken_leaves_no_lock_file(tmp_path: Path) -> None:
    ended = run_alone([sys.executable, "-c", TAKEN, str(tmp_path / "fire.lock")])
    assert (ended.code, ended.out) == (EXIT_CODE, "")
    assert not list(tmp_path.iterdir())
