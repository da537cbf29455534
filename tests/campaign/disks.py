"""Commands on disks that are full, fill up, or can only be read, and in folders without rights.

A small disk is a tmpfs, which only root can mount: others try only what they can. Wrong is a file
of the older command that is gone or changed, a mixture, or litter, but for a command that succeeds
in spite of all; an exit code that says so where not all files are new; a signal that ends it; no
error on stderr, one without advice, or one that nobody had thought of. When there is room and
rights again, the same command has to succeed.
"""

import os
import random
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import cache, partial
from pathlib import Path

from tests.campaign.forks import code_of, is_careless, seconds_of
from tests.campaign.rows import chosen, run_rows
from tests.campaign.stages import AnyStage, stage_of

_TRIES = {
    "movies": 10, "gpu": 8, "exr": 8, "build": 10, "learn": 6, "preview": 6, "init": 4,
    "plugin godot": 4, "plugin unity": 4,
}  # fmt: skip
"""Tries of a whole campaign."""

_DISK = "size=64m,nr_inodes=2000"
"""Room for all states of a folder."""

_BLOCK = 4096

_NOBODY = 65534
"""A user without rights."""

_ADVICE = ("Free some space", "choose another folder", "change its permissions")
"""Any of these words is advice."""


class Disk:
    """The disk of a stage.

    Attributes:
        stage: Lies on it, but for what its commands say.
        folder: Where it is mounted.
        seconds: How long the command takes.
        needs: Bytes of the files that it writes.
    """

    def __init__(self, stage: AnyStage) -> None:
        self.stage, self.folder = stage, stage.folder
        stage.said = stage.folder.with_name("said")
        stage.reset()
        self.seconds = seconds_of(lambda: code_of(stage.start_new()))
        written = [len(data) for name, data in stage.new.items() if stage.old.get(name) != data]
        self.needs = sum(-(-size // _BLOCK) * _BLOCK for size in written)

    def leave(self, free: int) -> None:
        """Leave so many bytes free."""
        status = os.statvfs(self.folder)
        with self._ballast.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, status.f_bavail * status.f_frsize - free)

    def fill(self) -> None:
        """Leave no byte free, though others write too."""
        with suppress(OSError), self._ballast.open("wb", buffering=0) as file:
            while True:
                file.write(bytes(_BLOCK))

    def empty(self) -> None:
        """Free all that was filled."""
        self._ballast.unlink(missing_ok=True)

    def remount(self, options: str) -> None:
        _mount("-o", f"remount,{options}", self.folder)

    @property
    def _ballast(self) -> Path:
        return self.folder / "ballast"


@contextmanager
def _full(disk: Disk, chance: random.Random) -> Iterator[int]:
    disk.leave(chance.randrange(0, disk.needs, _BLOCK))
    yield disk.stage.start_new()
    disk.empty()


@contextmanager
def _fills_up(disk: Disk, chance: random.Random) -> Iterator[int]:
    pid = disk.stage.start_new()
    time.sleep(chance.uniform(0, disk.seconds))
    disk.fill()
    yield pid
    disk.empty()


@contextmanager
def _without_inodes(disk: Disk, chance: random.Random) -> Iterator[int]:
    status = os.statvfs(disk.folder)
    disk.remount(f"nr_inodes={status.f_files - status.f_ffree + chance.randrange(12)}")
    yield disk.stage.start_new()
    disk.remount(_DISK)


@contextmanager
def _read_only(disk: Disk, _: random.Random) -> Iterator[int]:
    disk.remount("ro")
    yield disk.stage.start_new()
    disk.remount("rw")


@contextmanager
def _without_rights(disk: Disk, _: random.Random) -> Iterator[int]:
    folders = [disk.stage.out, *(path for path in disk.stage.out.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    yield disk.stage.start_new(before=_give_up_root)
    for folder in folders:
        folder.chmod(0o755)


def _give_up_root() -> None:
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(_NOBODY)
        os.setuid(_NOBODY)


@contextmanager
def _small_files(disk: Disk, chance: random.Random) -> Iterator[int]:
    largest = max(map(len, disk.stage.new.values()))
    limit = chance.randrange(largest)
    yield disk.stage.start_new(
        before=partial(resource.setrlimit, resource.RLIMIT_FSIZE, (limit, limit))
    )


_Trouble = Callable[[Disk, random.Random], AbstractContextManager[int]]
"""Starts the command of a stage with something in its way; yields its process id."""

_OF_ANYBODY: tuple[_Trouble, ...] = (_small_files, _without_rights)
_OF_ROOT: tuple[_Trouble, ...] = (_full, _fills_up, _without_inodes, _read_only)


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` commands drawn by chance, or all."""
    if not _may_mount():
        print("no right to mount: only folders without rights, and files of limited size")
    return run_rows(troubled, chosen(_TRIES, count, seed), seed)


def troubled(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Try one kind of command; return what was wrong each time."""
    troubles = [*_OF_ANYBODY, *(_OF_ROOT if _may_mount() else ())]
    if kind == "exr":  # starts another Python, which a user without rights may not find
        troubles.remove(_without_rights)
    with ExitStack() as stack:
        above = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="disk-")))
        above.chmod(0o755)
        folder = above / "disk"
        folder.mkdir()
        if _may_mount():
            _mount("-t", "tmpfs", "-o", _DISK, "tmpfs", folder)
            stack.callback(_unmount, folder)
        disk = Disk(stack.enter_context(stage_of(kind, folder)))
        first = [*_TRIES].index(kind)
        return [
            _try(disk, troubles[(first + number) % len(troubles)], f"{seed} {kind} {number}")
            for number in numbers
        ]


def _try(disk: Disk, trouble: _Trouble, seed: str) -> list[str]:
    """Let a command meet trouble, and run it again without; return what is wrong after either."""
    stage = disk.stage
    stage.reset()
    with trouble(disk, random.Random(seed)) as pid:
        code = code_of(pid)
        said = stage.said.read_text()
    found = stage.faults_whole(*([stage.new] if code == 0 else [stage.old]))
    if code not in {0, 1}:
        found.append(f"exit code {code}")
    if code and not (said.startswith("error: ") and any(word in said for word in _ADVICE)):
        found.append("no advice")
    if is_careless(said):
        found.append("it has not thought of this")
    found += stage.then(stage.next[-1])
    return [f"{trouble.__name__[1:]}, code {code} ({said.strip()}): {fault}" for fault in found]


@cache
def _may_mount() -> bool:
    """Return whether this process may mount anything."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            _mount("-t", "tmpfs", "tmpfs", folder)
            _unmount(Path(folder))
        except (OSError, subprocess.CalledProcessError):
            return False
    return True


def _mount(*words: str | Path) -> None:
    subprocess.run(["mount", *words], check=True, capture_output=True)


def _unmount(folder: Path) -> None:
    subprocess.run(["umount", "-l", folder], check=True)
