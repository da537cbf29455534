"""Several recipes in one command: side by side, in order where one reads what another writes."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.interruption import EXIT_CODE, MESSAGE
from tests.support.repo import Repo, command, contents, environment, run_alone

SOON = 15
"""Seconds: far more than processes take to end on a busy machine."""


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    return repo


@pytest.fixture(scope="module")
def built_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with four recipes and what was built of them, one at a time."""
    repo = Repo(tmp_path_factory.mktemp("several") / "repo")
    repo.clip(count=4, height=40)
    for name in several(repo):
        repo.built(repo.folder / f"{name}.yaml")
    return repo.folder


@pytest.fixture
def built_repo(built_once: Path, tmp_path: Path) -> Repo:
    """Return a repo of the test's own with four recipes that are built."""
    built = Repo(tmp_path / "built")
    shutil.copytree(built_once, built.folder, dirs_exist_ok=True)
    return built


def several(repo: Repo, count: int = 4) -> list[str]:
    """Write recipes that differ by their seed, and return their names."""
    names = [f"fire{i}" for i in range(count)]
    for i, name in enumerate(names):
        repo.recipe(f"{name}.yaml", seed=i)
    return names


def events(out: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in out.splitlines()]


def last_events(out: str) -> dict[str, dict[str, Any]]:
    """Return the last event of each recipe."""
    return {Path(event["recipe"]).stem: event for event in events(out)}


