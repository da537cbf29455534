"""A folder in which builds run on a Dask cluster of this machine, with one worker."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

import fire_atlas.cli.cluster  # noqa: F401 - for forks of this process
from tests.campaign.stage import NEW, Stage
from tests.cli.test_cluster import Cluster

_SECONDS = 30
"""Far more than a worker takes to end a build that nobody waits for."""


class ClusterStage(Stage):
    """Builds the new state on a cluster, and all others here."""

    def __init__(self, folder: Path, address: str, worker: int) -> None:
        """Use the scheduler at ``address``, whose worker is the process ``worker``."""
        super().__init__(folder)
        self._address, self._worker = address, worker

    def start_new(self, before: Callable[[], None] = lambda: None) -> int:
        return self.start("build", *NEW, "--scheduler", self._address, before=before)

    def victims(self, pid: int) -> list[int]:
        """Return the command and, if it runs, the process in which the worker builds."""
        return [pid, *self._building()]

    def faults_whole(self, *states: Mapping[str, bytes]) -> list[str]:
        """Return what is wrong once the worker has ended its build too, by killing it."""
        self._wait_for_worker()
        return self.faults_after(*states, litter=True)

    def then(self, command: str) -> list[str]:
        """Run the next command here; what the worker still builds may not change its outputs."""
        faults, before = super().then(command), self.contents()
        self._wait_for_worker()
        if command != "check" and self.contents() != before:
            faults.append("the worker has changed the outputs afterwards")
        return faults

    def _wait_for_worker(self) -> None:
        latest = time.monotonic() + _SECONDS
        while self._building():
            assert time.monotonic() < latest, "the worker builds on and on"
            time.sleep(0.01)

    def _building(self) -> list[int]:
        """Return the processes in which the worker builds."""
        found = []
        for children in Path(f"/proc/{self._worker}/task").glob("*/children"):
            found += [int(pid) for pid in children.read_text().split()]
        return [pid for pid in found if b"build_process" in _command_line(pid)]


def _command_line(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:  # it has ended
        return b""


@contextmanager
def cluster_stage(folder: Path) -> Iterator[ClusterStage]:
    """Start a cluster, and yield a folder for builds on it."""
    with ExitStack() as stack:
        cluster = Cluster(folder / "cluster", stack)
        worker = cluster.worker("a")
        yield ClusterStage(folder, cluster.address, worker.pid)
