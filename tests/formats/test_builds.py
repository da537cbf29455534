"""Atlas options in whole builds: files, freshness, and the same bytes from any order."""

import json
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.cut_frames import cut_frames


def repo(folder: Path, count: int = 7, shuffle: int = 0) -> Path:
    """A folder of frames, put there in some order."""
    (folder / "clip").mkdir(parents=True)
    frames = sorted((shipped("samples") / "campfire").glob("*.png"))[:count]
    for path in random.Random(shuffle).sample(frames, count):
        with Image.open(path) as image:
            image.convert("RGBA").resize((64, 80)).save(folder / "clip" / path.name)
    return folder


def build(folder: Path, capsys: pytest.CaptureFixture[str], **keys: Any) -> str:
    """Build a recipe that only packs, and return what was said."""
    plain = {"source": {"path": "clip"}, "flakes": "none", "motion_blur": "none", "tracks": []}
    (folder / "fire.yaml").write_text(json.dumps({**plain, **keys}), encoding="utf-8")
    code = main(["build", str(folder / "fire.yaml")])
    said = capsys.readouterr()
    assert code == 0, said.err
    return said.out + said.err


def outputs(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "build").iterdir())}


@pytest.mark.parametrize("atlas", [{}, {"max_size": 128}, {"rotate": True, "scales": [1, 0.5]}])
def test_the_order_of_files_on_disk_changes_no_byte(
    atlas: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = []
    for shuffle in (0, 1):
        folder = repo(tmp_path / str(shuffle), shuffle=shuffle)
        build(folder, capsys, atlas=atlas)
        made.append(outputs(folder))
    assert made[0] == made[1]


def test_every_scale_has_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = repo(tmp_path / "a")
    build(folder, capsys, atlas={"scales": [1, 0.5]}, exports=["json", "phaser"])
    assert list(outputs(folder)) == [
        "fire.json", "fire.manifest.json", "fire.phaser.json", "fire.png",
        "fire@0.5x.json", "fire@0.5x.phaser.json", "fire@0.5x.png",
    ]  # fmt: skip


@pytest.mark.parametrize("image_format", ["png", "webp"])
@pytest.mark.parametrize("compression", ["fast", "small"])
def test_a_built_atlas_reads_back(
    image_format: str, compression: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if compression == "small":
        pytest.importorskip("oxipng", reason="needs the extra `small`")
    folder = repo(tmp_path / "a")
    atlas = {"format": image_format, "compression": compression, "rotate": True, "extrude": 2}
    build(folder, capsys, atlas=atlas)
    for path, frame in zip(
        sorted((folder / "clip").iterdir()),
        cut_frames(read_atlas(folder / "build/fire.json")),
        strict=True,
    ):
        with Image.open(path) as image:
            original = np.asarray(image.convert("RGBA"))
        np.testing.assert_array_equal(frame, np.where(original[..., 3:] > 0, original, 0))


def test_a_changed_template_is_built_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    exports = ["json", {"template": "mine.j2", "to": "{{ name }}.txt"}]
    for text in ("one", "two"):
        (folder / "mine.j2").write_text(text)
        said = build(folder, capsys, exports=exports)
        assert "up to date" not in said
        assert outputs(folder)["fire.txt"] == text.encode()
        assert "up to date" in build(folder, capsys, exports=exports)


def test_a_template_belongs_to_the_recipe_that_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    (folder / "shared").mkdir()
    (folder / "shared/mine.j2").write_text("{{ frames | length }}")
    (folder / "shared/base.yaml").write_text('exports: [{template: mine.j2, to: "n.txt"}]\n')
    build(folder, capsys, extends="./shared/base.yaml")
    assert outputs(folder)["n.txt"] == b"7"
    assert main(["check", "--resolved", str(folder / "fire.yaml")]) == 0
    assert "shared/mine.j2" in capsys.readouterr().out


def test_templates_of_several_recipes_may_lie_outside_their_folders(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    (tmp_path / "mine.j2").write_text("{{ frames | length }}")
    build(folder, capsys, exports=[{"template": "../mine.j2", "to": "n.txt"}])
    assert outputs(folder)["n.txt"] == b"7"


@pytest.mark.parametrize("stated", ["/etc/hostname", "../secret", "link.j2", "links/secret"])
@pytest.mark.parametrize("command", ["check", "build"])
def test_no_other_file_from_outside_is_carried_into_an_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stated: str, command: str
) -> None:
    folder = repo(tmp_path / "a")
    (tmp_path / "secret").write_text("my key")
    (folder / "link.j2").symlink_to(tmp_path / "secret")
    (folder / "links").symlink_to(tmp_path, target_is_directory=True)
    recipe = folder / "fire.yaml"
    keys = {"source": {"path": "clip"}, "exports": [{"template": stated, "to": "n.txt"}]}
    recipe.write_text(json.dumps(keys), encoding="utf-8")
    assert main([command, str(recipe)]) == 2
    said = capsys.readouterr().err
    assert "fire.yaml:1: exports.0.template: " in said and "outside the recipe's folder" in said
    assert not (folder / "build").exists() or "n.txt" not in outputs(folder)


def test_a_template_is_never_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    (folder / "build").mkdir()
    (folder / "build/mine.j2").write_text("x")
    recipe = {"source": {"path": "clip"}, "flakes": "none", "motion_blur": "none",
              "exports": [{"template": "build/mine.j2", "to": "mine.j2"}]}  # fmt: skip
    (folder / "fire.yaml").write_text(json.dumps(recipe))
    assert main(["build", str(folder / "fire.yaml")]) == 1
    assert "is an input" in capsys.readouterr().err
    assert (folder / "build/mine.j2").read_text() == "x"


def test_a_clip_that_needs_several_pages_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    assert "needs 4 pages" in build(folder, capsys, atlas={"max_size": 140, "trim": "none"})
    assert "pages;" not in build(folder, capsys)


def test_inspect_shows_what_templates_see(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    (folder / "mine.j2").write_text(
        "{{ frames | tojson }}\n{{ pages | tojson }}\n{{ grid | tojson }}"
    )
    build(
        folder, capsys, atlas={"layout": "grid"},
        exports=["json", {"template": "mine.j2", "to": "seen.txt"}],
    )  # fmt: skip
    assert main(["inspect", str(folder / "build/fire.json"), "--context"]) == 0
    context = json.loads(capsys.readouterr().out)
    seen = [json.loads(line) for line in outputs(folder)["seen.txt"].splitlines()]
    assert [context["frames"], context["pages"], context["grid"]] == seen


def test_inspect_tells_the_safe_mip_level(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = repo(tmp_path / "a")
    for padding, said in ((0, "not even"), (12, "safe mip level")):
        build(folder, capsys, atlas={"padding": padding})
        shutil.copy(folder / "build/fire.json", folder / f"{padding}.json")
        assert main(["inspect", str(folder / "build/fire.json")]) == 0
        assert said in capsys.readouterr().out
    meta = json.loads((folder / "12.json").read_text())["meta"]
    assert meta["fireAtlas"]["safeMipLevel"] >= 2
