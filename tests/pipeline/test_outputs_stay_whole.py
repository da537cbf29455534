"""Whatever ends a build: the previous outputs are whole, and nothing is left lying about."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.repo import (
    Ran,
    Repo,
    command,
    contents,
    environment,
    run_alone,
    script,
)

pytestmark = pytest.mark.slow
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and permissions of POSIX")


def assert_whole(ran: Ran, before: dict[str, bytes], build: Path, *words: str) -> None:
    assert ran.code == 1, ran.err
    assert all(word in ran.err for word in words), ran.err
    assert "Traceback" not in ran.err
    assert contents(build) == before


def test_a_file_where_the_folder_should_be_is_reported(repo: Repo) -> None:
    repo.clip()
    repo.build.write_text("mine", encoding="utf-8")
    recipe = repo.recipe()
    for out in (repo.build, repo.build / "deeper" / "still"):
        ran = repo.run("build", recipe, "-o", out)
        assert ran.code == 1 and "a file is in the way" in ran.err, ran.err
        assert str(repo.build) in ran.err
    assert repo.build.read_text(encoding="utf-8") == "mine"


def test_a_failed_first_build_leaves_no_folder(repo: Repo) -> None:
    repo.clip()
    (repo.folder / "clip" / "0005.png").write_bytes(b"")
    out = repo.folder / "deep" / "er"
    assert repo.run("build", repo.recipe(), "-o", out).code == 1
    assert not (repo.folder / "deep").exists()


def test_a_folder_that_was_there_stays(repo: Repo) -> None:
    repo.clip()
    (repo.folder / "clip" / "0005.png").write_bytes(b"")
    repo.build.mkdir()
    assert repo.run("build", repo.recipe()).code == 1
    assert contents(repo.build) == {}


@posix
def test_an_output_that_is_a_link_is_not_written_through(repo: Repo, recipe: Path) -> None:
    precious = repo.folder / "precious.png"
    precious.write_bytes(b"precious")
    (repo.build / "fire.png").unlink()
    (repo.build / "fire.png").symlink_to(precious)
    before = contents(repo.build)
    ran = repo.run("build", recipe)
    assert_whole(ran, before, repo.build, "fire.png: is a symbolic link", "-o")
    assert precious.read_bytes() == b"precious"


def test_a_folder_of_an_outputs_name_is_reported(repo: Repo, recipe: Path) -> None:
    (repo.build / "fire.json").unlink()
    (repo.build / "fire.json").mkdir()
    ran = repo.run("build", recipe)
    assert ran.code == 1 and "fire.json: is a folder" in ran.err


@posix
def test_only_a_folder_asked_for_may_be_a_link_to_elsewhere(repo: Repo) -> None:
    repo.clip()
    elsewhere = repo.folder.parent / "elsewhere"
    elsewhere.mkdir()
    repo.build.symlink_to(elsewhere)
    recipe = repo.recipe()
    ran = repo.run("build", recipe)
    assert_whole(ran, {}, elsewhere, "build: is a link to", "-o")
    assert repo.run("build", recipe, "-o", repo.build).code == 0
    assert (elsewhere / "fire.png").exists()


@posix
def test_a_folder_that_is_a_link_in_a_circle_is_refused(repo: Repo) -> None:
    repo.clip()
    repo.build.symlink_to("build")
    ran = repo.run("build", repo.recipe())
    assert ran.code == 1 and "build: is a link that leads in a circle; remove it" in ran.err


@posix
def test_a_default_folder_may_be_a_link_within_the_recipes_folder(repo: Repo) -> None:
    repo.clip()
    (repo.folder / "assets").mkdir()
    repo.build.symlink_to("assets")
    assert "fire.png" in repo.built(repo.recipe())


@pytest.fixture
def open_desk() -> Iterator[Repo]:
    """Return a repo that every user of the machine may look at."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield Repo(folder / "repo")
    shutil.rmtree(folder)


_AS_NOBODY = """
import os, sys
import fire_atlas.__main__
from fire_atlas.cli import main
main([*sys.argv[1:3], "--force", "-q", "-o", {warm!r}])  # imports what nobody may be unable to read
if os.geteuid() == 0:
    os.seteuid(65534)  # permissions do not bind root
"""


@posix
def test_a_folder_that_may_not_be_written_is_reported(open_desk: Repo) -> None:
    open_desk.clip()
    recipe = open_desk.recipe()
    before = open_desk.built(recipe)
    open_desk.build.chmod(0o555)
    nobody = _AS_NOBODY.format(warm=str(open_desk.folder / "warm"))
    try:
        ran = run_alone(script(nobody, "build", recipe, "--set", "seed=1"))
        assert_whole(ran, before, open_desk.build, str(open_desk.build), "ermission", "-o")
        ran = run_alone(script(nobody, "build", recipe, "-o", open_desk.build / "new"))
        assert_whole(ran, before, open_desk.build, "ermission", "-o")
    finally:
        open_desk.build.chmod(0o755)


@posix
@pytest.mark.parametrize("room", [0, 1000, 20_000])
def test_a_full_disk_leaves_the_previous_outputs_whole(repo: Repo, room: int) -> None:
    repo.clip(count=8, height=160)
    recipe = repo.recipe(tracks=[], flakes="none")
    before = repo.built(recipe)
    assert len(before["fire.png"]) > room
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room}))"
    ran = run_alone(script(limit, "build", recipe, "--set", "seed=1"), PYTHONDONTWRITEBYTECODE="1")
    assert_whole(ran, before, repo.build, "disk is full", "-o")


_FAILS_AT = """
import os
from pathlib import Path
replace, left = os.replace, [1]
def failing(path, target, **folders):
    if Path(target).name == {name!r} and left:
        left.pop()  # putting the old file back succeeds
        raise PermissionError(1, "Operation not permitted")
    return replace(path, target, **folders)
os.replace = failing
"""


