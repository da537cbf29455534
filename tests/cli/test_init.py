"""``init``: ready recipes, with their input."""

import os
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import BinaryIO

import pytest
import yaml
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.errors import OutputError
from fire_atlas.core.shipped import shipped
from fire_atlas.outputs.staging import Staging
from fire_atlas.recipe import inherit
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.tree import read_tree
from tests.support import synthetic_fire as fire
from tests.support.repo import command, run_alone, script, tracks_of

RECIPE = (
    "# yaml-language-server: $schema=x\n# Torch: burns.\nsource:\n  path: {}   # why\nseed: 3\n"
)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder of our own."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work"


@pytest.fixture
def presets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Ship a recipe of a folder, one of a file, one that inherits."""
    for folder in ("recipes", "samples/clip"):
        (tmp_path / "shipped" / folder).mkdir(parents=True)
    samples = tmp_path / "shipped" / "samples"
    for path in (samples / "clip" / "0.png", samples / "clip" / "1.png", samples / "torch.gif"):
        path.write_bytes(path.name.encode())
    recipes = tmp_path / "shipped" / "recipes"
    (recipes / "clip.yaml").write_text(RECIPE.format("../samples/clip"))
    (recipes / "torch.yaml").write_text(RECIPE.format('"../samples/torch.gif"'))
    (recipes / "child.yaml").write_text("# Child: inherits.\nextends: torch\n")
    monkeypatch.setattr(inherit, "shipped", lambda kind: tmp_path / "shipped" / kind)
    return recipes


def test_without_a_name_the_presets_are_listed(
    presets: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init"]) == 0
    assert capsys.readouterr().out == (
        "child  Child: inherits.\nclip   Torch: burns.\ntorch  Torch: burns.\n"
    )


def test_a_recipe_is_copied_with_its_folder_of_frames(
    presets: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "clip"]) == 0
    assert capsys.readouterr().out == (
        "wrote clip.yaml and 2 files of input\nnext: fire-atlas build clip.yaml\n"
    )
    text = (elsewhere / "clip.yaml").read_text()
    assert text == RECIPE.format("../samples/clip").replace("../samples/clip ", "samples/clip    ")
    assert (elsewhere / "samples" / "clip" / "1.png").read_bytes() == b"1.png"


def test_a_recipe_is_copied_with_its_file_into_a_new_folder(
    presets: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "torch", "game/fx"]) == 0
    assert "torch.yaml and 1 file of input\n" in capsys.readouterr().out
    loaded = load_tree(read_tree(elsewhere / "game" / "fx" / "torch.yaml"))
    (sample,) = loaded.source_files.values()
    assert sample == elsewhere / "game" / "fx" / "samples" / "torch.gif"
    assert sample.read_bytes() == b"torch.gif"


def test_a_recipe_that_inherits_its_source_goes_on_inheriting_it(
    presets: Path, elsewhere: Path
) -> None:
    assert main(["init", "child"]) == 0
    (sample,) = load_tree(read_tree(elsewhere / "child.yaml")).source_files.values()
    assert sample == presets.parent / "samples" / "torch.gif"


def test_what_is_there_already_is_never_overwritten(
    presets: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "clip"]) == 0
    assert main(["init", "clip"]) == 0
    (elsewhere / "samples" / "clip" / "1.png").write_bytes(b"mine")
    (elsewhere / "clip.yaml").unlink()
    assert main(["init", "clip"]) == 1
    assert "1.png: exists already and differs" in capsys.readouterr().err
    assert not (elsewhere / "clip.yaml").exists()


def test_a_misspelt_preset_is_guessed(presets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "troch"]) == 2
    assert capsys.readouterr().err == "error: there is no preset troch; did you mean torch?\n"


def test_the_paper_is_not_listed_and_advice_says_which_keys_it_is(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert "campfire" in listed and "paper" not in listed
    assert main(["init", "paper"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: there is no preset paper; write `features: {preset: paper}` and")
    assert not list(elsewhere.iterdir())


@pytest.mark.parametrize("preset", sorted(p.stem for p in shipped("recipes").glob("*.yaml")))
def test_every_preset_that_ships_can_be_copied_and_checked(preset: str) -> None:
    assert main(["init", preset]) == 0
    assert main(["check", f"{preset}.yaml"]) == 0


def test_an_init_that_fails_leaves_nothing_and_the_next_one_works(
    presets: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = os.replace
    for cut_at in range(3):  # two frames, then the recipe
        count = iter(range(9))

        def fail(
            path: str, to: str, at: int = cut_at, count: Iterator[int] = count, **folders: int
        ) -> None:
            if next(count) == at:
                raise OSError(28, "No space left on device")
            replace(path, to, **folders)

        folder = elsewhere / str(cut_at)
        monkeypatch.setattr(os, "replace", fail)
        assert main(["init", "clip", str(folder)]) == 1
        monkeypatch.undo()
        monkeypatch.chdir(elsewhere)
        monkeypatch.setattr(inherit, "shipped", lambda kind: presets.parent / kind)
        assert [path for path in folder.rglob("*") if path.is_file()] == []
        assert main(["init", "clip", str(folder)]) == 0
        made = {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        assert made.keys() == {"clip.yaml", "0.png", "1.png"}
        assert made["1.png"] == b"1.png"


_SIGNALLED_AT = """
import os, signal
replace, left = os.replace, [{after}]
def signalled(path, target, **folders):
    replace(path, target, **folders)
    left[0] -= 1
    if left[0] == 0:
        os.kill(os.getpid(), signal.{name})
