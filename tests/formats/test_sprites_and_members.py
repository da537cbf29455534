"""Plain sprites in named animations, and several effects on shared pages."""

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
from fire_atlas.sources.sprites import group_by_name

PLAIN: dict[str, Any] = {"flakes": "none", "motion_blur": "none"}


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


def test_images_of_any_size_become_named_animations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    images = art(tmp_path)
    sheet = built(recipe(tmp_path, "hero", source={"path": "art"}, **PLAIN), capsys)
    assert {name: len(frames) for name, frames in sheet["animations"].items()} == {
        "rock": 1, "run": 4, "tree": 1, "walk": 5,
    }  # fmt: skip
    assert sheet["animations"]["walk"][4] == "hero/walk/0004"
    order = [
        "rock",
        "run8",
        "run9",
        "run10",
        "run11",
        "tree",
        *(f"walk_{i:04}" for i in range(1, 6)),
    ]
    for stem, frame in zip(
        order, cut_frames(read_atlas(tmp_path / "build/hero.json")), strict=True
    ):
        image = images[stem]
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
    keys: dict[str, Any] = {"source": {"path": "art"}, **PLAIN}
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


def test_sprites_stand_on_the_middle_of_their_bottom(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    art(tmp_path)
    sheet = built(recipe(tmp_path, "hero", source={"path": "art"}, **PLAIN), capsys)
    assert {tuple(f["anchor"].values()) for f in sheet["frames"].values()} == {(0.5, 1)}


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
        "to pack images of different sizes, set flakes: none and motion_blur: none"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(("key", "value"), [("height", 10), ("crop", [0, 0, 4, 4])])
def test_sprites_of_several_sizes_cannot_have_one_height_or_part(
    key: str, value: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    art(tmp_path)
    path = recipe(tmp_path, "hero", source={"path": "art", key: value}, **PLAIN)
    assert main(["build", str(path)]) == 1
    assert f"source.{key}: is for the frames of one clip" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "animations"),
    [
        (["walk_0001", "walk_0002"], {"walk": (0, 1)}),
        (["walk (1)", "walk (2)", "run-1"], {"walk": (0, 1), "run": (2,)}),
        (["0001", "0002"], {"hero": (0, 1)}),
        (["a/1", "a/2", "b/1"], {"a": (0, 1), "b": (2,)}),
        (["tree", "rock"], {"tree": (0,), "rock": (1,)}),
        (["f_00_delay-0.1s", "f_01_delay-0.2s"], {"f": (0, 1)}),
        (["00_delay-0.1s", "01_delay-0.2s"], {"hero": (0, 1)}),
        (["炎_1", "炎_2", "a;b"], {"炎": (0, 1), "a_b": (2,)}),
    ],
)
def test_animations_are_named_after_their_files(
    names: list[str], animations: dict[str, tuple[int, ...]]
) -> None:
    assert group_by_name([Path(f"/art/{name}.png") for name in names], "hero") == animations


def host(folder: Path, **keys: Any) -> Path:
    """Two recipes, and one that puts both on its pages."""
    art(folder)
    for i in range(4):
        draw(folder / f"flame/{i}.png", 30, 50)
    recipe(folder, "hero", source={"path": "art"}, **PLAIN)
    recipe(folder, "torch", source={"path": "flame"}, flakes={"alpha": 0, "rate": 50})
    return recipe(folder, "level", **keys)


MEMBERS = {"atlas": {"members": ["hero.yaml", "torch.yaml"]}}


def test_several_recipes_share_pages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = built(host(tmp_path, **MEMBERS), capsys)
    assert set(sheet["animations"]) == {"hero/rock", "hero/run", "hero/tree", "hero/walk", "torch"}
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