@contextlib.contextmanager
def running(repo: Repo, *options: str) -> Iterator["subprocess.Popen[str]"]:
    """Start a build of the whole repo, and wait until two of its recipes are in work."""
    line = command("build", repo.folder, "--json", "--jobs", "2", *options)
    with subprocess.Popen(
        line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        seen = set[str]()
        while len(seen) < 2:
            event = json.loads(process.stdout.readline())
            if event["event"] == "stage":
                seen.add(event["recipe"])
        try:
            yield process
        finally:
            process.kill()


def children(pid: int) -> list[int]:
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    return [int(number) for number in text.split()]


def wait_until(is_so: Callable[[], bool]) -> None:
    latest = time.monotonic() + SOON
    while not is_so():
        assert time.monotonic() < latest
        time.sleep(0.02)


def is_alive(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.parametrize("jobs", ["1", "2", "8"])
def test_the_same_bytes_as_one_at_a_time(repo: Repo, built_once: Path, jobs: str) -> None:
    several(repo)
    ran = repo.run("build", repo.folder, "--jobs", jobs)
    assert (ran.code, ran.out.splitlines()[-1]) == (0, "4 recipes: 4 built")
    assert contents(repo.build) == contents(built_once / "build")
    assert repo.run("build", repo.folder).out.splitlines()[-1] == "4 recipes: 4 up to date"


def test_options_reach_every_build(repo: Repo, tmp_path: Path) -> None:
    names = several(repo, 2)
    out = tmp_path / "-out"
    options = ("-o", out, "--set", "atlas.padding=7", "--set", "flakes=none")
    assert repo.run("build", repo.folder, *options).code == 0
    assert not repo.build.exists()
    for name in names:
        assert (out / f"{name}.png").is_file()
        assert not (out / f"{name}.flakes.json").exists()
    before = contents(out)
    assert "up to date" in repo.run("build", repo.folder, *options).out
    written = (out / "fire0.png").stat().st_mtime_ns
    assert "2 built" in repo.run("build", repo.folder, *options, "--force").out
    assert (out / "fire0.png").stat().st_mtime_ns > written
    assert contents(out) == before
    (out / "fire1.json").write_text("mine")
    assert "1 up to date, 1 failed" in repo.run("build", repo.folder, *options).out
    assert "1 built, 1 up to date" in repo.run("build", repo.folder, *options, "--overwrite").out
    ran = repo.run("build", repo.folder, "--limit-pixels", "100")
    assert ran.code == 1 and ran.err.count("say --limit-pixels 1280") == 2


def test_recipes_whose_names_look_like_options_are_built(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("quiet", "verbose"):
        text = f"name: {name}\nsource: {{path: clip}}\n"
        (repo.folder / f"-{name[0]}.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(repo.folder)
    assert repo.run("build", ".").out.splitlines()[-1] == "2 recipes: 2 built"


def test_a_failed_recipe_does_not_stop_the_others(repo: Repo) -> None:
    several(repo, 3)
    repo.recipe("a_bad.yaml", path="nowhere")
    repo.recipe("b_bad.yaml", flakes={"rate": "x"})
    ran = repo.run("build", repo.folder)
    assert ran.code == 2
    assert "5 recipes: 3 built, 2 failed" in ran.out.splitlines()
    errors = [line for line in ran.err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 2
    assert any("nowhere: does not exist" in line for line in errors)
    assert any("b_bad.yaml:1: flakes.rate: must be" in line for line in errors)


def test_fail_fast_starts_no_other_recipe(repo: Repo) -> None:
    several(repo, 3)
    repo.recipe("a_bad.yaml", path="nowhere")
    ran = repo.run("build", repo.folder, "--fail-fast", "--jobs", "1")
    assert ran.code == 1
    assert "4 recipes: 1 failed, 3 not built" in ran.out.splitlines()
    assert not list(repo.folder.glob("build/*.png"))


def test_fail_fast_stops_at_a_recipe_that_cannot_be_read(repo: Repo) -> None:
    several(repo, 2)
    (repo.folder / "z.yaml").write_text("source: {path: [")
    ran = repo.run("build", repo.folder, "--fail-fast")
    assert ran.code == 2
    assert "3 recipes: 1 failed, 2 not built" in ran.out.splitlines()


def test_json_lines_are_whole_and_name_their_recipe(repo: Repo) -> None:
    names = several(repo)
    repo.recipe("bad.yaml", path="nowhere")
    ran = run_alone(command("build", repo.folder, "--json", "--jobs", "3"))
    last = last_events(ran.out)
    assert last.keys() == {*names, "bad"}
    assert all(last[name]["event"] == "done" and last[name]["files"] for name in names)
    assert last["bad"]["event"] == "error" and "nowhere" in last["bad"]["message"]
    for name in names:
        own = [event for event in events(ran.out) if Path(event["recipe"]).stem == name]
        renders = [event for event in own if event.get("stage") == "render"]
        assert (renders[0]["done"], renders[-1]["done"]) == (0, 4)
        assert sum(event["event"] == "done" for event in own) == 1


def test_shards_take_every_nth_recipe(repo: Repo) -> None:
    several(repo, 5)
    taken = [
        [Path(event["recipe"]).stem for event in events(repo.run(*line, f"{i}/2").out)]
        for line in [("build", repo.folder, "--dry-run", "--json", "--shard")]
        for i in (1, 2)
    ]
    assert taken == [["fire0", "fire2", "fire4"], ["fire1", "fire3"]]
    assert repo.run("build", repo.folder, "--shard", "2/2").out.endswith("2 recipes: 2 built\n")
    assert sorted(path.stem for path in repo.build.glob("*.png")) == ["fire1", "fire3"]


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "a/b", "-1/2", "1/2/3"])
def test_a_shard_that_is_none_is_refused(repo: Repo, text: str) -> None:
    ran = repo.run("build", repo.folder, f"--shard={text}")
    assert ran.code == 2 and "from 1/4 to 4/4" in ran.err


def test_an_invalid_recipe_fails_its_own_shard_alone(repo: Repo) -> None:
    several(repo, 2)
    (repo.folder / "z.yaml").write_text("source: {path: [")
    assert repo.run("build", repo.folder, "--shard", "2/3").code == 0
    assert repo.run("build", repo.folder, "--shard", "3/3").code == 2


def reads(repo: Repo, name: str, path: str) -> None:
    """Write a recipe with the output of another as its source."""
    repo.recipe(f"{name}.yaml", path=path, flakes="none", motion_blur="none")


@pytest.mark.parametrize("path", ["build/late.png", "build/late*.png"])
def test_a_recipe_is_built_after_those_whose_outputs_it_reads(repo: Repo, path: str) -> None:
    several(repo, 2)
    repo.recipe("late.yaml", flakes="none")
    reads(repo, "early", path)
    dry = repo.run("build", repo.folder, "--dry-run").out.splitlines()
    assert dry[-1].endswith("late.yaml writes, which is built before") and "early" in dry[-1]
    ran = repo.run("build", repo.folder)
    assert (ran.code, ran.out.splitlines()[-1]) == (0, "4 recipes: 4 built")
    assert "4 up to date" in repo.run("build", repo.folder).out
    assert "early.yaml: up to date" in repo.run("build", repo.folder, "--frozen", "-v").out
    repo.recipe("late.yaml", flakes="none", seed=5, atlas={"padding": 9})
    assert "2 built, 2 up to date" in repo.run("build", repo.folder).out
    assert "4 up to date" in repo.run("build", repo.folder).out


def test_what_reads_the_outputs_of_a_failed_recipe_is_not_built(repo: Repo) -> None:
    several(repo, 2)
    repo.recipe("late.yaml", path="nowhere")
    reads(repo, "early", "build/late.png")
    reads(repo, "dawn", "build/early.png")
    ran = repo.run("build", repo.folder)
    assert ran.code == 1
    assert "5 recipes: 2 built, 3 failed" in ran.out.splitlines()
    assert "early.yaml: not built, because it reads what" in ran.err
    assert "dawn.yaml: not built, because it reads what" in ran.err


def test_recipes_that_read_each_other_are_refused(repo: Repo) -> None:
    reads(repo, "a", "build/b.png")
    reads(repo, "b", "build/a.png")
    ran = repo.run("build", repo.folder)
    assert ran.code == 2
    assert "a.yaml, " in ran.err and "b.yaml: each reads what the other writes" in ran.err


def test_recipes_that_depend_on_each_other_are_in_one_shard(repo: Repo) -> None:
    several(repo, 3)
    reads(repo, "z", "build/fire0.png")
    ran = repo.run("build", repo.folder, "--shard", "1/3")
    assert (ran.code, ran.out.splitlines()[-1]) == (0, "2 recipes: 2 built")
    assert (repo.build / "z.png").is_file()
    assert "1 recipes: 1 built" not in repo.run("build", repo.folder, "--shard", "2/3").out


def test_members_are_no_prerequisites(repo: Repo) -> None:
    """A build reads the recipes of its members, and does their work itself."""
    repo.recipe("member.yaml", flakes={"rate": "x"})
    (repo.folder / "all.yaml").write_text("atlas: {members: [good.yaml]}")
    repo.recipe("good.yaml")
    dry = repo.run("build", repo.folder, "--dry-run").out
    assert "is built before" not in dry
    assert "3 recipes: 2 built, 1 failed" in repo.run("build", repo.folder).out.splitlines()


posix = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="signals, /proc of Linux")


@posix
@pytest.mark.slow
def test_a_killed_process_fails_its_recipe_and_no_other(repo: Repo) -> None:
    names = several(repo)
    with running(repo, "--set", "source.height=300") as process:
        victim = children(process.pid)[0]
        os.kill(victim, signal.SIGKILL)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    last = last_events(out)
    failed = [name for name, event in last.items() if event["event"] == "error"]
    assert len(failed) == 1 and "SIGKILL" in last[failed[0]]["message"]
    assert err.startswith("error: ") and f"{failed[0]}.yaml: the process that built it" in err
    built = {path.stem for path in repo.build.glob("*.png")}
    assert built - {*failed} == {*names} - {*failed}  # it may be killed with its outputs in place
    assert repo.run("build", repo.folder, "--set", "source.height=300").code == 0


def completed(before: dict[str, bytes], after: dict[str, bytes], names: list[str]) -> set[str]:
    """Return the builds whose files are all new; assert that those of the others are as they were.

    On a busy machine, the first recipe may be done before the second has begun; not so all.
    """
    files = before.keys() | after.keys()
    changed = {file for file in files if before.get(file) != after.get(file)}
    new = {file.partition(".")[0] for file in changed}
    assert changed == {file for file in files if file.partition(".")[0] in new}
    assert new < {*names}
    return new


@posix
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_all_processes(built_repo: Repo, number: signal.Signals) -> None:
    names = [path.stem for path in built_repo.folder.glob("*.yaml")]
    before = contents(built_repo.build)
    with running(built_repo, "--set", "source.height=1200") as process:
        builders = children(process.pid)
        process.send_signal(number)
        out, err = process.communicate(timeout=SOON)
    assert len(builders) == 2
    assert process.returncode == EXIT_CODE
    assert err == f"error: {MESSAGE}\n"
    wait_until(lambda: not any(map(is_alive, builders)))
    done = completed(before, contents(built_repo.build), names)
    failed = {name for name, event in last_events(out).items() if event["event"] == "error"}
    assert {*names} - done <= failed <= {*names}


@posix
@pytest.mark.slow
def test_no_build_goes_on_when_the_command_is_killed(built_repo: Repo) -> None:
    names = [path.stem for path in built_repo.folder.glob("*.yaml")]
    before = contents(built_repo.build)
    with running(built_repo, "--set", "source.height=1200") as process:
        builders = children(process.pid)
        process.kill()
        process.wait()
        wait_until(lambda: not any(map(is_alive, builders)))
    completed(before, contents(built_repo.build), names)


def test_a_terminal_shows_a_table(repo: Repo) -> None:
    pty = pytest.importorskip("pty")
    several(repo, 3)
    repo.recipe("bad.yaml", path="nowhere")
    main, terminal = pty.openpty()
    line = command("build", repo.folder)
    env = environment(TERM="xterm", COLUMNS="160")
    with subprocess.Popen(line, env=env, stdout=subprocess.PIPE, stderr=terminal) as process:
        os.close(terminal)
        shown = b""
        with contextlib.suppress(OSError):  # Linux reports the end of a terminal as an error
            while data := os.read(main, 65536):
                shown += data
        assert process.stdout is not None
        table = process.stdout.read().decode().splitlines()
    os.close(main)
    assert process.returncode == 1
    assert b"recipes" in shown and b"4/4" in shown
    assert b"nowhere: does not exist" in shown
    assert table[0].split() == ["recipe", "result", "files", "s"]
    end = table.index("4 recipes: 3 built, 1 failed")
    rows = {Path(row.split()[0]).stem: row.split()[1:3] for row in table[1:end]}
    assert rows == {"bad": ["failed"]} | {f"fire{i}": ["built", "4"] for i in range(3)}
    assert len(table) == end + 2 and "bad.yaml:" in table[-1]


def test_a_single_recipe_needs_no_other_process(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    several(repo, 1)
    monkeypatch.setitem(sys.modules, "fire_atlas.cli.processes", None)
    assert repo.run("build", repo.folder).code == 0
