"""A commit is whole or undone, and what a process that died has left is put right."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.errors import OutputError
from fire_atlas.core.interruption import EXIT_CODE
from fire_atlas.outputs.journal import commit
from fire_atlas.outputs.locks import folder_lock, locked, locked_if_free, recipe_lock
from fire_atlas.outputs.recovery import recover, staging_folder, tidy
from fire_atlas.outputs.staging import Staging, write_whole
from tests.support.repo import environment, run_alone

posix = pytest.mark.skipif(sys.platform == "win32", reason="symbolic links of POSIX")


def ignore(message: str) -> None:
    """Hear nothing."""


def contents(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in out.iterdir()}


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


OLD = {"a.png": b"old a", "b.png": b"old b", "stale.png": b"stale", "x.manifest.json": b"old"}
NEW = {"a.png": b"new a", "c.png": b"new c", "x.manifest.json": b"new"}


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    for name, data in OLD.items():
        (folder / name).write_bytes(data)
    return folder


@contextmanager
def staged(out: Path) -> Iterator[Staging]:
    """Open a staging that holds the new files."""
    with Staging(out, "x", ignore) as staging:
        for name, data in NEW.items():
            with staging.open(name) as file:
                file.write(data)
        yield staging


def write_new(out: Path) -> None:
    with staged(out) as staging, staging.folder_locked():
        staging.commit(["stale.png"])


def leave_unfinished(out: Path, changed: dict[str, bytes | None]) -> None:
    """Leave what a process that is killed in the middle of a commit leaves: some files changed."""
    folder = staging_folder(out, "x")
    folder.previous.mkdir(parents=True)
    names = ["a.png", "c.png", "stale.png", "x.manifest.json"]
    changes = [
        {
            "name": name,
            "before": sha256(OLD[name]) if name in OLD else None,
            "after": sha256(NEW[name]) if name in NEW else None,
        }
        for name in names
    ]
    for name in set(names) & OLD.keys():
        (folder.previous / name).write_bytes(OLD[name])
    document = {"format": "fire-atlas/journal", "version": 1, "changes": changes}
    folder.journal.write_text(json.dumps(document))
    (out / "x.manifest.json").unlink()
    for name, data in changed.items():
        if data is None:
            (out / name).unlink()
        else:
            (out / name).write_bytes(data)


def test_a_commit_writes_and_removes_all_and_leaves_nothing_else(out: Path) -> None:
    write_new(out)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"a.png": NEW["a.png"]},
        {"a.png": NEW["a.png"], "c.png": NEW["c.png"]},
        {"a.png": NEW["a.png"], "c.png": NEW["c.png"], "stale.png": None},
    ],
)
def test_an_unfinished_commit_is_undone_by_who_comes_next(
    out: Path, changed: dict[str, bytes | None]
) -> None:
    leave_unfinished(out, changed)
    recover(out, "x", ignore)
    assert contents(out) == OLD


def test_what_a_power_cut_leaves_of_a_finished_commit_stops_no_build(out: Path) -> None:
    """The folder with the old files is removed before the journal."""
    leave_unfinished(out, {**NEW, "stale.png": None})
    shutil.rmtree(staging_folder(out, "x").previous)
    write_new(out)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


def test_a_commit_whose_manifest_is_in_place_is_finished(out: Path) -> None:
    leave_unfinished(out, {**NEW, "stale.png": None})
    recover(out, "x", ignore)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


def test_what_a_person_wrote_since_survives_the_undoing(out: Path) -> None:
    leave_unfinished(out, {"a.png": b"painted", "c.png": b"painted too"})
    recover(out, "x", ignore)
    assert contents(out) == OLD | {"a.png": b"painted", "c.png": b"painted too"}


def test_a_manifest_does_not_come_back_without_what_it_vouches_for(out: Path) -> None:
    leave_unfinished(out, {"a.png": NEW["a.png"]})
    (staging_folder(out, "x").previous / "a.png").unlink()
    recover(out, "x", ignore)
    assert "x.manifest.json" not in contents(out)


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "7", "[" * 100_000, '{"format": "fire-atlas/journal", "version": 1}',
     '{"format": "fire-atlas/journal", "version": 1, "changes": [{"name": "a.png"}]}'],
)  # fmt: skip
def test_a_broken_journal_changes_nothing(out: Path, text: str) -> None:
    leave_unfinished(out, {})
    staging_folder(out, "x").journal.write_text(text)
    recover(out, "x", ignore)
    assert contents(out) == {name: OLD[name] for name in OLD if name != "x.manifest.json"}


@pytest.mark.parametrize("name", ["../mine.txt", ".gitignore", "other.manifest.json"])
def test_a_hostile_journal_reaches_no_file_that_a_build_does_not_write(
    out: Path, name: str
) -> None:
    (out / name).write_bytes(b"mine")
    leave_unfinished(out, {})
    journal = staging_folder(out, "x").journal
    document = json.loads(journal.read_text())
    document["changes"].insert(0, {"name": name, "before": None, "after": sha256(b"mine")})
    journal.write_text(json.dumps(document))
    recover(out, "x", ignore)
    assert (out / name).read_bytes() == b"mine"


@posix
def test_a_staging_folder_that_is_a_link_is_removed_and_not_followed(
    out: Path, tmp_path: Path
) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "precious.txt").write_text("mine")
    (mine / ".journal").write_text("{}")
    staging_folder(out, "x").path.symlink_to(mine)
    recover(out, "x", ignore)
    write_new(out)
    assert (mine / "precious.txt").read_text() == "mine"
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


@posix
@pytest.mark.parametrize("is_link", [True, False])
@pytest.mark.parametrize("which", ["output folder", "staging folder"])
def test_what_takes_the_path_of_a_folder_during_a_build_is_not_touched(
    out: Path, tmp_path: Path, which: str, is_link: bool
) -> None:
    path = out if which == "output folder" else staging_folder(out, "x").path
    away, mine = tmp_path / "away", tmp_path / "mine"
    users = dict.fromkeys((*OLD, *NEW), b"precious")
    with staged(out) as staging:
        path.rename(away)
        mine.mkdir()
        for name, data in users.items():
            (mine / name).write_bytes(data)
        if is_link:
            path.symlink_to(mine)
        else:
            mine.rename(path)
        with staging.open("a.png") as file:
            file.write(b"newer")
        with pytest.raises(OutputError, match=f"^{path}: was moved away, or exchanged"):
            staging.folder_locked()
        with pytest.raises(OutputError, match=f"^{path}: was moved away, or exchanged"):
            staging.commit([])
    assert contents(mine if is_link else path) == users
    before = away if which == "output folder" else out
    assert {name: (before / name).read_bytes() for name in OLD} == OLD


@posix
def test_a_link_that_comes_before_a_new_folder_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine, out, mkdir = tmp_path / "mine", tmp_path / "out", Path.mkdir
    mine.mkdir()

    def outrun(self: Path, *given: Any, **named: Any) -> None:
        if self == out and not out.exists():
            out.symlink_to(mine)
        mkdir(self, *given, **named)

    monkeypatch.setattr(Path, "mkdir", outrun)
    with pytest.raises(OutputError, match=r"cannot be written|in the way"):
        write_new(out)
    assert [path.name for path in mine.iterdir() if path.suffix != ".lock"] == []


@posix
def test_a_link_among_staged_files_is_not_written_through(out: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.png"
    mine.write_bytes(b"precious")
    with Staging(out, "x", ignore) as staging:
        staging.path("a.png").symlink_to(mine)
        with staging.open("a.png") as file:
            file.write(NEW["a.png"])
        assert staging.path("a.png").read_bytes() == NEW["a.png"]
    assert mine.read_bytes() == b"precious"


@pytest.mark.parametrize("digest", ["", [], 5, "x" * 64])
def test_a_journal_without_digests_moves_nothing(out: Path, digest: object) -> None:
    """Of a link or a folder none can be stated: it is never a build's."""
    folder = staging_folder(out, "x")
    folder.previous.mkdir(parents=True)
    (out / "link").symlink_to("elsewhere")
    change = {"name": "link", "before": None, "after": digest}
    document = {"format": "fire-atlas/journal", "version": 1, "changes": [change, change]}
    folder.journal.write_text(json.dumps(document))
    recover(out, "x", ignore)
    assert (out / "link").is_symlink() and not folder.journal.exists()