@pytest.mark.parametrize(
    "name", ["fire.png", "fire.flakes.json", "fire.manifest.json", "fire-1.png"]
)
def test_a_commit_that_fails_half_way_is_undone(repo: Repo, name: str) -> None:
    """On Windows an engine may hold a file open; elsewhere it may be immutable."""
    repo.clip()
    recipe = repo.recipe()
    many = ("--set", "atlas.max_size=100", "--set", "seed=1")
    before = repo.built(recipe, *(many if name != "fire-1.png" else ()))
    ran = run_alone(
        script(_FAILS_AT.format(name=name), "build", recipe, "--set", "seed=2", *many[:2])
    )
    assert_whole(ran, before, repo.build, name)


_SIGNALLED_AT = """
import os, signal
replace, left = os.replace, [{after}]
def signalled(path, target, **folders):
    left[0] -= 1
    if left[0] == 0:
        for _ in range(3):
            os.kill(os.getpid(), signal.{name})
    return replace(path, target, **folders)
os.replace = signalled
"""


@posix
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("after", [1, 2, 4])
def test_a_signal_during_the_commit_waits_for_its_end(
    repo: Repo, recipe: Path, name: str, after: int
) -> None:
    old = contents(repo.build)
    changed = ("--set", "seed=5", "--jobs", "4")
    code = _SIGNALLED_AT.format(name=name, after=after)
    ran = run_alone(script(code, "build", recipe, *changed))
    assert ran.code == 130, ran.err
    assert "Traceback" not in ran.err
    new = contents(repo.build)
    assert new != old
    assert new == repo.built(recipe, "--force", *changed), "all new, and nothing besides"


def interrupt(line: list[str], moment: tuple[str, int, float], number: signal.Signals) -> Ran:
    """Run a build and signal it ``pause`` s after it has reported ``done`` steps of ``stage``."""
    stage, done, pause = moment
    with subprocess.Popen(
        line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        for text in process.stdout:
            event = json.loads(text)
            if event.get("stage") == stage and event["done"] >= done:
                break
        time.sleep(pause)
        process.send_signal(number)
        rest = process.stdout.read()
        err = process.stderr.read()
    return Ran(process.returncode, rest, err)


MOMENTS = [("analyse", 0, 0.0), ("analyse", 10, 0.0), ("analyse", 48, 0.02), ("render", 0, 0.0),
           ("render", 5, 0.0), ("write", 0, 0.0)]  # fmt: skip


@posix
@pytest.mark.parametrize(
    ("number", "moment"),
    [(signal.SIGINT, moment) for moment in MOMENTS]
    + [(signal.SIGTERM, moment) for moment in MOMENTS[1::2]],
)
def test_an_interrupted_build_leaves_things_as_they_were(
    repo: Repo, number: signal.Signals, moment: tuple[str, int, float]
) -> None:
    repo.clip(count=48, height=24)
    recipe = repo.recipe()
    before = repo.built(recipe)
    large = ("--set", "seed=1", "--set", "source.height=320", "--jobs", "3")
    ran = interrupt(command("build", recipe, "--json", *large), moment, number)
    assert ran.code == 130, ran
    assert "interrupted" in ran.err and "Traceback" not in ran.err, ran.err
    assert contents(repo.build) == before


@posix
def test_an_interrupted_first_build_leaves_no_folder(repo: Repo) -> None:
    repo.clip(count=48)
    ran = interrupt(command("build", repo.recipe(), "--json"), ("analyse", 10, 0.0), signal.SIGINT)
    assert ran.code == 130, ran
    assert not repo.build.exists()


def test_signals_are_handled_after_a_build_as_they_were_before(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe()
    repo.built(recipe)  # the command line has its own way with SIGTERM
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    repo.built(recipe, "--force")
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@posix
def test_a_build_that_was_killed_is_not_up_to_date(repo: Repo, recipe: Path) -> None:
    """Power fails in the middle of the commit: the next build mends it."""
    code = _SIGNALLED_AT.format(name="SIGKILL", after=2)
    assert run_alone(script(code, "build", recipe, "--set", "seed=5")).code == -signal.SIGKILL
    ran = repo.run("build", recipe, "--set", "seed=5")
    assert ran.code == 0 and not ran.is_up_to_date
    assert os.access(repo.build / "fire.png", os.R_OK)


def test_outputs_whose_names_differ_by_case_only_are_refused(repo: Repo) -> None:
    """On many file systems one of them would be the other."""
    repo.clip()
    (repo.folder / "my.j2").write_text("mine", encoding="utf-8")
    for to in ("FIRE.json", "Fire.Flakes.json"):
        ran = repo.run("build", repo.recipe(exports=["json", {"template": "my.j2", "to": to}]))
        assert ran.code == 1
        assert to in ran.err and "name" in ran.err, ran.err
        assert not repo.build.exists()


@posix
@pytest.mark.parametrize("next_command", ["check", "preview", "build", "clean"])
def test_the_next_command_undoes_a_commit_that_was_killed(
    repo: Repo, recipe: Path, next_command: str
) -> None:
    before = contents(repo.build)
    code = _SIGNALLED_AT.format(name="SIGKILL", after=3)
    assert run_alone(script(code, "build", recipe, "--set", "seed=5")).code == -signal.SIGKILL
    assert not (repo.build / "fire.manifest.json").exists()
    ran = repo.run(next_command, recipe)
    assert ran.code == 0, ran.err
    after = contents(repo.build)
    after.pop("fire.preview.html", None)
    assert after == ({} if next_command == "clean" else before)
    assert ran.is_up_to_date == (next_command == "build")
