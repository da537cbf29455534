"""A folder as the pages of the docs have it in mind: the clips, sheets and recipes they name."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image

from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.inherit import presets
from tests.support.synthetic_fire import write_video

INPUTS = {
    "clips/torch.gif": "torch.gif",
    "candle.gif": "torch.gif",
    "clip.gif": "torch.gif",
    "samples/campfire": "campfire",
    "sheets/explosion.png": "cartoon_flame.png",
    "sheets/embers.png": "pixel_flame.png",
}
"""Inputs that examples name -> the samples that stand in for them."""

_SPRITES = {"hud/close": 16, "hud/open": 24, "panel": 24, "coin_01": 32, "coin_02": 32}
"""Sides of square pictures, px, by their names, in the folders ``icons`` and ``ui``."""

_SIMULATED = {
    "silk": ("source.rows=6", "source.columns=4"),
    "fluid": ("source.resolution=draft",),
}
"""Kinds of fire that are simulated, and the settings with which that is quick."""

_CLIP = 16
"""Frames of a clip that are read where it is made tiny: a third of the campfire's."""

TEMPLATE = "return { {% for f in frames %}{{ f.x }}, {% endfor %} }"


def make_project(folder: Path) -> None:
    """Make the folder with all inputs that examples name."""
    for name, sample in INPUTS.items():
        source, target = shipped("samples") / sample, folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if source.is_dir() else shutil.copyfile)(source, target)
    frames = []
    for path in sorted((folder / "samples/campfire").iterdir()):
        fire = Image.open(path).convert("RGBA")
        black = Image.new("RGBA", fire.size, "black")
        even = (fire.width // 2 * 2, fire.height // 2 * 2)
        frames.append(np.asarray(Image.alpha_composite(black, fire).resize(even)))
    write_video(folder / "clips/fire.mp4", frames, "libx264", "yuv420p", {"crf": "12"}, rate=24)
    for name, side in _SPRITES.items():
        y, x = np.mgrid[:side, :side] / side - 0.5
        inside = np.hypot(x, y) < 0.45
        colour = np.array([255, 255 - 4 * side, 32, 255]) * inside[..., None]
        for path in (folder / "icons" / f"{name}.png", folder / "ui" / f"{name}.png"):
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(colour.astype(np.uint8)).save(path)
    (folder / "my.j2").write_text(TEMPLATE)
    (folder / "game").mkdir()
    (folder / "game/project.godot").write_text("config_version=5\n")


def recipes_named(text: str) -> list[str]:
    """Return the names of the ready recipes that a script or a recipe names as files beside it."""
    named = set(re.findall(r"(\w+)\.yaml", text))
    return sorted(name for name in named if (shipped("recipes") / f"{name}.yaml").exists())


def whole_recipe(keys: dict[str, Any]) -> dict[str, Any]:
    """Return a recipe of a page; one that names no source is a part of a recipe for a campfire."""
    has_source = "extends" in keys or "source" in keys or "members" in keys.get("atlas", {})
    return keys if has_source else {"source": {"path": "samples/campfire"}, **keys}


def made_small(keys: dict[str, Any], height: int, frames: int) -> list[str]:
    """Return the options of a build of a recipe that make its fire small and short."""
    source = _fire(keys)
    if source is None:
        return []
    has_size = source.get("kind") in _SIMULATED and not source.keys() & {"width", "height"}
    size = "source.size=draft" if has_size else f"source.height={height}"
    return _set(size, f"timeline.frames={frames}")


def made_tiny(keys: dict[str, Any], side: int, frames: int) -> list[str]:
    """Return the options of a build of a recipe that make it quick: its fire small, short, and
    simulated as coarsely as can be."""
    source = _fire(keys)
    if source is None:
        return []
    size = [f"source.height={side}", f"timeline.frames={frames}"]
    if source.get("kind", "frames") == "frames" and "grid" not in source:
        size.append(f"source.count={source.get('count', _CLIP)}")
    if source.get("kind") in _SIMULATED:
        size += ["source.size=null", "source.aspect=null", f"source.width={side}"]
    return _set(*size, *_SIMULATED.get(source.get("kind", ""), ()))


def _fire(keys: dict[str, Any]) -> dict[str, Any] | None:
    """Return the keys of a recipe's source, those of a ready recipe that it extends included; None
    if it is not of fire of its own."""
    kind = keys.get("source", {}).get("kind")
    if kind == "sprites" or ("source" not in keys and "extends" not in keys):
        return None
    extended = presets()[keys["extends"]] if keys.get("extends") in presets() else None
    ready = yaml.safe_load(extended.read_text(encoding="utf-8"))["source"] if extended else {}
    return {**ready, **keys.get("source", {})}


def _set(*changes: str) -> list[str]:
    return [word for change in changes for word in ("--set", change)]
