"""Builds with a shared cache write what builds without one write, whatever is wrong with it."""

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, BinaryIO

import pytest

from fire_atlas.outputs.cache.store import StoreError, open_store
from fire_atlas.outputs.staging import Staging
from tests.support.entries import described, forge, header, taken_apart
from tests.support.repo import Ran, Repo, command, contents, environment, run_alone, script
from tests.support.silent_server import SILENCES, silent_server

pytestmark = pytest.mark.slow
posix = pytest.mark.skipif(sys.platform == "win32", reason="limits and permissions of POSIX")

EVERYTHING: dict[str, Any] = {
    "exports": [
        "json", "json-array", "phaser", "css", "tpsheet", "godot",
        {"unity": {"assembly": True, "namespace": "My.Game"}},
        {"template": "list.j2", "to": "{{ name }}.txt"},
    ],
    "tracks": ["json", "csv", "pcache", "hjson", "light"],
    "atlas": {"scales": [1, 0.5], "max_size": 128},
    "maps": {"flame": True},
    "flakes": {"bake": False, "rate": 60},
}  # fmt: skip


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a cache that does not exist yet, which the environment names."""
    monkeypatch.setenv("FIRE_ATLAS_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def filled(repo: Repo, cache: Path) -> dict[str, bytes]:
    """Build a recipe, so that the cache has it, remove its outputs, and return these."""
    repo.clip()
    outputs = repo.built(repo.recipe())
    assert len(list(cache.iterdir())) == 1
    empty(repo.build)
    return outputs


def empty(build: Path) -> None:
    for path in build.iterdir():
        path.unlink()


def events(repo: Repo, *arguments: str | Path) -> list[tuple[str, str]]:
    """Build, expect success, and return what the cache did, with the reasons."""
    ran = repo.run("build", *arguments, "--json")
    assert ran.code == 0, ran.err
    said = [json.loads(line) for line in ran.out.splitlines()]
    return [(line["result"], line["why"]) for line in said if line["event"] == "cache"]


def results(repo: Repo, *arguments: str | Path) -> list[str]:
    return [result for result, _ in events(repo, *arguments)]


def notes(ran: Ran) -> list[str]:
    """Return the lines about the cache that are printed without -v."""
    assert ran.code == 0, ran.err
    assert "Traceback" not in ran.err
    return [line for line in ran.err.splitlines() if "cache:" in line]


def entry_of(cache: Path) -> Path:
    (entry,) = cache.glob("*.tar")
    return entry


def test_a_hit_writes_the_bytes_of_a_build(repo: Repo, filled: dict[str, bytes]) -> None:
    assert results(repo, repo.folder / "fire.yaml") == ["hit"]
    assert contents(repo.build) == filled
    assert repo.run("build", repo.folder / "fire.yaml").is_up_to_date


def test_a_hit_writes_every_kind_of_file(repo: Repo, cache: Path) -> None:
    repo.clip()
    (repo.folder / "list.j2").write_text("{{ name }}", encoding="utf-8")
    recipe = repo.recipe(**EVERYTHING)
    outputs = repo.built(recipe)
    empty(repo.build)
    assert results(repo, recipe) == ["hit"]
    assert contents(repo.build) == outputs
    without = repo.recipe(**{**EVERYTHING, "exports": EVERYTHING["exports"][:-1]})
    assert results(repo, without, "-o", repo.folder / "a") == ["miss", "stored"]
    assert results(repo, without, "-o", repo.folder / "b") == ["hit"]
    assert contents(repo.folder / "a") == contents(repo.folder / "b")


def test_a_hit_imports_no_library_of_pixels(repo: Repo, filled: dict[str, bytes]) -> None:
    tell = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr))"
    modules = set(run_alone(script(tell, "build", repo.folder / "fire.yaml")).err.split())
    assert contents(repo.build) == filled
    assert "fire_atlas.pipeline.files.restore" in modules
    assert modules.isdisjoint({"numpy", "cv2", "scipy", "PIL", "fsspec"})


def test_another_machine_with_another_folder_finds_it(
    repo: Repo, filled: dict[str, bytes], tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    moved = repo.folder.rename(tmp_path / "elsewhere" / "repo")
    other = Repo(tmp_path / "unused")
    assert results(other, moved / "fire.yaml") == ["hit"]
    assert contents(moved / "build") == filled


def a_key(repo: Repo) -> None:
    repo.recipe(seed=1)


def a_name(repo: Repo) -> None:
    (repo.folder / "clip").rename(repo.folder / "other")
    repo.recipe(path="other")


def a_frame(repo: Repo) -> None:
    first, second = sorted((repo.folder / "clip").iterdir())[:2]
    first.write_bytes(second.read_bytes())


def one_frame_more(repo: Repo) -> None:
    first = min((repo.folder / "clip").iterdir())
    (repo.folder / "clip" / "0099.png").write_bytes(first.read_bytes())


@pytest.mark.parametrize("change", [a_key, a_name, a_frame, one_frame_more])
@pytest.mark.usefixtures("filled")
def test_whatever_a_build_is_made_from_counts(repo: Repo, change: Any) -> None:
    change(repo)
    assert results(repo, repo.folder / "fire.yaml") == ["miss", "stored"]


@pytest.mark.parametrize("file", ["list.j2", "base.yaml", "member.yaml"])
@pytest.mark.usefixtures("cache")
def test_templates_bases_and_members_count(repo: Repo, file: str) -> None:
    repo.clip()
    texts = {
        "list.j2": "{{ name }}",
        "base.yaml": "seed: 3",
        "member.yaml": '{"extends": "fire.yaml"}',
    }
    for name, text in texts.items():
        (repo.folder / name).write_text(text, encoding="utf-8")
    repo.recipe("member.yaml", flakes="none")
    exports = [{"template": "list.j2", "to": "{{ name }}.txt"}]
    recipe = repo.recipe(extends="base.yaml", exports=exports, atlas={"members": ["member.yaml"]})
    repo.built(recipe)
    empty(repo.build)
    assert results(repo, recipe) == ["hit"]
    changes = {"list.j2": "{{ name }}!", "base.yaml": "seed: 4", "member.yaml": None}
    if changes[file] is None:
        repo.recipe(file, flakes="none", seed=9)
    else:
        (repo.folder / file).write_text(str(changes[file]), encoding="utf-8")
    assert results(repo, recipe)[0] == "miss"


@pytest.mark.parametrize("what", ["tool_digest", "cpu_class", "_system"])
@pytest.mark.usefixtures("filled")
def test_tool_cpu_and_system_count(repo: Repo, what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = repo.folder / "fire.yaml"
    monkeypatch.setattr(f"fire_atlas.outputs.cache.key.{what}", lambda: "another")
    ((result, why), *_) = events(repo, recipe)
    assert result == "miss"
    assert "no entry" in why


def test_a_miss_says_what_to_compare_and_v_shows_it(repo: Repo, cache: Path) -> None:
    repo.clip()
    recipe = repo.recipe()
    assert "cache" not in repo.run("build", recipe).err
    for option, words in (("--force", ["stored"]), ("-v", ["hit", "recipe", "inputs", "tool"])):
        empty(repo.build)
        ran = repo.run("build", recipe, "-v", option)
        assert all(word in ran.err for word in words), ran.err


def test_a_damaged_entry_is_a_miss_and_is_replaced(
    repo: Repo, filled: dict[str, bytes], cache: Path
) -> None:
    entry = entry_of(cache)
    whole = entry.read_bytes()
    at = whole.index(filled["fire.png"]) + 200
    for damaged in (whole[:at] + b"\0\0\0\0" + whole[at + 4 :], whole[:at], b""):
        entry.write_bytes(damaged)
        ran = repo.run("build", repo.folder / "fire.yaml")
        assert not notes(ran)
        assert contents(repo.build) == filled
        assert entry.read_bytes() == whole
        empty(repo.build)


def test_force_builds_and_stores(repo: Repo, filled: dict[str, bytes], cache: Path) -> None:
    entry_of(cache).write_bytes(b"")
    assert results(repo, repo.folder / "fire.yaml", "--force") == ["stored"]
    assert entry_of(cache).stat().st_size > sum(map(len, filled.values()))


def test_read_mode_takes_and_does_not_store(
    repo: Repo, filled: dict[str, bytes], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = repo.folder / "fire.yaml"
    entry, before = entry_of(cache), entry_of(cache).stat().st_mtime_ns
    assert results(repo, recipe, "--cache-mode", "read") == ["hit"]
    monkeypatch.setenv("FIRE_ATLAS_CACHE_MODE", "read")
    assert results(repo, recipe, "--set", "seed=5") == ["miss"]
    assert list(cache.iterdir()) == [entry]
    assert entry.stat().st_mtime_ns == before
    assert results(repo, recipe, "--cache-mode", "read-write", "--set", "seed=6") == [
        "miss",
        "stored",
    ]
    monkeypatch.setenv("FIRE_ATLAS_CACHE_MODE", "sometimes")
    ran = repo.run("build", recipe, "--set", "seed=7")
    assert ran.code == 2
    assert "FIRE_ATLAS_CACHE_MODE" in ran.err


def test_the_option_wins_over_the_environment(repo: Repo, cache: Path, tmp_path: Path) -> None:
    repo.clip()
    recipe = repo.recipe()
    assert results(repo, recipe, "--cache", tmp_path / "mine") == ["miss", "stored"]
    assert results(repo, recipe, "--cache", "", "--force") == []
    assert entry_of(tmp_path / "mine").exists()
    assert not cache.exists()


@pytest.mark.parametrize("taken", ["fire.png", "fire.flakes.json", "fire.manifest.json"])
def test_a_hit_replaces_nothing_of_the_users(
    repo: Repo, filled: dict[str, bytes], taken: str
) -> None:
    (repo.build / taken).write_bytes(b"mine")
    ran = repo.run("build", repo.folder / "fire.yaml")
    assert ran.code == 1
    assert taken in ran.err and "--overwrite" in ran.err
    assert contents(repo.build) == {taken: b"mine"}
    assert results(repo, repo.folder / "fire.yaml", "--overwrite") == ["hit"]
    assert contents(repo.build) == filled


def test_a_hit_removes_what_the_earlier_build_wrote(repo: Repo, filled: dict[str, bytes]) -> None:
    recipe = repo.folder / "fire.yaml"
    repo.built(recipe, "--set", "exports=[css]")
    assert "fire.css" in contents(repo.build)
    assert results(repo, recipe) == ["hit"]
    assert contents(repo.build) == filled


def test_only_scenes_and_import_settings_are_merged_with_those_that_are_there(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hit looks for changes in outputs of these roles alone."""
    repo.clip()
    (repo.folder / "list.j2").write_text("{{ name }}", encoding="utf-8")
    recipe, read, existing = repo.recipe(**EVERYTHING), set[str](), Staging.existing

    def recorded(staging: Staging, name: str) -> bytes | None:
        read.add(name)
        return existing(staging, name)

    monkeypatch.setattr(Staging, "existing", recorded)
    outputs = repo.built(recipe)
    roles = {
        each["path"]: each["role"] for each in json.loads(outputs["fire.manifest.json"])["outputs"]
    }
    assert {roles[name] for name in read & roles.keys()} == {"import", "scene"}
    others = read - roles.keys()
    for name in others:  # looked at, but of no consequence
        (repo.build / name).write_text(f"fileFormatVersion: 2\nguid: {'7' * 32}\n", "utf-8")
    assert {**repo.built(recipe, "--force"), **outputs} == repo.built(recipe, "--force")


