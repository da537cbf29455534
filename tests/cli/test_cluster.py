"""A real Dask cluster on this machine: a scheduler, and workers that come and go."""

import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.support.repo import PACKAGE, Ran, Repo, command, contents, environment, run_alone

pytestmark = pytest.mark.slow

SECONDS = 60
"""Far more than a scheduler or a worker takes to start on a busy machine."""


def wait_for(path: Path, text: str = "") -> str:
    """Wait until a file holds ``text``, and return all that is in it."""
    latest = time.monotonic() + SECONDS
    while not path.exists() or text not in path.read_text(encoding="utf-8"):
        assert time.monotonic() < latest, path.read_text(encoding="utf-8") if path.exists() else ""
        time.sleep(0.05)
    return path.read_text(encoding="utf-8")


class Cluster:
    """A scheduler, and workers with one thread each; all end with the test."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder, self._stack = folder, stack
        folder.mkdir()
        self.scheduler = self._start(
            "scheduler", "--port", "0", "--scheduler-file", folder / "address.json"
        )
        self.address = json.loads(wait_for(folder / "address.json", "}"))["address"]

    def worker(self, name: str, tool: Path = PACKAGE.parent) -> "subprocess.Popen[bytes]":
        """Start a worker with the tool in a folder, and wait until it is connected."""
        process = self._start(
            "worker", self.address, "--name", name, "--nthreads", "1", "--no-nanny",
            "--local-directory", self.folder / name, log=f"{name}.log", tool=tool,
        )  # fmt: skip
        wait_for(self.folder / f"{name}.log", "Starting established connection")
        return process

    def _start(
        self, *arguments: str | Path, log: str = "scheduler.log", tool: Path | None = None
    ) -> "subprocess.Popen[bytes]":
        line = [sys.executable, "-P", "-m", "dask", *map(str, arguments)]
        line += ["--host", "127.0.0.1", "--no-dashboard"]
        out = self._stack.enter_context((self.folder / log).open("wb"))
        env = environment(PYTHONPATH=str(tool or ""))
        process = self._stack.enter_context(
            subprocess.Popen(line, env=env, stdout=out, stderr=out, cwd=self.folder)
        )
        self._stack.callback(process.kill)
        return process


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with ExitStack() as stack:
        yield Cluster(tmp_path / "cluster", stack)


@pytest.fixture
def other_version(tmp_path: Path) -> Path:
    """Return a folder with a copy of the tool in which one line differs."""
    folder = tmp_path / "other version"
    folder.mkdir()
    shutil.copytree(PACKAGE, folder / "fire_atlas")
    if (checkout := PACKAGE.parent / "pyproject.toml").exists():  # else it is installed
        shutil.copytree(PACKAGE.parent / "templates", folder / "templates")
        shutil.copy(checkout, folder)
    with (folder / "fire_atlas" / "core" / "easing.py").open("a", encoding="utf-8") as file:
        file.write("# another version\n")
    return folder


def test_every_recipe_is_built_while_workers_come_and_go(
    tmp_path: Path, cluster: Cluster, other_version: Path
) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=8, height=80)
    for i in range(4):
        repo.recipe(f"fire{i}.yaml", seed=i)
    doomed = cluster.worker("doomed")
    cluster.worker("old", other_version)
    line = command("build", repo.folder, "--json", "--scheduler", cluster.address)
    with _client(line) as process:
        assert process.stdout is not None and process.stderr is not None
        events = []
        for text in process.stdout:
            events.append(json.loads(text))
            if events[-1]["event"] == "stage" and doomed.poll() is None:
                doomed.kill()
                doomed.wait()
                cluster.worker("new")
        assert (process.wait(), process.stderr.read()) == (0, "")
    done = [event["recipe"] for event in events if event["event"] == "done"]
    assert sorted(Path(name).stem for name in done) == [f"fire{i}" for i in range(4)]
    remarks = [event["message"] for event in events if "recipe" not in event]
    assert [text.partition(":")[0] for text in remarks] == [
        "worker old gets no recipes",
        "worker doomed is gone; no other can build",
    ]
    assert f"waits until one comes (`dask worker {cluster.address}`)" in remarks[1]
    on_cluster = contents(repo.build)
    shutil.rmtree(repo.build)
    assert repo.run("build", repo.folder).code == 0
    assert contents(repo.build) == on_cluster


@contextmanager
def _client(line: list[str]) -> "Iterator[subprocess.Popen[str]]":
    """Start a build; whatever happens, it is ended at the end."""
    with subprocess.Popen(
        line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_scheduler_that_is_gone_is_named_for_each_recipe(
    tmp_path: Path, cluster: Cluster
) -> None:
    ran = cut_off(tmp_path, cluster, lambda process: cluster.scheduler.kill())
    assert ran.code == 1
    gone = f"yaml: the Dask scheduler at {cluster.address} is gone, or was started anew; run"
    assert ran.err.count(gone) == len(ran.err.splitlines()) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupted_client_leaves_no_lock(tmp_path: Path, cluster: Cluster) -> None:
    ran = cut_off(tmp_path, cluster, lambda process: process.send_signal(signal.SIGINT))
    assert ran.code == 130
    latest = time.monotonic() + SECONDS
    while (tmp_path / "repo" / "build").exists():
        assert time.monotonic() < latest
        time.sleep(0.05)


def cut_off(
    folder: Path, cluster: Cluster, action: Callable[["subprocess.Popen[str]"], None]
) -> Ran:
    """Run ``action`` with the client while a worker builds one of two recipes."""
    repo = Repo(folder / "repo")
    repo.clip(count=8, height=160)
    for i in range(2):
        repo.recipe(f"fire{i}.yaml", seed=i, timeline={"frames": 1000})
    cluster.worker("a")
    line = command("build", repo.folder, "--json", "--scheduler", cluster.address)
    with _client(line) as process:
        assert process.stdout is not None and process.stderr is not None
        while '"stage"' not in process.stdout.readline():
            assert process.poll() is None
        action(process)
        out, err = process.communicate(timeout=SECONDS)
    return Ran(process.returncode, out, err)


def test_errors_and_options_are_those_of_a_build_here(tmp_path: Path, cluster: Cluster) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    repo.recipe("good.yaml")
    repo.recipe("bad.yaml", path="nowhere")
    cluster.worker("a")
    out = tmp_path / "out"
    options = ("-o", out, "--set", "flakes=none", "--scheduler", cluster.address)
    ran = run_alone(command("build", repo.folder, *options))
    assert ran.code == 1
    *_, totals, failed = ran.out.splitlines()
    assert totals == "2 recipes: 1 built, 1 failed" and "bad.yaml:1: source.path: " in failed
    assert "nowhere: does not exist" in ran.err
    assert (out / "good.png").is_file() and not (out / "good.flakes.json").exists()


def test_a_cluster_without_a_worker_of_this_version_is_refused(
    tmp_path: Path, cluster: Cluster, other_version: Path
) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    line = command("build", repo.recipe(), "--scheduler", cluster.address)
    ran = run_alone(line)
    assert ran.code == 1 and "it has no workers" in ran.err
    cluster.worker("old", other_version)
    (tmp_path / "bare" / "fire_atlas").mkdir(parents=True)
    (tmp_path / "bare" / "fire_atlas" / "__init__.py").touch()
    cluster.worker("bare", tmp_path / "bare")
    ran = run_alone(line)
    assert ran.code == 1
    assert "error: worker old gets no recipes: its fire-atlas or one of its libraries" in ran.err
    assert "error: worker bare gets no recipes: its fire-atlas cannot be run" in ran.err
    assert not repo.build.exists()


def test_an_address_where_nobody_answers_is_refused(tmp_path: Path) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    recipe = repo.recipe()
    ran = run_alone(command("build", recipe, "--scheduler", "tcp://127.0.0.1:1"))
    assert ran.code == 1 and "no Dask scheduler answers there" in ran.err
    ran = run_alone(command("build", recipe, "--scheduler", "no address"))
    assert ran.code == 1 and "no Dask scheduler answers there" in ran.err
    assert "Traceback" not in ran.err


def test_threads_are_the_workers_own(tmp_path: Path) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    ran = repo.run("build", repo.recipe(), "--scheduler", "tcp://127.0.0.1:1", "--jobs", "2")
    assert ran.code == 2 and "--jobs: not with --scheduler" in ran.err


def test_without_dask_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "fire_atlas.cli.cluster", raising=False)
    monkeypatch.delitem(sys.modules, "fire_atlas.cli.cluster_worker", raising=False)
    ran = repo.run("build", repo.recipe(), "--scheduler", "tcp://127.0.0.1:1")
    assert ran.code == 1 and "pip install 'fire-atlas[cluster]'" in ran.err


@pytest.mark.skipif(sys.platform != "linux", reason="a path that each process sees otherwise")
def test_outputs_come_back_by_the_cache_where_no_folder_is_shared(
    tmp_path: Path, cluster: Cluster
) -> None:
    repo = Repo(tmp_path / "repo")
    repo.clip(count=4, height=40)
    for i in range(2):
        repo.recipe(f"fire{i}.yaml", seed=i)
    cluster.worker("a")
    out = "/proc/self/cwd/out"  # for the worker another folder than here
    line = command("build", repo.folder, "-o", out, "--scheduler", cluster.address)

    def run(*options: str | Path) -> "subprocess.CompletedProcess[str]":
        given = [*line, *map(str, options)]
        return subprocess.run(
            given, cwd=repo.folder, env=environment(), capture_output=True, text=True, check=False
        )

    ran = run()
    assert ran.returncode == 1
    assert "fire1.yaml: a worker has built it, but not into /proc/self/cwd/out" in ran.stderr
    assert not (repo.folder / "out").exists()
    shutil.rmtree(cluster.folder / "out")
    ran = run("--cache", tmp_path / "cache", "--json")
    assert ran.returncode == 0, ran.stderr
    events = [json.loads(text) for text in ran.stdout.splitlines()]
    assert [e["result"] for e in events if e["event"] == "cache"].count("hit") == 2
    assert contents(repo.folder / "out") == contents(cluster.folder / "out")
