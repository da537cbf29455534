"""Clips and builds to measure: shared by the benchmarks."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import yaml

from fire_atlas.core.context import BuildOptions
from fire_atlas.core.progress import SilentProgress
from fire_atlas.core.shipped import shipped
from fire_atlas.pipeline.build import BuildReport, build
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.tree import read_tree


@dataclass(frozen=True, slots=True)
class Scene:
    """A row of Kim & Lee's Table 1: frames, side in px, flakes alive on average, s a frame."""

    number: int
    frames: int
    side: int
    flakes: int
    paper: float


TABLE_1 = (
    Scene(1, 299, 640, 58, 0.42),
    Scene(2, 13, 391, 8519, 0.14),
    Scene(3, 42, 400, 543, 0.12),
    Scene(4, 23, 500, 127, 0.18),
    Scene(5, 34, 415, 321, 0.12),
    Scene(6, 106, 500, 210, 0.18),
    Scene(7, 16, 512, 95, 0.21),
    Scene(8, 32, 600, 182, 0.37),
    Scene(9, 14, 600, 87, 0.62),
)


def make_clip(scene: Scene, folder: Path) -> Path:
    """Write the scene's frames: the sample campfire, enlarged, played again and again."""
    folder.mkdir(parents=True)
    samples = sorted((shipped("samples") / "campfire").glob("*.png"))
    for i in range(scene.frames):
        target = folder / f"{i:04}.png"
        if i >= len(samples):
            target.hardlink_to(folder / f"{i % len(samples):04}.png")
            continue
        image = cv2.imread(str(samples[i]), cv2.IMREAD_UNCHANGED)
        size = (scene.side, scene.side)
        assert image is not None
        cv2.imwrite(str(target), cv2.resize(image, size, interpolation=cv2.INTER_CUBIC))
    return folder


def make_recipe(clip: Path, rate: float, preset: str = "auto") -> Path:
    """Write a recipe for ``clip`` that bears ``rate`` flakes a second and writes no tracks."""
    keys: dict[str, Any] = {
        "source": {"path": clip.name, "fps": 24},
        "features": {"preset": preset},
        "flakes": {"rate": round(rate, 2), "bursts": 0, "max": 60000},
        "tracks": [],
        # Played once, as the paper does: every frame that is read is written.
        "timeline": {"loop": "none"},
    }
    recipe = clip.with_suffix(".yaml")
    recipe.write_text(yaml.safe_dump(keys), encoding="utf-8")
    return recipe


def run(recipe: Path, jobs: int) -> BuildReport:
    """Build ``recipe`` in this process."""
    out = recipe.parent / "build"
    options = BuildOptions(jobs, force=True)
    report = build(load_checked(read_tree(recipe)), out, options, SilentProgress())
    assert report is not None, "forced"
    return report


def alive(report: BuildReport) -> float:
    """Return how many flakes were alive in a frame on average."""
    return float(report.statistics["flakes"]["alive_mean"])


def rate_for(scene: Scene, clip: Path, jobs: int, preset: str = "auto") -> float:
    """Return the rate at which the scene has about as many flakes alive as in the paper."""
    rate = scene.flakes / 1.2
    for _ in range(4):
        found = alive(run(make_recipe(clip, rate, preset), jobs))
        if abs(found - scene.flakes) <= 0.1 * scene.flakes:
            break
        rate *= min(max(scene.flakes / max(found, 1e-3), 0.1), 10)
    return rate


def argument(position: int, default: int) -> int:
    return int(sys.argv[position]) if len(sys.argv) > position else default
