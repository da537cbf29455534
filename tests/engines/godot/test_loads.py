"""The engine reads exports of real clips, and sees every frame as the sheet has it."""

import json
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.engines.godot.engine import Game
from tests.engines.godot.godot4 import as_godot_3, durations
from tests.formats.test_sprites_and_members import draw

pytestmark = pytest.mark.usefixtures("godot")

CLIPS: dict[str, dict[str, Any]] = {
    "real_candle_red": {},
    "cartoon_wesnoth_campfire": {"alpha": "premultiplied", "max_size": 256},
    "sim_unity_flame02": {"alpha": "additive", "scales": [1, 0.5], "format": "webp"},
}


def build(folder: Path, clip: Path, version: int, atlas: dict[str, Any]) -> None:
    recipe = {
        "source": {"path": str(clip / "frames"), "height": 160},
        "atlas": atlas,
        "exports": ["json", {"godot": {"version": version}}],
        "flakes": {"bake": clip.name == "real_candle_red"},
    }
    folder.mkdir()
    (folder / "fire.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(folder / "fire.yaml"), "-o", str(folder)]) == 0


@pytest.mark.parametrize("version", [4, 3])
@pytest.mark.parametrize("clip", CLIPS)
def test_every_frame_is_understood_as_it_is_on_the_sheet(
    clips: Path, clip: str, version: int, tmp_path: Path
) -> None:
    atlas, folder = CLIPS[clip], tmp_path / "game"
    build(folder, clips / clip, version, atlas)
    names = ["fire", "fire@0.5x"] if "scales" in atlas else ["fire"]
    lasting = {name: durations((folder / f"{name}.tres").read_text()) for name in names}
    if version == 4:
        as_godot_3(folder)
    game = Game.at(folder)
    assert game.import_all() == []
    stated = game.ask(
        "describe.gd", [f"res://{name}.{e}" for name in names for e in ("tres", "tscn")]
    )
    for name in names:
        pages = sorted(folder.glob(f"{name}.json")) + sorted(folder.glob(f"{name}-*.json"))
        sheets = [json.loads(page.read_text()) for page in pages]
        frames = {key: (frame, sheet) for sheet in sheets for key, frame in sheet["frames"].items()}
        (animation,) = stated[f"res://{name}.tres"].values()
        assert len(animation["frames"]) == len(frames)
        for shown, key in zip(animation["frames"], sorted(frames), strict=True):
            entry, sheet = frames[key]
            assert_alike(shown, entry, sheet["meta"])
        about = sheets[0]["meta"]["fireAtlas"]
        assert animation["speed"] == about["fps"]
        assert animation["loop"] == about["loops"]["fire"]
        ticks = lasting[name] if version == 4 else [1.0] * len(frames)
        seconds = sum(entry["duration"] for entry, _ in frames.values()) / 1000
        assert sum(ticks) / animation["speed"] == pytest.approx(seconds, abs=1e-4)
        assert_scene(stated[f"res://{name}.tscn"], folder, name, sheets[0], atlas)
    if "max_size" in atlas:
        assert len(pages) > 1


def assert_alike(shown: Any, entry: Any, meta: Any) -> None:
    frame, trim, size = entry["frame"], entry["spriteSourceSize"], entry["sourceSize"]
    assert shown["page"] == f"res://{meta['image']}"
    assert shown["page_size"] == [meta["size"]["w"], meta["size"]["h"]]
    assert shown["region"] == [frame["x"], frame["y"], frame["w"], frame["h"]]
    assert shown["margin"][:2] == [trim["x"], trim["y"]]
    assert shown["size"] == [size["w"], size["h"]]


def assert_scene(scene: Any, folder: Path, name: str, sheet: Any, atlas: dict[str, Any]) -> None:
    entry = next(iter(sheet["frames"].values()))
    pivot = [
        entry["anchor"][axis] * entry["sourceSize"][side] for axis, side in (("x", "w"), ("y", "h"))
    ]
    assert scene["offset"] == pytest.approx([-length for length in pivot], abs=1e-3)
    assert (scene["type"], scene["centered"]) == ("AnimatedSprite", False)
    assert (scene["animation"], scene["playing"]) == ("fire", True)
    assert scene["frames"] == f"res://{name}.tres"
    assert scene["blend"] == (4 if "alpha" in atlas else 0)
    tracks = json.loads((folder / "fire.flakes.json").read_text())
    scale = 0.5 if name.endswith("0.5x") else 1
    assert scene["flakes"] == {
        "visible": "alpha" in atlas,  # the other clip shows its flakes in its pixels
        "scale": [scale, scale],
        "rows": sum(len(frame["rows"]) for frame in tracks["frames"]),
        "animations": ["fire"],
    }


def test_effects_and_sprites_that_share_pages_are_one_sprite(tmp_path: Path) -> None:
    folder = tmp_path / "game"
    folder.mkdir()
    for i, size in enumerate((20, 30)):
        draw(folder / f"art/walk_{i}.png", size, 40)
    plain = {"flakes": "none", "motion_blur": "none"}
    clip = {"path": str(shipped("samples") / "campfire"), "count": 5, "height": 80}
    recipes: dict[str, dict[str, Any]] = {
        "torch": {"source": clip, "flakes": {"bake": False}},
        "candle": {"source": clip, "seed": 4},
        "hero": {"source": {"path": "art"}, **plain},
        "level": {
            "atlas": {"members": ["torch.yaml", "candle.yaml", "hero.yaml"], "max_size": 128},
            "exports": ["json", {"godot": {"version": 3}}], "tracks": [],
        },
    }  # fmt: skip
    for name, recipe in recipes.items():
        (folder / f"{name}.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(folder / "level.yaml"), "-o", str(folder)]) == 0
    game = Game.at(folder)
    assert game.import_all() == []
    stated = game.ask("describe.gd", ["res://level.tres", "res://level.tscn"])
    animations = stated["res://level.tres"]
    counts = {name: len(animation["frames"]) for name, animation in animations.items()}
    assert counts == {"torch": 5, "candle": 5, "hero_walk": 2}
    assert {tuple(frame["size"]) for a in animations.values() for frame in a["frames"]} == {
        tuple(animations["torch"]["frames"][0]["size"])  # one stage for all
    }
    assert len({frame["page"] for a in animations.values() for frame in a["frames"]}) > 1
    flakes = stated["res://level.tscn"]["flakes"]
    assert (flakes["animations"], flakes["visible"]) == (["torch"], True)
