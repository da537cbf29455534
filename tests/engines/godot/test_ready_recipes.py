"""Godot 4 plays every ready recipe, and real clips, as they were built: without a complaint."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.sheet import Region
from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.formats.output_names import animation_stem, flakes_file
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource
from fire_atlas.recipe.tree import read_tree
from tests.engines.godot.test_flakes import assert_near_tracks
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
    """Compare frames, times, three pictures, and where sparks are, with what was built."""
    frames = {each.name: each for each in atlas.frames}
    played = [(a.name, i, name) for a in atlas.sheet.animations for i, name in enumerate(a.frames)]
    shown = [played[i] for i in sorted({0, len(played) // 3, len(played) - 1})]
    scene, flown = f"res://{atlas.path.stem}", dict(flown_animations(folder, atlas))
    drawn = {"do": "draw", "scene": f"{scene}.tscn"}
    drawn["background"] = "{:02x}{:02x}{:02x}".format(*GROUND)
    described, *answers = godot4.run(
        folder,
        [{"do": "describe_frames", "path": f"{scene}.tres"},
         *({**drawn, "animation": title, "frame": i, "at": pivot(frames[name])}
           for title, i, name in shown),
         *({"do": "seek_flakes", "scene": f"{scene}.tscn", "animation": title,
            "times": moments(tracks)} for title, tracks in flown.items())],
        (max(f.frame_width for f in atlas.frames), max(f.frame_height for f in atlas.frames)),
    )  # fmt: skip
    assert_timed(described, atlas)
    pictures = dict(zip(frames, cut_frames(atlas), strict=True))
    for (_, _, name), answer in zip(shown, answers, strict=False):
        stored, alpha = pictures[name], atlas.sheet.alpha
        expected = blend(stored, GROUND, alpha, atlas.sheet.blend_space).astype(int)
        seen = picture(answer)[: expected.shape[0], : expected.shape[1]]
        assert np.abs(seen - expected).max() <= 1
    for (title, tracks), sought in zip(flown.items(), answers[len(shown) :], strict=True):
        first = next(a.frames[0] for a in atlas.sheet.animations if a.name == title)
        rows = [np.array(f["rows"]).reshape(-1, len(tracks["columns"])) for f in tracks["frames"]]
        for time, seen in zip(moments(tracks), sought, strict=True):
            at = time % len(rows)
            table = np.array(seen, float).reshape(-1, 9)
            assert_near_tracks(table, at, rows, tracks, pivot(frames[first]))


def assert_timed(described: Any, atlas: AtlasFile) -> None:
    """Compare how many frames the engine counts, and how long each lasts, with the atlas."""
    durations = {frame.name: frame.duration for frame in atlas.frames}
    assert described.keys() == {animation.name for animation in atlas.sheet.animations}
    for animation in atlas.sheet.animations:
        seen = described[animation.name]
        lasting = [1000 * each["duration"] / seen["speed"] for each in seen["frames"]]
        assert lasting == pytest.approx([durations[n] for n in animation.frames], abs=0.01)
        assert seen["loop"] == animation.loop


def flown_animations(folder: Path, atlas: AtlasFile) -> Iterator[tuple[str, Any]]:
    """Yield the animations that have sparks, with their tracks."""
    for animation in atlas.sheet.animations:
        path = folder / flakes_file(animation_stem(atlas.path.stem, animation.name), "json")
        if path.exists():
            yield animation.name, json.loads(path.read_text())


def moments(tracks: Any) -> list[float]:
    """Return times in frames all over an animation, and of a loop some over its end too."""
    count = len(tracks["frames"])
    inside = [*np.arange(0.0, count - 1, 3.4).tolist(), count - 1.0]
    return [*inside, count - 0.4, count + 0.0, count + 0.6] if tracks["loop"] else inside


@pytest.mark.slow
@pytest.mark.parametrize(
    "recipe", sorted(shipped("recipes").glob("*.yaml")), ids=lambda path: path.stem
)
def test_a_ready_recipe_is_played_as_it_was_built(
    recipe: Path, godot4: Godot4, tmp_path: Path
) -> None:
    source = load_tree(read_tree(recipe)).recipe.source
    # A few small frames of the same shape show as much.
    settings = ["timeline.frames=6"]
    if isinstance(source, FramesSource):
        settings.append("source.height=96")
    if isinstance(source, SilkSource | FluidSource):
        scale = 96 / max(source.width, source.height)
        settings += ["source.size=null", "source.aspect=null"]
        settings.append(f"source.width={round(source.width * scale)}")
        settings.append(f"source.height={round(source.height * scale)}")
    if isinstance(source, FluidSource):
        settings.append("source.resolution=draft")
    if isinstance(source, SilkSource):
        settings += ["source.rows=8", "source.columns=6"]
    if recipe.stem == "windy_torch":
        settings += ["views.count=3", "source.height=96"]
    assert_played(godot4, tmp_path, built(recipe, tmp_path, *settings))


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("clip", CLIPS)
def test_a_real_clip_is_played_as_it_was_built(
    clip: str, alpha: str, clips: Path, godot4: Godot4, tmp_path: Path
) -> None:
    recipe = tmp_path / "fire.yaml"
    source = {"path": str(clips / clip / "frames"), "height": 96}
    recipe.write_text(json.dumps({"source": source, "atlas": {"alpha": alpha}}))
    assert_played(godot4, tmp_path, built(recipe, tmp_path))