@pytest.mark.usefixtures("cache")
def test_what_an_engine_changed_is_kept_and_not_shared(repo: Repo, tmp_path: Path) -> None:
    repo.clip()
    recipe = repo.recipe(exports=["godot"])
    fresh = repo.built(recipe)
    settings = repo.build / "fire.png.import"
    edited = settings.read_bytes().replace(b"mipmaps/generate=false", b"mipmaps/generate=true")
    assert edited != fresh["fire.png.import"]
    settings.write_bytes(edited)
    (repo.build / "fire.png").unlink()
    ((miss, why), (stored, reason)) = events(repo, recipe)
    assert (miss, stored) == ("miss", "not stored")
    assert "fire.png.import" in why and "merged" in reason
    assert settings.read_bytes() == edited
    assert results(repo, recipe, "-o", tmp_path / "other") == ["hit"]
    assert contents(tmp_path / "other") == fresh


@pytest.mark.usefixtures("cache")
def test_an_engines_file_that_nobody_changed_is_no_obstacle(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe(exports=["godot", "unity"])
    fresh = repo.built(recipe)
    (repo.build / "fire.png").unlink()
    assert results(repo, recipe) == ["hit"]
    assert contents(repo.build) == fresh


def no_folder(tmp_path: Path) -> str:
    (tmp_path / "file").write_bytes(b"")
    return str(tmp_path / "file" / "cache")


def no_server(tmp_path: Path) -> str:
    return "http://someone:secret@127.0.0.1:9/cache?token=secret"


def no_protocol(tmp_path: Path) -> str:
    return "nowhere://bucket/cache"


@pytest.mark.parametrize("place", [no_folder, no_server, no_protocol])
def test_a_store_that_cannot_be_reached_is_noted_once(
    repo: Repo, tmp_path: Path, place: Any
) -> None:
    repo.clip()
    names = ["a.yaml", "b.yaml", "c.yaml"]
    recipes = [repo.recipe(name, flakes="none", exports=[]) for name in names]
    ran = repo.run("build", *recipes, "--cache", place(tmp_path))
    (note,) = notes(ran)
    assert "building without it" in note
    assert "secret" not in ran.err
    assert {"a.png", "b.png", "c.png"} <= set(contents(repo.build))


def test_without_fsspec_a_url_is_noted_and_a_folder_works(repo: Repo, tmp_path: Path) -> None:
    repo.clip()
    recipe = repo.recipe(flakes="none", exports=[])
    absent = "import sys; sys.modules['fsspec'] = sys.modules['fsspec.core'] = None"
    ran = run_alone(script(absent, "build", recipe, "--cache", "memory://nothing"))
    (note,) = notes(ran)
    assert "fire-atlas[cache]" in note
    for out in ("a", "b"):
        ran = run_alone(
            script(absent, "build", recipe, "--cache", tmp_path / "c", "-o", tmp_path / out, "-v")
        )
        assert ran.code == 0, ran.err
    assert "cache: hit" in ran.err


@posix
def test_a_full_disk_of_the_cache_is_noted_once(repo: Repo, cache: Path) -> None:
    repo.clip(count=8, height=160)
    recipe = repo.recipe(flakes="none")
    outputs = repo.built(recipe, "--cache", "")
    empty(repo.build)
    room = max(map(len, outputs.values()))
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room}))"
    ran = run_alone(script(limit, "build", recipe), PYTHONDONTWRITEBYTECODE="1")
    (note,) = notes(ran)
    assert "not stored" in note and str(cache) in note
    assert contents(repo.build) == outputs
    assert list(cache.iterdir()) == []


