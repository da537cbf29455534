"""What is no regular file is refused at once, wherever a command reads a file it was given."""

import json
import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core import files
from tests.support.repo import Ran, Repo

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices of POSIX"),
    pytest.mark.timeout(30),
]


def pipe(path: Path) -> None:
    os.mkfifo(path)


def link_to_a_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


def link_to_zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


def bound_socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # the name of a socket has little room
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path.name)
    os.chdir(here)


def folder(path: Path) -> None:
    path.mkdir()


KINDS = [pipe, link_to_a_pipe, link_to_zeros, bound_socket, folder]


def source(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "clip.mp4")
    return repo.run("build", repo.recipe(path="clip.mp4"))


def frame(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.clip() / "0002b.png")
    return repo.run("build", repo.recipe())


def profile(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "fire.profile.json")
    fire = {"kind": "profile", "path": "fire.profile.json"}
    return repo.run("build", repo.recipe(source=fire))


def texture(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "fire.gif")
    return repo.run("build", repo.recipe(source={"kind": "silk", "texture": {"path": "fire.gif"}}))


def recipe(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "fire.yaml")
    return repo.run("check", repo.folder / "fire.yaml")


def member(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "fire.yaml")
    repo.clip()
    return repo.run("build", repo.recipe("host.yaml", atlas={"members": ["fire.yaml"]}))


def base(repo: Repo, put: Callable[[Path], None]) -> Ran:
    put(repo.folder / "fire.yaml")
    (repo.folder / "over.yaml").write_text("extends: ./fire.yaml\n", encoding="utf-8")
    return repo.run("build", repo.folder / "over.yaml")


def template(repo: Repo, put: Callable[[Path], None]) -> Ran:
    repo.clip()
    put(repo.folder / "list.j2")
    exports = [{"template": "list.j2", "to": "{{ name }}.txt"}]
    return repo.run("build", repo.recipe(exports=exports))


def instead_of(name: str, command: str) -> Callable[[Repo, Callable[[Path], None]], Ran]:
    """Return a scene in which something else lies where a built file was."""

    def scene(repo: Repo, put: Callable[[Path], None]) -> Ran:
        repo.clip()
        repo.built(repo.recipe(maps={"motion": "godot"}))
        (repo.build / name).unlink()
        put(repo.build / name)
        return repo.run(command, repo.build / "fire.json")

    return scene


SCENES = {
    "source": source, "frame": frame, "profile": profile, "texture": texture, "recipe": recipe,
    "member": member, "base": base, "template": template,
    "atlas": instead_of("fire.json", "inspect"), "page": instead_of("fire.png", "preview"),
    "tracks": instead_of("fire.flakes.json", "inspect"),
    "tracks of a page": instead_of("fire.flakes.json", "preview"),
    "manifest": instead_of("fire.manifest.json", "inspect"),
}  # fmt: skip


@pytest.mark.parametrize("put", KINDS)
@pytest.mark.parametrize("scene", SCENES.values(), ids=list(SCENES))
def test_what_is_no_regular_file_is_refused_with_its_name(
    repo: Repo,
    scene: Callable[[Repo, Callable[[Path], None]], Ran],
    put: Callable[[Path], None],
) -> None:
    ran = scene(repo, put)
    assert ran.code in (1, 2), ran
    message = ran.err[ran.err.index("error: ") :]
    assert "bug in fire-atlas" not in message
    assert str(repo.folder) in message or "/dev/zero" in message  # links are resolved


@pytest.mark.parametrize("put", [pipe, link_to_zeros])
def test_a_manifest_that_is_no_regular_file_vouches_for_nothing(
    repo: Repo, recipe: Path, put: Callable[[Path], None]
) -> None:
    manifest = repo.build / "fire.manifest.json"
    manifest.unlink()
    put(manifest)
    assert not repo.run("build", recipe, "--dry-run").is_up_to_date


def test_an_input_that_became_a_pipe_is_not_up_to_date(repo: Repo) -> None:
    repo.clip()
    exports = [{"template": "list.j2", "to": "{{ name }}.txt"}]
    (repo.folder / "list.j2").write_text("{{ name }}", encoding="utf-8")
    recipe = repo.recipe(exports=exports)
    repo.built(recipe)
    (repo.folder / "list.j2").unlink()
    os.mkfifo(repo.folder / "list.j2")
    ran = repo.run("build", recipe, "--dry-run")
    assert ran.code == 2 and "list.j2: the template cannot be read (is a named pipe" in ran.err


def test_a_file_beyond_its_bound_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "big.json"
    with path.open("wb") as file:
        file.truncate(files.MIB + 1)  # sparse: takes no room
    assert len(files.read_file(path, files.MIB + 1)) == files.MIB + 1
    with pytest.raises(OSError, match="larger than 1 MiB"):
        files.read_file(path, files.MIB)


def test_an_atlas_that_is_too_large_is_refused(repo: Repo) -> None:
    repo.folder.joinpath("huge.json").write_text(json.dumps({}), encoding="utf-8")
    with (repo.folder / "huge.json").open("r+b") as file:
        file.truncate(files.MAX_JSON_BYTES + 1)
    ran = repo.run("inspect", repo.folder / "huge.json")
    assert ran.code == 2 and "larger than 64 MiB" in ran.err