os.replace = signalled
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("after", [1, 20, 50, 51])
@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM"])
def test_an_init_that_is_ended_anywhere_is_whole_after_the_next(
    tmp_path: Path, name: str, after: int
) -> None:
    """In its commits: the folder with 48 samples has one of its own."""
    code = _SIGNALLED_AT.format(name=name, after=after)
    ran = run_alone(script(code, "init", "campfire", tmp_path / "it"))
    files = {path.name for path in (tmp_path / "it").rglob("*") if path.is_file()}
    if name == "SIGTERM":
        assert ran.code == 130 and len(files) == 49, "all, and no hidden ones"
    assert run_alone(command("init", "campfire", tmp_path / "it")).code == 0
    files = {path.name for path in (tmp_path / "it").rglob("*") if path.is_file()}
    assert files == {"campfire.yaml", *(f"{i:04}.png" for i in range(48))}


def test_on_a_disk_that_is_full_nothing_is_written(
    presets: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Staging.open

    def full(self: Staging, name: str) -> AbstractContextManager[BinaryIO]:
        if name == "1.png":
            raise OutputError(f"{self.out / name}: cannot be written (No space left on device)")
        return opened(self, name)

    monkeypatch.setattr(Staging, "open", full)
    assert main(["init", "clip"]) == 1
    assert list(elsewhere.iterdir()) == []
    monkeypatch.setattr(Staging, "open", opened)
    assert main(["init", "clip"]) == 0
    assert (elsewhere / "clip.yaml").is_file()


def _clip(kind: str, folder: Path) -> str:
    """Write a clip of a burning flame in a form that users have; return what they name."""
    pictures = fire.fires(12)
    if kind == "video":
        fire.write_video(folder / "fire.mp4", pictures, "libx264", "yuv420p", {"crf": "5"}, rate=12)
        return "fire.mp4"
    (folder / "my fire").mkdir()
    for i, picture in enumerate(pictures):
        Image.fromarray(picture).save(folder / "my fire" / f"{i:04}.png")
    return {"folder": "my fire", "frame": "my fire/0003.png", "glob": "my fire/*.png"}[kind]


def born_in(folder: Path, name: str) -> set[int]:
    """Return the numbers of all flakes of a build."""
    frames = tracks_of(folder, name)["frames"]
    return {int(flake[0]) for frame in frames for flake in frame["rows"]}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["video", "folder", "frame", "glob"])
