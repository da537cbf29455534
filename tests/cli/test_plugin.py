"""``plugin``: an engine's add-on is copied into a project, and nothing of the user is lost."""

import sys
from pathlib import Path

import pytest

from fire_atlas import __version__
from fire_atlas.cli import main
from tests.support.repo import run_alone, script

FOLDER = Path("addons/fire_atlas")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project of Godot 4."""
    (tmp_path / "project.godot").write_text("; a game\nconfig_version=5\n")
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_add_on_is_written_and_is_then_up_to_date(
    project: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project)
    assert main(["plugin", "godot"]) == 0
    assert "files for Godot 4 to" in capsys.readouterr().out
    scripts = [path.read_text() for path in (project / FOLDER).glob("*.gd")]
    assert scripts
    assert all(text.startswith("@tool") for text in scripts)
    assert (
        f'script="{(project / FOLDER / "plugin.gd").name}"'
        in (project / FOLDER / "plugin.cfg").read_text()
    )
    assert main(["plugin", "godot", "."]) == 0
    assert "up to date" in capsys.readouterr().out


def test_what_the_user_changed_or_added_is_kept(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = project / FOLDER
    folder.mkdir(parents=True)
    (folder / "mine.gd").write_text("# mine\n")
    assert main(["plugin", "godot", str(project)]) == 0
    written = contents(folder)
    (folder / "plugin.gd").write_text("# changed\n")
    capsys.readouterr()
    assert main(["plugin", "godot", str(project)]) == 1
    error = capsys.readouterr().err
    assert "plugin.gd: was changed" in error and "--overwrite" in error
    assert contents(folder) == {**written, "plugin.gd": b"# changed\n"}
    assert main(["plugin", "godot", str(project), "--overwrite"]) == 0
    assert contents(folder) == written


def test_a_newer_version_of_the_tool_replaces_the_files_of_an_older_one(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as older:
        older.setattr("fire_atlas.engines.godot.addon.__version__", "0.0.1")
        assert main(["plugin", "godot", str(project)]) == 0
    old = contents(project / FOLDER)
    assert main(["plugin", "godot", str(project)]) == 0
    new = contents(project / FOLDER)
    assert b'version="0.0.1"' in old["plugin.cfg"]
    assert new.keys() == old.keys() and new["plugin.cfg"] != old["plugin.cfg"]


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        (None, "is no Godot project"),
        ("config_version=3\n", "states config_version=3"),
        ("config_version=4\n", "states config_version=4; the add-on is for projects of Godot 4"),
        ("[application]\n", "states no config_version"),
        (f"config_version={'5' * 5000}\n", f"states config_version={'5' * 20};"),
    ],
)
def test_what_is_no_project_of_godot_is_refused(
    text: str | None, advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if text is not None:
        (tmp_path / "project.godot").write_text(text)
    assert main(["plugin", "godot", str(tmp_path)]) == 1
    assert advice in capsys.readouterr().err
    assert not (tmp_path / "addons").exists()


@pytest.mark.parametrize("engine", ["godot", "unity"])
def test_a_link_that_leads_to_itself_is_refused_with_advice(
    engine: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link = tmp_path / "game"
    link.symlink_to(link)
    assert main(["plugin", engine, str(link)]) == 1
    error = capsys.readouterr().err
    assert str(link) in error and "folder" in error and "bug" not in error


def test_a_link_that_leads_out_of_the_project_is_refused(
    project: Path, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (project / "addons").symlink_to(elsewhere)
    assert main(["plugin", "godot", str(project)]) == 1
    assert "outside the project; remove the link" in capsys.readouterr().err
    assert not list(elsewhere.iterdir())


def test_a_folder_inside_a_project_is_told_which_one(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "art").mkdir()
    assert main(["plugin", "godot", str(project / "art")]) == 1
    assert f"did you mean fire-atlas plugin godot {project}?" in capsys.readouterr().err


def unity_project(folder: Path) -> Path:
    for name in ("Assets", "ProjectSettings"):
        (folder / name).mkdir()
    return folder


def all_files(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_of_a_package_all_folders_are_written_or_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = unity_project(tmp_path)
    assert main(["plugin", "unity", str(project)]) == 0
    written = all_files(project)
    (changed,) = project.rglob("RecipeMenu.cs")
    for file in project.rglob("*.cs"):
        file.unlink()
    changed.write_text("// mine")
    left = all_files(project)
    assert main(["plugin", "unity", str(project)]) == 1
    assert "nothing was written" in capsys.readouterr().err
    assert all_files(project) == left
    assert main(["plugin", "unity", str(project), "--overwrite"]) == 0
    assert all_files(project) == written


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("after", [2, 12, 24])
def test_a_package_that_is_interrupted_is_put_in_place_whole(tmp_path: Path, after: int) -> None:
    """It has three folders, each with a commit of its own."""
    project = unity_project(tmp_path)
    code = (
        "import os, signal\n"
        f"replace, left = os.replace, [{after}]\n"
        "def signalled(path, target, **folders):\n"
        "    replace(path, target, **folders)\n"
        "    left[0] -= 1\n"
        "    if left[0] == 0:\n"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "os.replace = signalled\n"
    )
    assert run_alone(script(code, "plugin", "unity", project)).code == 130
    interrupted = all_files(project)
    assert main(["plugin", "unity", str(project)]) == 0
    assert all_files(project) == interrupted


@pytest.mark.parametrize("engine", ["godot", "unity"])
def test_a_newer_add_on_stays_unless_it_is_overwritten(
    engine: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    project = unity_project(tmp_path)
    (project / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", engine, str(project)]) == 0
    for manifest in project.rglob("*.manifest.json"):
        text = manifest.read_text().replace(f"fire-atlas {__version__}", "fire-atlas 99.1.0")
        manifest.write_text(text)
    newer = all_files(project)
    assert main(["plugin", engine, str(project)]) == 1
    error = capsys.readouterr().err
    assert "holds the add-on of fire-atlas 99.1.0, which is newer" in error
    assert all_files(project) == newer
    assert main(["plugin", engine, str(project), "--overwrite"]) == 0
    assert all_files(project) != newer
