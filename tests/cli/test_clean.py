"""``clean`` removes what builds wrote, and nothing else."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from fire_atlas.cli import main

Run = Callable[..., CompletedProcess[str]]


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_what_a_build_wrote_is_removed_and_named(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    build = campfire.parent / "build"
    written = names(build)
    (build / "mine.txt").write_text("mine")
    result = run("clean", campfire.name)
    assert (result.returncode, result.stderr) == (0, "")
    assert names(build) == {"mine.txt"}
    stated = {line.split("removed ")[1] for line in result.stdout.splitlines()}
    assert stated == {str(Path("build") / name) for name in written}
    assert campfire.is_file() and len(list((campfire.parent / "clip").iterdir())) == 6


def test_outputs_of_other_recipes_stay(run: Run, campfire: Path) -> None:
    campfire.with_name("torch.yaml").write_text(campfire.read_text())
    run("build", ".", "-q")
    build = campfire.parent / "build"
    torch = {name for name in names(build) if name.startswith("torch")}
    run("clean", campfire.name, "-q")
    assert names(build) == torch != set()


def test_a_file_that_someone_changed_is_kept(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    page = campfire.parent / "build" / "campfire.png"
    page.write_bytes(b"painted over")
    result = run("clean", campfire.name)
    assert names(page.parent) == {"campfire.png"}
    assert (
        f"kept {Path('build') / 'campfire.png'}: it was changed since it was built" in result.stdout
    )


def test_a_link_is_not_followed(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    page = campfire.parent / "build" / "campfire.png"
    elsewhere = page.replace(campfire.parent / "precious.png")
    page.symlink_to(elsewhere)
    run("clean", campfire.name)
    assert elsewhere.is_file() and page.is_symlink()


@pytest.mark.parametrize("name", ["../precious.txt", "/etc/precious.txt", "a/../b", "..", "C:x"])
def test_a_manifest_that_climbs_out_of_its_folder_removes_nothing(
    run: Run, campfire: Path, name: str
) -> None:
    run("build", campfire.name, "-q")
    build = campfire.parent / "build"
    (campfire.parent / "precious.txt").write_text("precious")
    manifest = build / "campfire.manifest.json"
    document = json.loads(manifest.read_text())
    document["outputs"].append({**document["outputs"][0], "path": name})
    manifest.write_text(json.dumps(document))
    before = names(build)
    result = run("clean", campfire.name)
    assert result.returncode == 1
    assert (
        "campfire.manifest.json: is damaged and does not state what was written here"
        in result.stderr
    )
    assert names(build) == before
    assert (campfire.parent / "precious.txt").is_file()


def test_of_a_damaged_manifest_the_files_that_may_be_the_builds_are_named(
    run: Run, campfire: Path
) -> None:
    run("build", campfire.name, "-q")
    build = campfire.parent / "build"
    written = names(build)
    (build / "campfire.txt").write_text("mine")
    (build / "campfire.manifest.json").write_text("{")
    said = run("clean", campfire.name).stderr.strip()
    assert set(said.rpartition("which are called ")[2].split(", ")) == written


def test_what_was_never_built_has_nothing_to_remove(run: Run, campfire: Path) -> None:
    result = run("clean", campfire.name)
    assert result.returncode == 0
    assert "nothing to remove: there is no build" in result.stdout
    assert not (campfire.parent / "build").exists()


def test_o_and_set_name_the_build(run: Run, campfire: Path) -> None:
    options = (campfire.name, "-o", "out", "--set", "name=blaze", "-q")
    run("build", *options)
    assert (campfire.parent / "out" / "blaze.png").is_file()
    result = run("clean", *options)
    assert (result.stdout, names(campfire.parent / "out")) == ("", set())


def test_what_an_engine_wrote_on_in_goes_with_its_file(run: Run, campfire: Path) -> None:
    campfire.write_text(campfire.read_text() + "exports: [json, unity]\n")
    run("build", campfire.name, "-q")
    meta = campfire.parent / "build" / "campfire.png.meta"
    meta.write_text(meta.read_text() + "# the engine's own\n")
    assert "kept" not in run("clean", campfire.name).stdout
    assert names(meta.parent) == set()


def test_a_clean_that_was_cut_short_is_finished_by_the_next(
    campfire: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = [str(campfire), "-q", "--set", "exports=[json, godot]"]
    assert main(["build", *line]) == 0
    out = campfire.parent / "build"
    whole = {path.name: path.read_bytes() for path in out.iterdir()}
    unlink = Path.unlink
    for cut_at in range(len(whole)):
        removed = iter(range(len(whole)))

        def fail(path: Path, missing_ok: bool = False, k: Any = removed, at: int = cut_at) -> None:
            if path.suffix != ".lock" and next(k) == at:
                raise OSError(5, "Input/output error")
            unlink(path, missing_ok=missing_ok)

        for name, data in whole.items():
            (out / name).write_bytes(data)
        monkeypatch.setattr(Path, "unlink", fail)
        assert main(["clean", *line]) == 1
        monkeypatch.setattr(Path, "unlink", unlink)
        assert "campfire.manifest.json" in names(out) and len(names(out)) == len(whole) - cut_at
        assert main(["clean", *line]) == 0
        assert names(out) == set()
