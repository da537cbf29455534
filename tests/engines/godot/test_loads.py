"""The engine reads exports of real clips, and sees every frame as the sheet has it."""

import json
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.formats.test_sprites_and_members import draw
from tests.support.godot4 import Godot4

CLIPS: dict[str, dict[str, Any]] = {
    "real_candle_red": {},
    "cartoon_wesnoth_campfire": {"alpha": "premultiplied", "max_size": 256},
    "sim_unity_flame02": {"alpha": "additive", "scales": [1, 0.5], "format": "webp"},
}


def build(folder: Path, clip: Path, atlas: dict[str, Any]) -> list[str]:
    """Build a scene of a clip; return the names of its scales."""
    recipe = {
        "source": {"path": str(clip / "frames"), "height": 160},
        "atlas": atlas,
        "exports": ["json", "godot"],
        "flakes": {"bake": clip.name == "real_candle_red"},
    }
    folder.mkdir()
    (folder / "fire.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(folder / "fire.yaml"), "-o", str(folder)]) == 0
    return ["fire", "fire@0.5x"] if "scales" in atlas else ["fire"]


@pytest.mark.parametrize("clip", CLIPS)
def test_every_frame_is_understood_as_it_is_on_the_sheet(
    clips: Path, clip: str, godot4: Godot4, tmp_path: Path
) -> None:
    folder = tmp_path / "game"
    names = build(folder, clips / clip, CLIPS[clip])
    read = {
        "animation": ":animation", "playing": ":autoplay", "offset": ":offset",
        "centered": ":centered", "blend": ":material:blend_mode", "frames": ":sprite_frames",
        "visible": "Flakes:visible", "scale": "Flakes:scale", "rows": "Flakes:tracks:rows",
        "animations": "Flakes:tracks:animations",
    }  # fmt: skip
    jobs: list[Any] = [{"do": "describe_frames", "path": f"res://{name}.tres"} for name in names]
    jobs += [
        {"do": "read", "scene": f"res://{name}.tscn", "read": [*read.values()]} for name in names
    ]
    answers = godot4.run(folder, jobs)
    for name, frames, values in zip(names, answers, answers[len(names) :], strict=False):
        scene = {key: values[path] for key, path in read.items()}
        flakes = {key: scene.pop(key) for key in ("visible", "scale", "rows", "animations")}
        scene["flakes"] = {**flakes, "rows": len(flakes["rows"]) / 11}
        scene |= {"playing": scene["playing"] == "fire", "blend": 4 if scene["blend"] == 4 else 0}
        assert_sheet(frames, scene, folder, name, CLIPS[clip])


def assert_sheet(
    animations: Any, scene: Any, folder: Path, name: str, atlas: dict[str, Any]
) -> None:
    """Compare what the engine understood of one scale with its JSON."""
    pages = sorted(folder.glob(f"{name}.json")) + sorted(folder.glob(f"{name}-*.json"))
    sheets = [json.loads(page.read_text()) for page in pages]
    frames = {key: (frame, sheet) for sheet in sheets for key, frame in sheet["frames"].items()}
    (animation,) = animations.values()
    assert len(animation["frames"]) == len(frames)
    for shown, key in zip(animation["frames"], sorted(frames), strict=True):
        entry, sheet = frames[key]
        assert_alike(shown, entry, sheet["meta"])
    about = sheets[0]["meta"]["fireAtlas"]
    assert animation["speed"] == about["fps"]
    assert animation["loop"] == about["loops"]["fire"]
    ticks = [shown.get("duration", 1.0) for shown in animation["frames"]]
    seconds = sum(entry["duration"] for entry, _ in frames.values()) / 1000
    assert sum(ticks) / animation["speed"] == pytest.approx(seconds, abs=1e-4)
    assert_scene(scene, folder, name, sheets[0], atlas)
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
    assert not scene["centered"]
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


def test_effects_and_sprites_that_share_pages_are_one_sprite(
    godot4: Godot4, tmp_path: Path
) -> None:
    folder = tmp_path / "game"
    folder.mkdir()
    for i, size in enumerate((20, 30)):
        draw(folder / f"art/walk_{i}.png", size, 40)
    clip = {"path": str(shipped("samples") / "campfire"), "count": 5, "height": 80}
    recipes: dict[str, dict[str, Any]] = {
        "torch": {"source": clip, "flakes": {"bake": False}},
        "candle": {"source": clip, "seed": 4},
        "hero": {"source": {"kind": "sprites", "path": "art"}},
        "level": {
            "atlas": {"members": ["torch.yaml", "candle.yaml", "hero.yaml"], "max_size": 128},
            "exports": ["json", "godot"], "tracks": [],
        },
    }  # fmt: skip
    for name, recipe in recipes.items():
        (folder / f"{name}.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(folder / "level.yaml"), "-o", str(folder)]) == 0
    read = ["Flakes:tracks:animations", "Flakes:visible"]
    animations, scene = godot4.run(folder, [
        {"do": "describe_frames", "path": "res://level.tres"},
        {"do": "read", "scene": "res://level.tscn", "read": read},
    ])  # fmt: skip
    counts = {name: len(animation["frames"]) for name, animation in animations.items()}
    assert counts == {"torch": 5, "candle": 5, "walk": 2}
    assert {tuple(frame["size"]) for a in animations.values() for frame in a["frames"]} == {
        tuple(animations["torch"]["frames"][0]["size"])  # one stage for all
    }
    assert len({frame["page"] for a in animations.values() for frame in a["frames"]}) > 1
    assert [scene[path] for path in read] == [["torch"], True]
