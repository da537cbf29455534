"""The real Godot 4.6 shows smoke under the fire: a wall behind it is darker by what it states."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from tests.support.godot4 import Godot4, picture

DEPTHS = (0.25, 0.5, 1.0, 1.5, 2.0)
"""Optical depths of the smoke, in stripes from left to right."""

STRIPE, HEIGHT = 12, 40
ALPHAS = ("straight", "premultiplied", "additive")


def built(folder: Path, name: str, **keys: Any) -> None:
    recipe = folder / f"{name}.yaml"
    recipe.write_text(json.dumps({
        "flakes": "none", "timeline": {"loop": "none"}, "exports": ["json", "godot"],
        "maps": {"smoke": True}, "tracks": [], **keys,
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe), "-o", str(folder)]) == 0


def smoky_clip(folder: Path) -> dict[str, Any]:
    """Stripes of black smoke; they fill their frame but for a border."""
    depth = np.repeat(DEPTHS, STRIPE)
    frame = np.zeros((HEIGHT, len(depth), 4), np.uint8)
    frame[4:-4, :, 3] = np.rint(255 * (1 - np.exp(-depth)))
    folder.mkdir()
    for i in range(2):
        Image.fromarray(frame).save(folder / f"{i}.png")
        frame = frame[::-1]
    return {"path": str(folder), "fps": 10}


def job(folder: Path, name: str, wall: str, frame: int = 0) -> dict[str, Any]:
    region = read_atlas(folder / f"{name}.json").frames[frame]
    x, y = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
    return {
        "do": "draw", "scene": f"res://{name}.tscn", "animation": name, "frame": frame,
        "background": wall, "at": [x, y],
    }  # fmt: skip


def test_black_smoke_darkens_a_white_wall_by_its_optical_depth(
    godot4: Godot4, tmp_path: Path
) -> None:
    source = smoky_clip(tmp_path / "clip")
    for alpha in ALPHAS:
        built(tmp_path, alpha, source=source, atlas={"alpha": alpha})
    jobs = [job(tmp_path, alpha, wall) for alpha in ALPHAS for wall in ("ffffff", "808080")]
    shots = [picture(answer)[:HEIGHT].astype(float) for answer in godot4.run(tmp_path, jobs)]
    for k, shot in enumerate(shots):
        wall = (255, 128)[k % 2]
        for i, depth in enumerate(DEPTHS):
            stripe = shot[8 : HEIGHT - 8, i * STRIPE + 2 : (i + 1) * STRIPE - 2]
            seen = -math.log(stripe.mean() / wall)
            assert seen == pytest.approx(depth, rel=0.03), (ALPHAS[k // 2], wall)
        assert (shot[:3] == wall).all(), "nothing else is darker"


def shown(folder: Path, name: str, wall: int, frame: int) -> NDArray[np.float64]:
    """What fire over smoke is by the blend formula, from the files."""
    atlas = read_atlas(folder / f"{name}.json").sheet
    region = atlas.regions[frame]
    x, y, w, h = region.x, region.y, region.width, region.height
    ground = np.full((region.frame_height, region.frame_width, 3), float(wall))
    part = ground[region.trim_y : region.trim_y + h, region.trim_x : region.trim_x + w]
    for file in (atlas.map("smoke").files[0], atlas.pages[0].file):
        with Image.open(folder / file) as image:
            layer = np.asarray(image.convert("RGBA"))[y : y + h, x : x + w].astype(float)
        light = layer[..., :3] * (layer[..., 3:] / 255 if atlas.alpha == "straight" else 1)
        part[:] = light + (1 - layer[..., 3:] / 255) * part
    return ground.clip(0, 255)


def test_an_explosion_is_drawn_as_fire_over_its_smoke(godot4: Godot4, tmp_path: Path) -> None:
    source = {"path": str(shipped("samples") / "explosion"), "fps": 24, "height": 120}
    for alpha in ALPHAS:
        built(tmp_path, alpha, source=source, atlas={"alpha": alpha, "mesh": {"vertices": 8}})
    wanted = [(alpha, wall, frame) for alpha in ALPHAS for wall in (255, 64) for frame in (4, 14)]
    jobs = [job(tmp_path, alpha, f"{wall:02x}" * 3, frame) for alpha, wall, frame in wanted]
    answers = godot4.run(tmp_path, jobs, (128, 128))
    for answer, each in zip(answers, wanted, strict=True):
        drawn: Bytes = picture(answer)
        formula = shown(tmp_path, *each)
        height, width = formula.shape[:2]
        off = np.abs(drawn[:height, :width] - formula)
        assert off.max() < 2.5, each
    dark = picture(answers[1])[40:80, 40:80].mean()
    assert dark < 120, "the smoke of an explosion hides a white wall"


def test_a_tinted_fire_has_tinted_smoke_and_fades_with_it(godot4: Godot4, tmp_path: Path) -> None:
    """``modulate`` acts on both, as on a page alone."""
    source = {"path": str(shipped("samples") / "explosion"), "fps": 24, "height": 120}
    built(tmp_path, "fire", source=source, atlas={"alpha": "premultiplied"})
    scene = (tmp_path / "fire.tscn").read_text()
    half = scene.replace("centered = false", "centered = false\nmodulate = Color(1, 1, 1, 0.5)")
    (tmp_path / "half.tscn").write_text(half.replace('uid="uid://', 'uid="uid://a', 1))
    whole = job(tmp_path, "fire", "ffffff", 8)
    answers = godot4.run(tmp_path, [whole, {**whole, "scene": "res://half.tscn"}], (128, 128))
    full, faded = (picture(answer).astype(float) for answer in answers)
    assert np.abs(faded - (full + 255) / 2).max() < 2