@posix
@pytest.mark.timeout(60)
@pytest.mark.parametrize("kind", ["pipe", "file"])
def test_what_lies_in_the_place_of_a_staging_folder_stops_no_build(out: Path, kind: str) -> None:
    place = staging_folder(out, "other").path
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.touch()
    write_new(out)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


@posix
def test_a_lock_that_is_another_name_of_a_users_file_does_not_empty_it(out: Path) -> None:
    (out / "mine.txt").write_text("precious")
    recipe_lock(out, "x").hardlink_to(out / "mine.txt")
    write_new(out)
    assert (out / "mine.txt").read_text() == "precious"


def test_without_a_journal_nothing_is_written(out: Path) -> None:
    before = out.stat().st_mtime_ns
    recover(out, "x", ignore)
    assert out.stat().st_mtime_ns == before


def test_the_manifest_is_away_while_anything_changes(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, seen = os.replace, list[tuple[str, bool]]()

    def watched(path: str, target: str, **folders: int) -> None:
        seen.append((Path(target).name, (out / "x.manifest.json").exists()))
        replace(path, target, **folders)

    monkeypatch.setattr(os, "replace", watched)
    write_new(out)
    assert seen[1:] == [("a.png", False), ("c.png", False), ("x.manifest.json", False)]


def test_a_commit_that_cannot_even_be_undone_is_undone_later(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, previous = os.replace, staging_folder(out, "x").previous

    def failing(path: str, target: str, src_dir_fd: int, dst_dir_fd: int) -> None:
        is_kept = previous.exists() and os.path.samestat(os.fstat(src_dir_fd), previous.stat())
        if target == "c.png" or is_kept:
            raise PermissionError(13, "Permission denied", path)
        replace(path, target, src_dir_fd=src_dir_fd, dst_dir_fd=dst_dir_fd)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", failing)
        with pytest.raises(OutputError, match="cannot be written"):
            write_new(out)
    assert "x.manifest.json" not in contents_of_files(out)
    recover(out, "x", ignore)
    assert contents(out) == OLD


def contents_of_files(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}


def test_what_dead_builds_left_is_removed_by_the_next_one_of_any_name(out: Path) -> None:
    for name in ("x", "y"):
        staging_folder(out, name).previous.mkdir(parents=True)
        (staging_folder(out, name).path / "page.png").write_bytes(b"half")
        recipe_lock(out, name).write_text("process 1 on elsewhere")
    folder_lock(out).write_text("process 1 on elsewhere")
    tidy(out, "z", ignore)
    assert contents(out) == OLD
    write_new(out)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


_HOLDS = """
import sys, time
from pathlib import Path
from fire_atlas.outputs.staging import Staging, write_whole
with Staging(Path(sys.argv[1]), sys.argv[2], print):
    print("holds", flush=True)
    time.sleep(float(sys.argv[3]))
"""


@contextmanager
def another_build(out: Path, name: str, seconds: float) -> Iterator[subprocess.Popen[str]]:
    """Let another process hold the staging of ``name`` for some time."""
    line = [sys.executable, "-c", _HOLDS, str(out), name, str(seconds)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment()) as process:
        assert process.stdout is not None and process.stdout.readline() == "holds\n"
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
def test_a_build_waits_for_another_of_its_name_and_says_for_whom(out: Path) -> None:
    messages = list[str]()
    with another_build(out, "x", 3) as other, Staging(out, "x", messages.append):
        assert other.wait() == 0
    assert len(messages) == 1 and f"waits for process {other.pid} on " in messages[0]


_IS_ENDED_AT_ITS_END = """
import os, shutil, signal, sys
from pathlib import Path
from fire_atlas.core.interruption import end_on_signals
from fire_atlas.outputs.staging import Staging
remove = shutil.rmtree
def interrupted(*arguments, **named):
    shutil.rmtree = remove
    os.kill(os.getpid(), signal.SIGTERM)
    remove(*arguments, **named)
end_on_signals()
with Staging(Path(sys.argv[1]), "x", print) as staging, staging.open("a.png") as file:
    file.write(b"half")
    shutil.rmtree = interrupted
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_signal_during_the_clean_up_leaves_nothing(out: Path) -> None:
    ended = run_alone([sys.executable, "-c", _IS_ENDED_AT_ITS_END, str(out)])
    assert ended.code == EXIT_CODE
    assert contents(out) == OLD


def test_a_live_build_of_another_name_keeps_its_staging_folder(out: Path) -> None:
    with another_build(out, "y", 60):
        write_new(out)
        assert staging_folder(out, "y").path.is_dir()
    write_new(out)
    assert contents(out) == NEW | {"b.png": OLD["b.png"]}


def test_a_lock_is_taken_by_one_and_its_file_is_gone_afterwards(tmp_path: Path) -> None:
    path = tmp_path / "folder" / ".lock"
    with locked(path, ignore):
        with locked_if_free(path) as is_free:
            assert not is_free
        assert path.exists()
    assert not path.exists()
    with locked_if_free(path) as is_free:
        assert is_free


def test_each_step_of_a_commit_is_on_the_disk_before_the_next(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = list[str]()

    def recorded(name: str) -> Callable[..., Any]:
        call = getattr(os, name)

        def recording(*arguments: Any, **keys: Any) -> Any:
            done.append(name)
            return call(*arguments, **keys)

        return recording

    with staged(out):
        names = "a.png", "x.manifest.json"
        with staging_folder(out, "x").held() as folders, monkeypatch.context() as patch:
            changes = [folders.change(name, folders.staged.digest(name)) for name in names]
            for name in ("fsync", "replace", "unlink", "link"):
                patch.setattr(os, name, recorded(name))
            commit(folders, changes)
    assert done == [
        "link", "link", "fsync",  # what was there is kept
        "fsync", "replace", "fsync", "fsync",  # the journal says so
        "unlink", "fsync",  # the manifest is withdrawn
        "replace", "fsync",  # the page
        "replace", "fsync",  # the manifest
        "unlink",  # the journal
    ]  # fmt: skip


@pytest.mark.timeout(60)
def test_waiting_ends_when_the_other_dies(out: Path) -> None:
    with another_build(out, "x", 600) as other:
        other.kill()
        write_new(out)
    assert contents(out)["a.png"] == NEW["a.png"]


@posix
@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_what_a_killed_writer_of_one_file_leaves_goes_with_the_next(
    tmp_path: Path, call: str
) -> None:
    target = tmp_path / "page.html"
    target.write_bytes(b"before")
    program = (
        "import os, signal, sys; from pathlib import Path\n"
        "from fire_atlas.outputs.staging import write_whole\n"
        f"os.{call} = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)\n"
        "write_whole(Path(sys.argv[1]), b'after', print)"
    )
    done = subprocess.run([sys.executable, "-c", program, str(target)], check=False)
    assert done.returncode == -9
    assert target.read_bytes() == b"before"
    write_whole(tmp_path / "other.html", b"other", ignore)
    assert contents(tmp_path) == {"page.html": b"before", "other.html": b"other"}
    write_whole(target, b"after", ignore)
    assert contents(tmp_path) == {"page.html": b"after", "other.html": b"other"}


def test_one_file_is_written_into_a_folder_that_is_there(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="there is no folder"):
        write_whole(tmp_path / "no" / "page.html", b"", ignore)
    with pytest.raises(OutputError, match="is a folder; name the file"):
        write_whole(tmp_path, b"", ignore)
    assert contents(tmp_path) == {}
