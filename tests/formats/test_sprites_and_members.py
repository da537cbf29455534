"""Sprites under their own names, and several effects on shared pages."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.preview.singles import with_singles_played

PLAIN: dict[str, Any] = {"flakes": "none", "motion_blur": "none"}
ART = {"kind": "sprites", "path": "art"}


def draw(path: Path, width: int, height: int) -> NDArray[np.uint8]:
    """Put a noisy sprite with clear corners on the disk."""
    chance = np.random.default_rng(width * 1000 + height)
    image: Bytes = chance.integers(1, 256, (height, width, 4), np.uint8)
    image[: height // 3, : width // 3] = 0
    path.parent.mkdir(exist_ok=True)
    Image.fromarray(image).save(path)
    return image


def art(folder: Path) -> dict[str, NDArray[np.uint8]]:
    sizes = {f"walk_{i:04}": (20 + i, 40) for i in range(1, 6)}
    sizes |= {f"run{i}": (44, 20 + 2 * i) for i in range(8, 12)}
    sizes |= {"tree": (60, 90), "rock": (17, 9)}
    return {stem: draw(folder / f"art/{stem}.png", *size) for stem, size in sizes.items()}


def recipe(folder: Path, name: str, **keys: Any) -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps(keys), encoding="utf-8")
    return path


def built(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    code = main(["build", str(path)])
    assert code == 0, capsys.readouterr().err
    sheet: dict[str, Any] = json.loads((path.parent / f"build/{path.stem}.json").read_text())
    return sheet


def test_images_of_any_size_are_packed_under_their_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    images = art(tmp_path)
    sheet = built(recipe(tmp_path, "hero", source=ART), capsys)
    assert sheet["animations"] == {"walk": [f"walk_{i:04}" for i in range(1, 6)]}  # run: from 8
    assert sheet["frames"].keys() == images.keys()
    atlas = with_singles_played(read_atlas(tmp_path / "build/hero.json"))
    for region, frame in zip(atlas.frames, cut_frames(atlas), strict=True):
        image = images[region.name]
        np.testing.assert_array_equal(frame, np.where(image[..., 3:] > 0, image, 0))


def note_on_split(said: str) -> tuple[str, int]:
    """Return the animations that a build says no page can hold, and the size that could."""
    found = re.search(
        r"no page can hold all frames of (.*):\s+with\s+atlas\.max_size:\s+(\d+)\s+one\s+could",
        said,
    )
    assert found, said
    return found[1], int(found[2])


@pytest.mark.parametrize("atlas", [{}, {"scales": [1, 0.5]}, {"layout": "grid"}])
def test_what_no_page_can_hold_is_named_and_a_page_of_the_size_advised_holds_it(
    atlas: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, side, count in (("walk", 20, 8), ("run", 22, 7), ("boom", 40, 12)):
        for i in range(count):
            draw(tmp_path / f"art/{name}_{i}.png", side, side + i)
    keys: dict[str, Any] = {"source": ART}
    size = 160 if "layout" in atlas else 110
    sheet = built(recipe(tmp_path, "hero", **keys, atlas={**atlas, "max_size": size}), capsys)
    names, size = note_on_split(capsys.readouterr().err)
    assert names == "boom"
    pages = [sheet, *(json.loads((tmp_path / "build" / each).read_text())
                      for each in sheet["meta"]["related_multi_packs"])]  # fmt: skip
    counts = [{name: len(on) for name, on in page["animations"].items()} for page in pages]
    assert sum("walk" in each for each in counts) == sum("run" in each for each in counts) == 1
    assert (
        sum(each.get("boom", 0) for each in counts)
        == 12
        > max(each.get("boom", 0) for each in counts)
    )
    built(recipe(tmp_path, "hero", **keys, atlas={**atlas, "max_size": size}), capsys)
    assert "no page can hold" not in capsys.readouterr().err


def test_frames_of_one_clip_stay_one_animation_with_the_recipes_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for i in range(3):
        draw(tmp_path / f"art/flame_{i}.png", 20, 30)
    sheet = built(recipe(tmp_path, "fire", source={"path": "art"}, **PLAIN), capsys)
    assert sheet["animations"] == {"fire": ["fire/0000", "fire/0001", "fire/0002"]}


def test_effects_still_need_frames_of_one_size(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    art(tmp_path)
    assert main(["build", str(recipe(tmp_path, "hero", source={"path": "art"}))]) == 1
    assert (
        "to pack images of different sizes: source: {kind: sprites, path: ...}"
        in capsys.readouterr().err
    )


def host(folder: Path, **keys: Any) -> Path:
    """Two recipes, and one that puts both on its pages."""
    art(folder)
    for i in range(4):
        draw(folder / f"flame/{i}.png", 30, 50)
    recipe(folder, "hero", source=ART)
    recipe(folder, "torch", source={"path": "flame"}, flakes={"alpha": 0, "rate": 50})
    return recipe(folder, "level", **keys)


MEMBERS = {"atlas": {"members": ["hero.yaml", "torch.yaml"]}}


def test_several_recipes_share_pages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = built(host(tmp_path, **MEMBERS), capsys)
    assert set(sheet["animations"]) == {"walk", "torch"}
    assert {"rock", "tree", "run8", "walk_0001", "level/torch/0000"} <= sheet["frames"].keys()
    assert sheet["animations"]["torch"] == [f"level/torch/{i:04}" for i in range(4)]
    assert sheet["meta"]["image"] == "level.png"
    names = {path.name for path in (tmp_path / "build").iterdir()}
    assert names == {"level.png", "level.json", "level.torch.flakes.json", "level.manifest.json"}


def test_a_host_may_have_an_effect_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, source={"path": "flame"}, **PLAIN, atlas={"members": ["torch.yaml"]})
    assert set(built(path, capsys)["animations"]) == {"level", "torch"}


def test_a_changed_member_or_its_input_is_built_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, **MEMBERS)
    built(path, capsys)
    capsys.readouterr()
    built(path, capsys)
    assert "up to date" in capsys.readouterr().out
    draw(tmp_path / "art/tree.png", 61, 90)
    built(path, capsys)
    assert "up to date" not in capsys.readouterr().out
    recipe(tmp_path, "torch", source={"path": "flame"}, flakes={"alpha": 0, "rate": 5})
    built(path, capsys)
    assert "up to date" not in capsys.readouterr().out


@pytest.mark.parametrize("end", [(), ("--resolved",)])
def test_check_looks_at_members_too(
    end: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, **MEMBERS)
    assert main(["check", str(path), *end]) == 0
    (tmp_path / "flame").rename(tmp_path / "gone")
    assert main(["check", str(path)]) == 1
    assert "torch.yaml:1: source.path" in capsys.readouterr().err


def test_a_resolved_host_builds_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, **MEMBERS)
    built(path, capsys)
    page = (tmp_path / "build/level.png").read_bytes()
    capsys.readouterr()
    main(["check", str(path), "--resolved"])
    path.write_text(capsys.readouterr().out)
    built(path, capsys)
    assert (tmp_path / "build/level.png").read_bytes() == page


@pytest.mark.parametrize(
    ("keys", "advice"),
    [
        ({"atlas": {"members": ["gone.yaml"]}}, "there is no such recipe"),
        ({"atlas": {"members": ["hero.yaml", "hero.yaml"]}}, "is called hero too"),
        ({"atlas": {"members": ["level.yaml"]}}, "has members itself"),
        ({"atlas": {"members": [3]}}, "must be the path of a recipe|must be text"),
        ({"atlas": {"members": []}}, "source: is missing"),
        ({}, "source: is missing"),
    ],
)
def test_members_that_cannot_be_are_refused(
    keys: dict[str, Any], advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, **keys)
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert any(each in said for each in advice.split("|")), said
    assert main(["build", str(path)]) == 2


def test_members_are_previewed_one_after_the_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = host(tmp_path, **MEMBERS)
    for kind in ("gif", "apng", "webp", "sheet"):
        assert main(["preview", str(path), f"--{kind}", "-q"]) == 0, capsys.readouterr().err
