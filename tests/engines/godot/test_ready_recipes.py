"""Godot 4 plays every ready recipe, and real clips, as they were built: without a complaint."""

import json
from pathlib import Path

import numpy as np
import pytest

from fire_atlas.atlas.sheet import Region
from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.frames import cut_frames
from tests.support.godot4 import Godot4, picture

GROUND = (40, 60, 90)
CLIPS = ("real_candle_red", "cartoon_wesnoth_campfire", "sim_unity_flame02")


def built(recipe: Path, out: Path, *settings: str) -> AtlasFile:
    """Build a recipe for Godot; return its pages as a web client reads them."""
    line = ["build", "-q", str(recipe), "-o", str(out), "--set", "exports=[json, godot]"]
    assert main([*line, *(word for each in settings for word in ("--set", each))]) == 0
    return read_atlas(out / f"{recipe.stem}.json")


def pivot(frame: Region) -> tuple[float, float]:
    """Return where a frame's node is when the frame itself begins at (0, 0)."""
    return frame.anchor[0] * frame.frame_width, frame.anchor[1] * frame.frame_height


def assert_played(godot4: Godot4, folder: Path, atlas: AtlasFile) -> None:
    """Compare frames, times and three pictures of a scene with its atlas."""
    frames = {each.name: each for each in atlas.frames}
    played = [(a.name, i, name) for a in atlas.sheet.animations for i, name in enumerate(a.frames)]
    shown = [played[i] for i in sorted({0, len(played) // 3, len(played) - 1})]
    scene = f"res://{atlas.path.stem}"
    drawn = {"do": "draw", "scene": f"{scene}.tscn"}
    drawn["background"] = "{:02x}{:02x}{:02x}".format(*GROUND)
    described, *shots = godot4.run(
        folder,
        [{"do": "describe_frames", "path": f"{scene}.tres"},
         *({**drawn, "animation": title, "frame": i, "at": pivot(frames[name])}
           for title, i, name in shown)],
        (max(f.frame_width for f in atlas.frames), max(f.frame_height for f in atlas.frames)),
    )  # fmt: skip
    assert described.keys() == {animation.name for animation in atlas.sheet.animations}
    for animation in atlas.sheet.animations:
        seen = described[animation.name]
        lasting = [1000 * each["duration"] / seen["speed"] for each in seen["frames"]]
        stated = [frames[name].duration for name in animation.frames]
        assert lasting == pytest.approx(stated, abs=0.01)
        assert seen["loop"] == animation.loop
    pictures = dict(zip(frames, cut_frames(atlas), strict=True))
    for (_, _, name), answer in zip(shown, shots, strict=True):
        stored, alpha = pictures[name], atlas.sheet.alpha
        expected = blend(stored, GROUND, alpha, atlas.sheet.blend_space).astype(int)
        seen = picture(answer)[: expected.shape[0], : expected.shape[1]]
        assert np.abs(seen - expected).max() <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "recipe", sorted(shipped("recipes").glob("*.yaml")), ids=lambda path: path.stem
)
def test_a_ready_recipe_is_played_as_it_was_built(
    recipe: Path, godot4: Godot4, tmp_path: Path
) -> None:
    assert_played(godot4, tmp_path, built(recipe, tmp_path))


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("clip", CLIPS)
def test_a_real_clip_is_played_as_it_was_built(
    clip: str, alpha: str, clips: Path, godot4: Godot4, tmp_path: Path
) -> None:
    recipe = tmp_path / "fire.yaml"
    source = {"path": str(clips / clip / "frames"), "height": 200}
    recipe.write_text(json.dumps({"source": source, "atlas": {"alpha": alpha}}))
    assert_played(godot4, tmp_path, built(recipe, tmp_path))