_AS_NOBODY = """
import os, sys
import fire_atlas.__main__
from fire_atlas.cli import main
main(["build", sys.argv[2], "--force", "-q", "--cache", {warm!r}, "-o", {warm!r}])
main(["build", sys.argv[2], "-q", "--cache", {warm!r}, "-o", {warm!r} + str(os.getpid())])
if os.geteuid() == 0:
    os.seteuid(65534)  # permissions do not bind root
"""


@posix
def test_a_cache_that_may_not_be_written_is_read(
    repo: Repo, filled: dict[str, bytes], cache: Path, tmp_path: Path
) -> None:
    cache.chmod(0o555)
    for folder in (tmp_path, *tmp_path.parents[:3]):
        folder.chmod(folder.stat().st_mode | 0o555)
    out = tmp_path / "out"
    out.mkdir()
    out.chmod(0o777)
    nobody = _AS_NOBODY.format(warm=str(tmp_path / "warm"))
    recipe = repo.folder / "fire.yaml"
    assert not notes(run_alone(script(nobody, "build", recipe, "-o", out)))
    assert contents(out) == filled
    (note,) = notes(run_alone(script(nobody, "build", recipe, "-o", out, "--set", "seed=1")))
    assert "not stored" in note and "ermission" in note


def test_with_a_key_only_signed_entries_are_taken(
    repo: Repo, filled: dict[str, bytes], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = repo.folder / "fire.yaml"
    monkeypatch.setenv("FIRE_ATLAS_CACHE_KEY", "ours")
    for key, why in (("ours", "not signed"), ("theirs", "another key")):
        monkeypatch.setenv("FIRE_ATLAS_CACHE_KEY", key)
        (note,) = notes(repo.run("build", recipe))
        assert why in note
        assert contents(repo.build) == filled
        empty(repo.build)
    assert results(repo, recipe) == ["hit"]
    monkeypatch.delenv("FIRE_ATLAS_CACHE_KEY")
    empty(repo.build)
    assert results(repo, recipe) == ["hit"]


def test_builds_of_one_recipe_at_once_share_one_entry(repo: Repo, cache: Path) -> None:
    """Two processes write the entry; both outputs are those of a build, and so is a third's hit."""
    repo.clip()
    recipe, outs = repo.recipe(), [repo.folder / name for name in ("a", "b")]
    running = [
        subprocess.Popen(
            command("build", recipe, "-q", "-o", out), env=environment(), stderr=subprocess.PIPE
        )
        for out in outs
    ]
    for each in running:
        _, err = each.communicate(timeout=120)
        assert (each.returncode, err) == (0, b"")
    assert results(repo, recipe, "-o", repo.folder / "c") == ["hit"]
    assert contents(outs[0]) == contents(outs[1]) == contents(repo.folder / "c")
    assert [path.suffix for path in cache.iterdir()] == [".tar"]


@pytest.fixture
def memory(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    fsspec = pytest.importorskip("fsspec")
    yield "memory://team/cache"
    fsspec.filesystem("memory").store.clear()


def test_a_store_of_fsspec_is_a_cache(repo: Repo, memory: str) -> None:
    repo.clip()
    recipe = repo.recipe()
    assert results(repo, recipe, "--cache", memory) == ["miss", "stored"]
    outputs = contents(repo.build)
    empty(repo.build)
    assert results(repo, recipe, "--cache", memory) == ["hit"]
    assert contents(repo.build) == outputs
    assert repo.run("cache", "info", memory).out.startswith("entries: 1\nbytes: ")
    assert "removed 1 of 1" in repo.run("cache", "prune", memory, "--max-size", "1K").out
    empty(repo.build)
    assert results(repo, recipe, "--cache", memory) == ["miss", "stored"]


class Web(BaseHTTPRequestHandler):
    """A web server that keeps what is PUT, if it is writable."""

    files: dict[str, bytes]
    is_writable: bool
    requests: list[str]
    pause = 0.0
    """Seconds that it takes over each chunk it receives."""

    def do_GET(self) -> None:
        self.requests.append(f"GET {self.path}")
        data = self.files.get(self.path)
        self.send_response(404 if data is None else 200)
        self.send_header("Content-Length", str(len(data or b"")))
        self.end_headers()
        self.wfile.write(data or b"")

    def do_PUT(self) -> None:
        self.requests.append(f"PUT {self.path}")
        data = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        if self.headers.get("Transfer-Encoding") == "chunked":
            while size := int(self.rfile.readline(), 16):
                data += self.rfile.read(size)
                self.rfile.readline()
                time.sleep(self.pause)
            self.rfile.readline()
        if self.is_writable:
            self.files[self.path] = data
        self.send_response(201 if self.is_writable else 405)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def web() -> Iterator[tuple[str, type[Web]]]:
    """Return the address of a running web server, and its state."""
    pytest.importorskip("aiohttp")
    state = type("State", (Web,), {"files": {}, "is_writable": True, "requests": []})
    with ThreadingHTTPServer(("127.0.0.1", 0), state) as server:
        # Else the system takes some MiB in the server's place, however slow that is.
        server.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/cache", state
        server.shutdown()
        thread.join()


@posix
def test_what_is_no_entry_is_a_miss_and_replaced(repo: Repo, filled: dict[str, bytes]) -> None:
    recipe, entry = repo.folder / "fire.yaml", entry_of(repo.folder.parent / "cache")
    others: tuple[Callable[[], object], ...] = (
        lambda: entry.mkdir(),
        lambda: os.mkfifo(entry),
        lambda: entry.symlink_to(entry),
        lambda: entry.symlink_to("/dev/zero"),
    )
    for other in others:
        entry.unlink()
        other()
        if entry.is_dir():
            (entry / "file").touch()
        empty(repo.build)
        assert "entries: 0" in repo.run("cache", "info").out
        assert results(repo, recipe) == ["miss", "stored"]
        assert entry.is_file() and not entry.is_symlink()
        empty(repo.build)
        assert results(repo, recipe) == ["hit"]
        assert contents(repo.build) == filled


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("fire.Editor.cs", "page"), ("fire.gd", "script"), ("fire.exe", "template"),
        ("fire.png.exe", "page"), ("fire-1.gd", "page"), ("fire.evil.png", "page"),
        ("fire-1.png", "import"), ("fire-1.png", "of nobody"), ("other.json", "atlas"),
    ],
)  # fmt: skip
def test_an_entry_with_a_file_that_the_recipe_does_not_write_is_a_miss(
    repo: Repo, filled: dict[str, bytes], cache: Path, name: str, role: str
) -> None:
    entry, planted = entry_of(cache), b"planted"
    manifest, outputs = taken_apart(entry)
    manifest["outputs"].append(described(name, role, planted))
    outputs[name] = planted
    forge(entry, manifest, [(header(each, len(data)), data) for each, data in outputs.items()])
    ((result, why), stored) = events(repo, repo.folder / "fire.yaml")
    assert result == "miss" and f"would not write: {name}" in why
    assert stored[0] == "stored"
    assert contents(repo.build) == filled


