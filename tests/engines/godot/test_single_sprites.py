"""The engine loads each single sprite as a texture, and each nine-patch as a box."""

import base64
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from tests.sources.test_sprites import icon
from tests.support.godot4 import Godot4
from tests.support.icons import NAMES, draw_theme

BORDER = [5, 3, 4, 2]


@pytest.mark.slow
def test_every_icon_of_a_theme_is_a_texture_of_its_name(godot4: Godot4, tmp_path: Path) -> None:
    drawn = draw_theme(tmp_path / "art")
    drawn["panel"] = icon(tmp_path / "art/panel.png", 31, 22)
    coins = {f"coin_{i}": icon(tmp_path / f"art/coin_{i}.png", 20 + i, 16) for i in (1, 2)}
    source = {"kind": "sprites", "path": "art", "borders": {"panel": BORDER}}
    recipe = tmp_path / "ui.yaml"
    recipe.write_text(json.dumps({"source": source, "exports": ["json", "godot"]}))
    game = tmp_path / "game"
    assert main(["build", "-q", str(recipe), "-o", str(game)]) == 0
    files = {name: f"res://ui.{name.replace('/', '-')}.tres" for name in drawn}
    assert len(set(files.values())) == NAMES + 1
    box = "res://ui.panel.stylebox.tres"
    seen, frames = godot4.run(game, [
        {"do": "describe_sprites", "paths": [*files.values(), box]},
        {"do": "describe_frames", "path": "res://ui.tres"},
    ])  # fmt: skip
    for name, image in drawn.items():
        found = seen[files[name]]
        assert found["name"] == name
        assert found["size"] == [image.shape[1], image.shape[0]]
        with Image.open(io.BytesIO(base64.b64decode(found["png"]))) as picture:
            shown = np.asarray(picture.convert("RGBA"))
        x, y = (round(length) for length in found["margin"][:2])
        part = image[y : y + shown.shape[0], x : x + shown.shape[1]]
        np.testing.assert_array_equal(
            np.where(shown[..., 3:] > 0, shown, 0), np.where(part[..., 3:] > 0, part, 0)
        )
        assert (image[..., 3] > 0).sum() == (shown[..., 3] > 0).sum()
    assert seen[box]["margins"] == BORDER
    assert seen[box]["region"] == seen[files["panel"]]["region"]
    assert {title: len(each["frames"]) for title, each in frames.items()} == {"coin": len(coins)}


def test_a_recipe_of_single_sprites_alone_has_no_scene(tmp_path: Path) -> None:
    icon(tmp_path / "art/hud/close.png")
    (tmp_path / "ui.yaml").write_text(
        json.dumps({"source": {"kind": "sprites", "path": "art"}, "exports": ["godot"]})
    )
    assert main(["build", "-q", str(tmp_path / "ui.yaml")]) == 0
    names = {path.name for path in (tmp_path / "build").iterdir()}
    assert names == {"ui.png", "ui.png.import", "ui.hud-close.tres", "ui.manifest.json"}
