"""A build does what has to be done, and nothing else."""

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.generators.profile.fire import learn_profile
from fire_atlas.generators.profile.model import Profile
from fire_atlas.outputs import ownership
from fire_atlas.outputs.locks import locked, recipe_lock
from fire_atlas.sources.registry import open_source
from tests.support.repo import Repo, command, contents, environment


def stamps(folder: Path) -> dict[str, int]:
    """Return when each file was last written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}


def assert_builds_once(repo: Repo, recipe: Path, *arguments: str) -> None:
    """Check that the next build does something, and the one after it nothing."""
    before = stamps(repo.build)
    first = repo.run("build", recipe, *arguments)
    assert first.code == 0 and not first.is_up_to_date, first
    after = stamps(repo.build)
    assert after != before
    second = repo.run("build", recipe, *arguments)
    assert second.is_up_to_date and stamps(repo.build) == after


def test_a_second_build_does_nothing_and_says_so(repo: Repo, recipe: Path) -> None:
    before = stamps(repo.build)
    ran = repo.run("build", recipe)
    assert (ran.code, ran.is_up_to_date) == (0, True)
    assert stamps(repo.build) == before
    events = repo.run("build", recipe, "--json").out.splitlines()
    assert [json.loads(line)["event"] for line in events] == ["done"]
    assert json.loads(events[0])["fresh"] is True


def test_a_changed_value_of_the_recipe_rebuilds(repo: Repo, recipe: Path) -> None:
    repo.recipe(seed=5)
    assert_builds_once(repo, recipe)


def test_a_value_set_on_the_command_line_rebuilds(repo: Repo, recipe: Path) -> None:
    assert_builds_once(repo, recipe, "--set", "seed=5")
    assert_builds_once(repo, recipe)


def test_a_changed_base_recipe_rebuilds(repo: Repo, recipe: Path) -> None:
    base = repo.recipe("base.yaml")
    (repo.folder / "fire.yaml").write_text("extends: base.yaml\n", encoding="utf-8")
    repo.run("build", recipe)
    repo.recipe(base.name, seed=9)
    assert_builds_once(repo, recipe)


def test_changed_bytes_of_an_input_rebuild(repo: Repo, recipe: Path) -> None:
    shutil.copy(repo.folder / "clip" / "0000.png", repo.folder / "clip" / "0003.png")
    assert_builds_once(repo, recipe)


@pytest.mark.parametrize("name", ["0006.png", "0002b.png"])
def test_another_input_in_the_folder_rebuilds(repo: Repo, recipe: Path, name: str) -> None:
    shutil.copy(repo.folder / "clip" / "0000.png", repo.folder / "clip" / name)
    assert_builds_once(repo, recipe)


def test_a_removed_input_rebuilds(repo: Repo, recipe: Path) -> None:
    (repo.folder / "clip" / "0002.png").unlink()
    assert_builds_once(repo, recipe)


def test_renamed_inputs_in_another_order_rebuild(repo: Repo, recipe: Path) -> None:
    (repo.folder / "clip" / "0000.png").rename(repo.folder / "clip" / "0009.png")
    assert_builds_once(repo, recipe)


@pytest.mark.parametrize("output", ["fire.png", "fire.json", "fire.flakes.json"])
def test_a_removed_output_rebuilds(repo: Repo, recipe: Path, output: str) -> None:
    before = contents(repo.build)
    (repo.build / output).unlink()
    assert_builds_once(repo, recipe)
    assert contents(repo.build) == before


def test_an_output_that_somebody_edited_is_built_anew_only_when_forced(
    repo: Repo, recipe: Path
) -> None:
    before = contents(repo.build)
    page = repo.build / "fire.png"
    page.write_bytes(before["fire.png"][:-1] + b"!")  # same size
    edited = contents(repo.build)
    ran = repo.run("build", recipe)
    assert ran.code == 1 and contents(repo.build) == edited
    assert "fire.png: was changed since it was built" in ran.err and "--overwrite" in ran.err
    assert_builds_once(repo, recipe, "--overwrite")
    assert contents(repo.build) == before


def test_force_rebuilds_to_the_same_bytes(repo: Repo, recipe: Path) -> None:
    before, times = contents(repo.build), stamps(repo.build)
    ran = repo.run("build", recipe, "--force")
    assert not ran.is_up_to_date
    assert contents(repo.build) == before
    assert all(stamps(repo.build)[name] > times[name] for name in times)


def test_comments_touched_files_and_strangers_do_not_rebuild(repo: Repo, recipe: Path) -> None:
    recipe.write_text("# brighter days\n" + recipe.read_text(encoding="utf-8"), encoding="utf-8")
    os.utime(repo.folder / "clip" / "0001.png", (1, 1))
    (repo.folder / "clip" / "notes.txt").write_text("not a frame", encoding="utf-8")
    (repo.build / "mine.png").write_text("not an output", encoding="utf-8")
    assert repo.run("build", recipe).is_up_to_date


def test_an_input_that_changes_during_the_build_is_noticed_afterwards(
    repo: Repo, recipe: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An artist saves while a build runs: the pages may show either picture."""
    frame = repo.folder / "clip" / "0005.png"

    def saved_meanwhile(*arguments: Any, **options: Any) -> FlameStudy:
        shutil.copy(repo.folder / "clip" / "0000.png", frame)
        return study_flame(*arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr("fire_atlas.pipeline.animation.prepare.study_flame", saved_meanwhile)
        assert repo.run("build", recipe, "--force").code == 0
    assert_builds_once(repo, recipe)


def test_an_input_that_was_another_while_it_was_read_is_not_called_fresh(
    repo: Repo, recipe: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pages may show what was there for a moment, though all is now as it was hashed."""
    frame = repo.folder / "clip" / "0005.png"
    sound = frame.read_bytes()

    def another_for_a_while(*arguments: Any, **options: Any) -> FlameStudy:
        shutil.copy(repo.folder / "clip" / "0000.png", frame)
        study = study_flame(*arguments, **options)
        frame.write_bytes(sound)
        return study

    with monkeypatch.context() as patch:
        patch.setattr("fire_atlas.pipeline.animation.prepare.study_flame", another_for_a_while)
        ran = repo.run("build", recipe, "--force")
    assert ran.code == 0 and f"{frame}: changed while it was read; build again" in ran.err
    assert_builds_once(repo, recipe)


@pytest.mark.slow
def test_a_clip_that_changes_while_it_is_learnt_from_is_not_called_fresh(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = repo.clip(count=10)
    source = {"kind": "profile", "path": "clip", "slices": 2, "particles": 8, "height": 32}
    recipe = repo.recipe(source=source, timeline={"frames": 4}, flakes="none", motion_blur="none")

    def saved_meanwhile(*arguments: Any) -> Profile:
        profile = learn_profile(*arguments)
        shutil.copy(clip / "0000.png", clip / "0005.png")
        return profile

    with monkeypatch.context() as patch:
        patch.setattr("fire_atlas.sources.profile.learn_profile", saved_meanwhile)
        assert repo.run("build", recipe).code == 0
    assert_builds_once(repo, recipe)


def test_a_frame_that_was_there_only_while_frames_were_listed_is_reported(
    repo: Repo, recipe: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = repo.folder / "clip" / "0006.png"

    def one_more(*arguments: Any) -> Any:
        shutil.copy(repo.folder / "clip" / "0000.png", frame)
        opened = open_source(*arguments)
        frame.unlink()
        return opened

    before = contents(repo.build)
    monkeypatch.setattr("fire_atlas.pipeline.input.open.open_source", one_more)
    ran = repo.run("build", recipe, "--force")
    assert ran.code == 1 and str(frame) in ran.err
    assert contents(repo.build) == before


def test_files_that_are_no_longer_written_are_removed(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe()
    many = repo.built(recipe, "--set", "atlas.max_size=100", "--set", "tracks=[json, csv]")
    assert {"fire-1.png", "fire-1.json", "fire.flakes.csv"} <= many.keys()
    assert sorted(repo.built(recipe)) == [
        "fire.flakes.json", "fire.json", "fire.manifest.json", "fire.png",
    ]  # fmt: skip


def test_what_a_person_edited_or_made_is_never_removed(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe()
    repo.built(recipe, "--set", "atlas.max_size=100")
    (repo.build / "fire-1.png").write_bytes(b"painted over")
    (repo.build / "fire-7.png").write_bytes(b"painted")
    (repo.build / "fire.txt").write_bytes(b"notes")
    after = repo.built(recipe)
    assert (after["fire-1.png"], after["fire-7.png"]) == (b"painted over", b"painted")
    assert after["fire.txt"] == b"notes"
    assert "fire-1.json" not in after


def contents_of_files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def entry(path: str, data: bytes) -> dict[str, object]:
    return {
        "path": path,
        "role": "page",
        "bytes": len(data),
        "sha256": hashlib.sha256(data).hexdigest(),
    }


@pytest.mark.parametrize("path", ["../mine.png", "sub/../mine.png", "..", "", "C:mine.png", "a\\b"])
def test_a_manifest_that_climbs_out_of_its_folder_removes_nothing(
    repo: Repo, recipe: Path, path: str
) -> None:
    mine = [repo.folder / "mine.png", repo.build / "sub" / "mine.png"]
    mine[1].parent.mkdir()
    for file in mine:
        file.write_bytes(b"mine")
    manifest = repo.build / "fire.manifest.json"
    document = json.loads(manifest.read_text(encoding="utf-8"))
    document["outputs"].append(entry(path, b"mine"))
    manifest.write_text(json.dumps(document), encoding="utf-8")
    before = contents_of_files(repo.build)
    ran = repo.run("build", recipe)
    assert ran.code == 1 and "fire.manifest.json: is not a valid manifest" in ran.err
    assert contents_of_files(repo.build) == before
    ran = repo.run("build", recipe, "--overwrite")
    assert ran.code == 0 and not ran.is_up_to_date
    assert all(file.read_bytes() == b"mine" for file in mine)
    assert path not in [out["path"] for out in json.loads(manifest.read_bytes())["outputs"]]


def test_a_manifest_that_names_an_absolute_path_removes_nothing(repo: Repo, recipe: Path) -> None:
    mine = repo.folder / "mine.png"
    mine.write_bytes(b"mine")
    manifest = repo.build / "fire.manifest.json"
    document = json.loads(manifest.read_text(encoding="utf-8"))
    document["outputs"] = [entry(str(mine), b"mine")]
    manifest.write_text(json.dumps(document), encoding="utf-8")
    assert repo.run("build", recipe, "--overwrite").code == 0
    assert mine.exists()


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "null", "7", '"text"', "{}", "[" * 100_000, "\ufeff{}", "\x00",
        '{"format": "fire-atlas/manifest"}',
        '{"format": "fire-atlas/manifest", "version": 2, "outputs": []}',
        '{"format": "fire-atlas/manifest", "version": 1, "outputs": 3}',
        '{"format": "fire-atlas/manifest", "version": 1, "outputs": [7]}',
        '{"format": "fire-atlas/manifest", "version": 1, "outputs": [{"path": 7}]}',
        '{"format": "fire-atlas/manifest", "version": 1, "outputs": [{"path": "fire.png"}]}',
        '{"format": "fire-atlas/manifest", "version": 1, "asked": 1, "made_by": 2, "inputs": [{}]}',
    ],
)  # fmt: skip
def test_a_broken_manifest_vouches_for_nothing_and_is_replaced_when_forced(
    repo: Repo, recipe: Path, text: str
) -> None:
    manifest = repo.build / "fire.manifest.json"
    sound = manifest.read_bytes()
    manifest.write_bytes(text.encode())
    ran = repo.run("build", recipe)
    assert ran.code == 1 and "fire.manifest.json: is not a valid manifest" in ran.err
    assert manifest.read_bytes() == text.encode()
    ran = repo.run("build", recipe, "--overwrite")
    assert (ran.code, ran.is_up_to_date) == (0, False), ran.err
    assert manifest.read_bytes() == sound


def test_two_recipes_share_a_folder_without_touching_each_other(repo: Repo) -> None:
    repo.clip()
    fire = repo.built(repo.recipe("fire.yaml"))
    both = repo.built(repo.recipe("torch.yaml", seed=2))
    assert both.keys() - fire.keys() == {name.replace("fire", "torch") for name in fire}
    assert fire.items() <= both.items()
    assert repo.run("build", repo.folder).out.count("yaml: up to date") == 2


def test_a_build_of_its_own_files_reads_no_manifest_of_another(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or n recipes of a folder would read n² manifests."""
    read: list[str] = []
    monkeypatch.setattr(ownership, "_manifest_of_another", lambda _, name: read.append(name))
    repo.clip()
    fire = repo.recipe("fire.yaml")
    repo.built(fire)
    repo.built(repo.recipe("torch.yaml"))
    assert repo.run("build", "--force", fire).code == 0
    assert read == []
    (repo.build / "new.png").write_bytes(b"somebody's")
    assert repo.run("build", repo.recipe("new.yaml")).code == 1
    assert set(read) == {"fire", "torch"}


def test_what_another_build_wrote_is_never_written_over(repo: Repo) -> None:
    """Pages of ``fire`` may be called as those of ``fire-1``."""
    repo.clip()
    many = ("--set", "atlas.max_size=100")
    taken = repo.built(repo.recipe("fire-1.yaml"))
    ran = repo.run("build", repo.recipe(), *many)
    assert ran.code == 1
    assert "fire-1.json: belongs to the build of fire-1; choose another `name`" in ran.err
    assert {name: (repo.build / name).read_bytes() for name in taken} == taken
    assert not (repo.build / "fire.png").exists()
    repo.run("clean", repo.folder / "fire-1.yaml")
    assert repo.run("build", repo.recipe(), *many).code == 0


@pytest.mark.slow
@pytest.mark.parametrize("force", [(), ("--force",)])
def test_a_build_that_waited_for_another_of_the_same_finds_it_done(
    repo: Repo, force: tuple[str, ...]
) -> None:
    repo.clip()
    recipe = repo.recipe()
    whole = repo.built(recipe)
    for name in whole:
        (repo.build / name).unlink()
    with locked(recipe_lock(repo.build, "fire"), print):
        line = command("build", recipe, *force)
        process = subprocess.Popen(
            line, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert process.stderr is not None and "waits for" in process.stderr.readline()
        for name, data in whole.items():
            (repo.build / name).write_bytes(data)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0 and ("up to date" in out) is not bool(force)
    assert contents(repo.build) == whole