@pytest.mark.parametrize("lacking", [("fire.png",), ("fire.json",), "all of them"])
def test_an_entry_that_lacks_an_output_is_a_miss(
    repo: Repo, filled: dict[str, bytes], cache: Path, lacking: tuple[str, ...] | str
) -> None:
    entry = entry_of(cache)
    manifest, outputs = taken_apart(entry)
    kept = {} if lacking == "all of them" else {
        name: data for name, data in outputs.items() if name not in lacking
    }  # fmt: skip
    manifest["outputs"] = [each for each in manifest["outputs"] if each["path"] in kept]
    forge(entry, manifest, [(header(each, len(data)), data) for each, data in kept.items()])
    assert results(repo, repo.folder / "fire.yaml") == ["miss", "stored"]
    assert contents(repo.build) == filled


def test_an_entry_that_would_replace_a_file_of_the_users_is_a_miss(
    repo: Repo, filled: dict[str, bytes], cache: Path
) -> None:
    """The build writes one page. An entry with two keeps it from nothing."""
    entry, mine = entry_of(cache), repo.build / "fire-1.png"
    manifest, outputs = taken_apart(entry)
    manifest["outputs"].append(described("fire-1.png", "page", b"second"))
    outputs["fire-1.png"] = b"second"
    forge(entry, manifest, [(header(each, len(data)), data) for each, data in outputs.items()])
    mine.write_bytes(b"mine")
    assert results(repo, repo.folder / "fire.yaml") == ["miss", "stored"]
    assert contents(repo.build) == filled | {"fire-1.png": b"mine"}


