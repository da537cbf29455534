"""Names of all kinds, in files that the engine has to read; and combinations that are refused."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.errors import OutputError
from fire_atlas.engines.godot.names import node_name, number, quoted, real, titles
from tests.formats.test_sprites_and_members import draw
from tests.support.godot4 import Godot4

ANIMATIONS = [
    "walk", "big fire", "fire, big", "Flamme über Öl", "炎", "7th", "x" * 200, "[tag]", "a=b",
    "%s {0} {{ x }}", "&amp", "emoji🔥", "player's",
]  # fmt: skip


def test_animations_may_be_called_anything(godot4: Godot4, tmp_path: Path) -> None:
    for i, name in enumerate(ANIMATIONS):
        for frame in range(2):
            draw(tmp_path / f"art/{name}_{frame:02}.png", 8 + i, 10 + frame)
    (tmp_path / "hero.yaml").write_text(json.dumps({
        "source": {"kind": "sprites", "path": "art"}, "exports": ["json", "godot"],
    }))  # fmt: skip
    game = tmp_path / "game"
    assert main(["build", "-q", str(tmp_path / "hero.yaml"), "-o", str(game)]) == 0
    (animations,) = godot4.run(game, [{"do": "describe_frames", "path": "res://hero.tres"}])
    sheet = json.loads((game / "hero.json").read_text())
    wanted = {name.replace(",", " ").replace("/", "_") for name in sheet["animations"]}
    assert len(wanted) == len(ANIMATIONS)
    assert set(animations) == wanted
    assert all(len(animation["frames"]) == 2 for animation in animations.values())
    for animation in animations.values():
        (size,) = {tuple(frame["size"]) for frame in animation["frames"]}
        assert size == (8 + len(ANIMATIONS) - 1, 11)  # the stage that holds all frames


NAMES = ["9lives", "fire-ball.v2", "_", "A" * 100, "CONE", "0"]


def test_outputs_may_be_called_what_a_recipe_may_be(godot4: Godot4, tmp_path: Path) -> None:
    game = tmp_path / "game"
    draw(tmp_path / "a.png", 9, 9)
    for name in NAMES:
        (tmp_path / "r.yaml").write_text(json.dumps({
            "name": name, "source": {"path": "a.png"}, "flakes": "none", "motion_blur": "none",
            "tracks": [], "exports": ["godot"],
        }))  # fmt: skip
        assert main(["build", "-q", str(tmp_path / "r.yaml"), "-o", str(game)]) == 0
    jobs: list[dict[str, Any]] = [
        {"do": "read", "scene": f"res://{name}.tscn", "read": [":name"]} for name in NAMES
    ]
    jobs += [{"do": "describe_frames", "path": f"res://{name}.tres"} for name in NAMES]
    answers = godot4.run(game, jobs)
    assert [scene[":name"] for scene in answers[: len(NAMES)]] == [*map(node_name, NAMES)]
    assert [[*frames] for frames in answers[len(NAMES) :]] == [[name] for name in NAMES]


@pytest.mark.parametrize("name", ["a b", "ö", "a;b", 'a"b', "a/b", "x" * 200, "..", ""])
def test_other_names_are_refused(name: str, tmp_path: Path) -> None:
    draw(tmp_path / "a.png", 9, 9)
    recipe = {"name": name, "source": {"path": "a.png"}, "exports": ["godot"]}
    (tmp_path / "r.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(tmp_path / "r.yaml")]) == 2
    assert not (tmp_path / "build").exists()


def test_two_recipes_of_one_name_are_refused_together_and_replace_each_other_alone(
    tmp_path: Path,
) -> None:
    paths = []
    for folder, size in (("a", 9), ("b", 20)):
        draw(tmp_path / folder / "a.png", size, size)
        path = tmp_path / folder / "fire.yaml"
        path.write_text(json.dumps({
            "source": {"path": "a.png"}, "flakes": "none", "motion_blur": "none", "tracks": [],
            "exports": ["godot"],
        }))  # fmt: skip
        paths.append(str(path))
    out = tmp_path / "out"
    assert main(["build", "-q", *paths, "-o", str(out)]) == 2
    assert not out.exists()
    for each in paths:
        assert main(["build", "-q", each, "-o", str(out)]) == 0
    assert "Rect2(0, 0, 20, 20)" in (out / "fire.tres").read_text()
    assert (out / "fire.tres").read_text().count("AtlasTexture") == 1


def test_animations_that_the_editor_cannot_tell_apart_are_refused() -> None:
    assert titles(["a/b", "c,d"]) == {"a/b": "a_b", "c,d": "c d"}
    with pytest.raises(OutputError, match="a/b and a_b apart"):
        titles(["a/b", "a_b"])


def test_numbers_are_plain_decimals() -> None:
    values = [0.0, -0.0, 24, 1 / 3, -38.4, 1e-9, -1e-7, 123456789.25, 1e-6]
    assert [number(value) for value in values] == [
        "0", "0", "24", "0.333333", "-38.4", "0", "0", "123456789.25", "0.000001",
    ]  # fmt: skip
    assert [real(24), real(-0.5), real(0)] == ["24.0", "-0.5", "0.0"]
    assert quoted('a"b\\c') == r'"a\"b\\c"'


def test_bytes_do_not_depend_on_the_system(tmp_path: Path) -> None:
    """Another locale, folder, number of workers and hash seed give the same files."""
    made = []
    for i, (locale, jobs) in enumerate((("C", "1"), ("de_DE.UTF-8", "3"))):
        folder = tmp_path / str(i)
        (folder / "clip").mkdir(parents=True)
        for frame in range(6):
            image = np.zeros((60, 40, 4), np.uint8)
            image[30 - 4 * frame : 55, 12:28] = (250, 40 * frame, 10, 255)
            Image.fromarray(image).save(folder / f"clip/{frame}.png")
        recipe: dict[str, Any] = {"source": {"path": "clip"}, "exports": ["godot"]}
        (folder / "fire.yaml").write_text(json.dumps(recipe))
        changes = {"LC_ALL": locale, "LANG": locale, "PYTHONHASHSEED": str(i)}
        line = [sys.executable, "-m", "fire_atlas", "build", "fire.yaml", "-q", "--jobs", jobs]
        search = os.pathsep.join(sys.path)
        subprocess.run(
            line, cwd=folder, env={**os.environ, **changes, "PYTHONPATH": search}, check=True
        )
        made.append({path.name: path.read_bytes() for path in (folder / "build").iterdir()})
    assert made[0] == made[1]
    assert {"fire.tres", "fire.tscn", "fire.png.import", "fire_flakes.tres"} < set(made[0])
