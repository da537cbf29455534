"""The real Godot 4.6 shows a grid of lines through the hot air of a fire."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from tests.support.godot4 import Godot4, picture
from tests.support.hazes import BRIGHT, DARK, HazePage, bent, built, grid, lines, seam_ratio

WIDTH, HEIGHT = 128, 160


def stage(width: int, height: int, scene: str) -> str:
    """Return a scene of a grid of lines, and before it a scene that is hidden but for its haze."""
    rectangles = [(0, 0, width, height, DARK), *((*line, BRIGHT) for line in lines(width, height))]
    text = f'[gd_scene format=3]\n[ext_resource type="PackedScene" path="{scene}" id="1"]\n'
    text += '[node name="Stage" type="Node2D"]\n'
    for i, (x, y, w, h, byte) in enumerate(rectangles):
        text += (
            f'[node name="Line{i}" type="ColorRect" parent="."]\noffset_left = {x}.0\n'
            f"offset_top = {y}.0\noffset_right = {x + w}.0\noffset_bottom = {y + h}.0\n"
            f"color = Color({', '.join([str(byte / 255)] * 3)}, 1)\n"
        )
    return text + '[node name="Hot" parent="." instance=ExtResource("1")]\n'


def drawn(
    godot: Godot4,
    folder: Path,
    frames: list[int],
    zoom: int = 1,
    changes: Mapping[str, str] = MappingProxyType({}),
) -> list[np.ndarray[Any, np.dtype[np.uint8]]]:
    """Draw the haze of frames over the grid, the fire itself hidden."""
    project = folder / "game"
    shutil.copytree(folder / "build", project, dirs_exist_ok=True)
    size = WIDTH * zoom, HEIGHT * zoom
    (project / "stage.tscn").write_text(stage(*size, "res://fire_haze.tscn"))
    page = HazePage.read(project)
    x, y = (page.frames[0]["anchor"][axis] for axis in "xy")
    place = f"Vector2({x * size[0]}, {y * size[1]})"
    settings = {
        "Hot:position": place, "Hot:scale": f"Vector2({zoom}, {zoom})",
        "Hot/Fire:self_modulate": "Color(0, 0, 0, 0)", **changes,
    }  # fmt: skip
    jobs = [
        {
            "do": "draw", "scene": "res://stage.tscn", "background": "000000", "sprite": "Hot/Fire",
            "animation": "fire", "frame": i, "set": settings,
        }
        for i in frames
    ]  # fmt: skip
    return [picture(answer)[..., :3] for answer in godot.run(project, jobs, size)]


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("haze")
    built(folder, exports=["godot", "json"])
    return folder


@pytest.mark.parametrize("zoom", [1, 2])
def test_lines_bend_as_the_vectors_say_and_above_the_fire_alone(
    godot4: Godot4, game: Path, zoom: int
) -> None:
    page = HazePage.read(game / "build")
    (seen,) = drawn(godot4, game, [5], zoom)
    straight, wanted = grid(WIDTH * zoom, HEIGHT * zoom), bent(page.of(5), zoom)
    shown = seen[..., 1].astype(np.float32)
    assert np.abs(wanted - straight).mean() > 3, "lines bend"
    assert np.abs(shown - wanted).mean() < 1
    foot = round(page.frames[5]["anchor"]["y"] * HEIGHT * zoom)
    assert np.array_equal(shown[foot:], straight[foot:])
    moved = np.abs(shown - straight)
    middle = HEIGHT * zoom // 2
    assert moved[:middle].sum() > 2 * moved[middle:].sum(), "above more than in the flame"


def test_the_haze_plays_with_the_fire_and_closes(godot4: Godot4, game: Path) -> None:
    count = len(HazePage.read(game / "build").frames)
    seen = drawn(godot4, game, list(range(count)))
    assert 0.8 <= seam_ratio(seen) <= 1.25


def test_it_is_as_strong_as_the_scene_says(godot4: Godot4, game: Path) -> None:
    name = "Hot/Haze:material:shader_parameter/strength"
    (none,) = drawn(godot4, game, [5], changes={name: "0.0"})
    (turned,) = drawn(godot4, game, [5], changes={"Hot:rotation": "3.14159265", name: "1.0"})
    straight = grid(WIDTH, HEIGHT)
    assert np.array_equal(none[..., 1], straight)
    foot = round(HazePage.read(game / "build").frames[5]["anchor"]["y"] * HEIGHT)
    assert np.array_equal(turned[: 2 * foot - HEIGHT, :, 1], straight[: 2 * foot - HEIGHT])
    assert not np.array_equal(turned[foot:, :, 1], straight[foot:])