def test_a_web_server_is_a_cache(repo: Repo, web: tuple[str, type[Web]]) -> None:
    address, state = web
    repo.clip()
    recipe = repo.recipe()
    first = run_alone(command("build", recipe, "--cache", address, "-v"))
    assert "cache: stored" in first.err, first.err
    outputs = contents(repo.build)
    empty(repo.build)
    state.requests.clear()
    second = run_alone(command("build", recipe, "--cache", address, "-v"))
    assert "cache: hit" in second.err, second.err
    assert contents(repo.build) == outputs
    assert len(state.requests) == 1  # one GET


def test_a_build_that_no_entry_may_hold_is_not_stored_and_others_are(
    repo: Repo, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    repo.clip()
    recipe = repo.recipe()
    with monkeypatch.context() as patch:
        patch.setattr("fire_atlas.outputs.cache.archive._MAX_MANIFEST_BYTES", 1000)
        assert results(repo, recipe) == ["miss", "not stored"]
    assert not cache.exists()
    assert results(repo, recipe, "--set", "seed=1") == ["miss", "stored"]


@pytest.mark.parametrize("answer", SILENCES.values(), ids=SILENCES)
def test_a_server_that_falls_silent_is_tried_once_and_named(
    answer: bytes, repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("aiohttp")
    monkeypatch.setattr("fire_atlas.outputs.cache.store._SILENCE", 1)
    repo.clip()
    with silent_server(answer) as url:
        began = time.monotonic()
        ran = repo.run("build", repo.recipe(), "--cache", url)
        took = time.monotonic() - began
    (note,) = notes(ran)
    assert url in note and "takes and gives nothing for 1 s" in note
    assert took < 20
    assert "fire.png" in contents(repo.build)


def test_a_server_that_takes_a_part_of_an_entry_and_no_more_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("aiohttp")
    monkeypatch.setattr("fire_atlas.outputs.cache.store._SILENCE", 1)
    with silent_server(b"") as url:
        store, began = open_store(url), time.monotonic()
        with pytest.raises(StoreError, match="takes and gives nothing"):
            store.write("0" * 64, lambda file: _write_zeros(file, 64 << 20))
    assert time.monotonic() - began < 10


def _write_zeros(file: BinaryIO, size: int) -> None:
    file.truncate(size)


def test_an_entry_that_is_sent_slowly_arrives(
    web: tuple[str, type[Web]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What takes longer than a server may be silent is no silence. At the end, the system still has
    some MiB to send, of which it tells nothing."""
    address, state = web
    monkeypatch.setattr("fire_atlas.outputs.cache.store._SILENCE", 16)
    state.pause = 0.04
    began = time.monotonic()
    open_store(f"{address}/slow").write("0" * 64, lambda file: _write_zeros(file, 32 << 20))
    assert time.monotonic() - began > 17
    assert [len(data) for data in state.files.values()] == [32 << 20]


def test_recipes_that_are_built_at_once_wait_for_a_silent_server_together(repo: Repo) -> None:
    pytest.importorskip("aiohttp")
    repo.clip()
    recipes = [repo.recipe(f"fire{i}.yaml") for i in range(4)]
    with silent_server(SILENCES["GET"]) as url:
        began = time.monotonic()
        ran = repo.run("build", *recipes, "--cache", url, "--jobs", "2")
        took = time.monotonic() - began
    (note,) = notes(ran)
    assert url in note
    assert took < 30  # of which twice 10 s would be one after the other


def test_a_web_server_that_takes_nothing_is_read(repo: Repo, web: tuple[str, type[Web]]) -> None:
    address, state = web
    repo.clip()
    recipe = repo.recipe()
    run_alone(command("build", recipe, "--cache", address))
    outputs = contents(repo.build)
    empty(repo.build)
    state.is_writable = False
    assert not notes(run_alone(command("build", recipe, "--cache", address)))
    assert contents(repo.build) == outputs
    seeds = [repo.recipe(f"{seed}.yaml", seed=seed) for seed in (1, 2)]
    (note,) = notes(run_alone(command("build", *seeds, "--cache", address)))
    assert "405" in note and "not stored" in note
    ran = run_alone(command("cache", "prune", address, "--max-size", "0"))
    assert ran.code == 1
    assert ran.err == f"error: {address}: not found, or this store cannot list what it has\n"


def test_a_web_server_that_sends_damage_is_survived(repo: Repo, web: tuple[str, type[Web]]) -> None:
    address, state = web
    repo.clip()
    recipe = repo.recipe()
    run_alone(command("build", recipe, "--cache", address))
    outputs = contents(repo.build)
    ((path, whole),) = state.files.items()
    for data in (whole[:5000], b"<html>please sign in</html>" * 1000, b""):
        state.files[path] = data
        empty(repo.build)
        ran = run_alone(command("build", recipe, "--cache", address, "-v"))
        assert ran.code == 0 and "cache: miss" in ran.err, ran.err
        assert contents(repo.build) == outputs
        assert state.files[path] == whole


def test_an_entry_of_another_recipe_under_its_name_is_a_miss(
    repo: Repo, filled: dict[str, bytes], cache: Path
) -> None:
    recipe, mine = repo.folder / "fire.yaml", entry_of(cache)
    assert results(repo, recipe, "--set", "seed=8") == ["miss", "stored"]
    (other,) = set(cache.iterdir()) - {mine}
    mine.write_bytes(other.read_bytes())
    assert results(repo, recipe) == ["miss", "stored"]
    assert contents(repo.build) == filled


def test_a_build_that_merged_or_failed_stores_nothing(repo: Repo, cache: Path) -> None:
    repo.clip()
    (repo.folder / "clip" / "0003.png").write_bytes(b"")
    assert repo.run("build", repo.recipe()).code == 1
    assert not cache.exists()


@pytest.mark.usefixtures("filled")
def test_a_cache_is_described_and_pruned(repo: Repo, cache: Path) -> None:
    recipe = repo.folder / "fire.yaml"
    for seed in (1, 2, 3):
        repo.built(recipe, "--set", f"seed={seed}")
    entries = sorted(cache.iterdir())
    for day, entry in enumerate(entries):
        os.utime(entry, (day * 86_400, day * 86_400))
    (cache / "notes.txt").write_text("mine", encoding="utf-8")
    size = sum(entry.stat().st_size for entry in entries)
    info = repo.run("cache", "info").out
    assert f"entries: 4\nbytes: {size}\noldest: 1970-01-01 00:00 UTC" in info
    assert repo.run("cache", "prune", cache, "--max-size", str(size)).out.startswith(
        "removed 0 of 4"
    )
    keep = size - entries[0].stat().st_size
    assert "removed 1 of 4" in repo.run("cache", "prune", "--max-size", str(keep)).out
    assert not entries[0].exists()
    os.utime(entries[2])
    assert "removed 2 of 3" in repo.run("cache", "prune", "--older-than", "2d").out
    assert {path.name for path in cache.iterdir()} == {entries[2].name, "notes.txt"}


@pytest.mark.usefixtures("filled")
def test_a_hit_makes_an_entry_young(repo: Repo, cache: Path) -> None:
    os.utime(entry_of(cache), (0, 0))
    assert results(repo, repo.folder / "fire.yaml") == ["hit"]
    assert "removed 0 of 1" in repo.run("cache", "prune", "--older-than", "1h").out


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["info"], 2, "FIRE_ATLAS_CACHE"),
        (["info", "nowhere"], 1, "nowhere"),
        (["prune", "nowhere"], 2, "--max-size"),
        (["info", "nowhere", "--max-size", "1G"], 2, "--max-size"),
        (["prune", "nowhere", "--max-size", "big"], 2, "500M"),
        (["prune", "nowhere", "--older-than", "old"], 2, "30d"),
    ],
)
def test_wrong_uses_of_the_command_are_advised(
    repo: Repo, arguments: list[str], code: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FIRE_ATLAS_CACHE", raising=False)
    ran = repo.run("cache", *arguments)
    assert ran.code == code
    assert words in ran.err and "Traceback" not in ran.err