def test_the_recipe_for_an_own_clip_builds_what_its_path_alone_would(
    kind: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _clip(kind, elsewhere)
    assert main(["init", path, "game"]) == 0
    said = capsys.readouterr().out
    name = "fire" if kind == "video" else "my_fire"
    assert f"next: fire-atlas build game/{name}.yaml\n" in said
    assert f"{path}: 12 frames of " in said and f"{path}: class: " in said
    made = elsewhere / "game" / f"{name}.yaml"
    keys = yaml.safe_load(made.read_text())
    assert keys["source"].keys() == {"path", "height", *([] if kind == "video" else ["fps"])}
    assert (keys["timeline"], keys["exports"]) == ({"loop": "auto"}, ["json"])
    alone = elsewhere / "game" / f"{name}.alone.yaml"
    alone.write_text(yaml.safe_dump({"name": name, "source": {"path": keys["source"]["path"]}}))
    outputs = []
    for recipe in (made, alone):
        out = str(elsewhere / recipe.stem)
        assert main(["build", str(recipe), "-q", "--set", "flakes=none", "-o", out]) == 0
        outputs.append({file.name: file.read_bytes() for file in Path(out).glob("*.[pj]*")})
    made_files, alone_files = outputs
    assert len(made_files) == 3
    assert {n for n in made_files if made_files[n] != alone_files[n]} == {f"{name}.manifest.json"}
    for recipe in (made, alone):
        assert (
            main(["build", str(recipe), "-q", "--force", "-o", str(elsewhere / recipe.stem)]) == 0
        )
    born = [len(born_in(elsewhere / recipe.stem, name)) for recipe in (made, alone)]
    assert born[0] > 3 and born[0] == pytest.approx(born[1], rel=0.05, abs=1)


def test_a_folder_of_pictures_of_many_sizes_gets_a_recipe_for_sprites(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for i, name in enumerate(["hud/close", "hud/open", "coin_1", "coin_2"]):
        path = elsewhere / "icons" / f"{name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGBA", (8 + i, 8), "red").save(path)
    assert main(["init", "icons", "--limit-pixels", "60"]) == 1
    assert "coin_1.png: 10x8 is too large" in capsys.readouterr().err
    assert main(["init", "icons"]) == 0
    said = capsys.readouterr().out
    assert "icons: 4 sprites; animations: coin, 2 frames\n" in said
    assert main(["build", "icons.yaml", "-q"]) == 0
    made = {path.name: path.read_bytes() for path in (elsewhere / "build").iterdir()}
    (elsewhere / "icons.yaml").write_text("source: {kind: sprites, path: icons}")
    assert main(["build", "icons.yaml", "-q"]) == 0
    for name in ("icons.png", "icons.json"):
        assert (elsewhere / "build" / name).read_bytes() == made[name]


def test_a_path_is_told_from_a_preset(
    presets: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (elsewhere / "clip").mkdir()
    assert main(["init", "clip"]) == 0  # the preset, though there is a folder of that name
    assert (elsewhere / "samples" / "clip").is_dir()
    for subject, code, message in [
        ("./clip", 1, "clip: holds nothing; sprites end in .png"),
        ("fire.mp4", 1, "fire.mp4: does not exist"),
        ("clip.yaml", 2, "clip.yaml: is a recipe already; fire-atlas build clip.yaml builds it"),
    ]:
        assert main(["init", subject]) == code
        assert message in capsys.readouterr().err
    Image.new("RGB", (64, 64)).save(elsewhere / "other.png")
    assert main(["init", "other.png"]) == 0
    (elsewhere / "other.yaml").write_text("mine")
    assert main(["init", "other.png"]) == 1
    assert "other.yaml: exists already and differs" in capsys.readouterr().err
    assert (elsewhere / "other.yaml").read_text() == "mine"


@pytest.mark.parametrize(
    ("subject", "advice"),
    [
        (
            "fire.gif",
            "fire.gif: is no recipe; if it is a clip or a picture, fire-atlas init fire.g",
        ),
        ("0000.png", "0000.png: is no recipe; if it is a clip or a picture, fire-atlas init 0000"),
        ("frames", "if it holds frames, fire-atlas init frames writes a recipe for them"),
        ("campfre", "no such recipe file; did you mean fire-atlas init campfire?"),
    ],
)
def test_build_says_what_to_type_instead(
    subject: str, advice: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (elsewhere / "frames").mkdir()
    if "." in subject:
        Image.new("RGB", (8, 8)).save(elsewhere / subject)
    assert main(["build", subject]) == 2
    assert advice in capsys.readouterr().err
