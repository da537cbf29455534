"""How well fires are lit and put out: the steps at every edge of the graphs, and what is left.

``python -m tools.bench.phases [NAME...]`` builds ready recipes that loop (those named, or all) and
real clips, small, without flakes, and prints of each: the largest step over an edge of its graph,
in the larger of the median steps of the animations on its two sides; the light that is left at the
end, of its burning light; and the part of the pixels on pages that entries take.
"""

import json
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

from fire_atlas.cli import main as fire_atlas
from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.tree import read_tree
from tests.support.clips import ALL_CLIPS
from tests.support.requirements import real_clips
from tests.support.wind import Walker


def settings_of(recipe: Path) -> list[str]:
    """Return what makes a ready recipe small, with phases."""
    source = load_tree(read_tree(recipe)).recipe.source
    changes = ["phases={ignite: 1, extinguish: 1.5}", "flakes=none", "exports=[json]", "tracks=[]"]
    if isinstance(source, SilkSource | FluidSource):
        changes += ["source.size=draft", "timeline.frames=24"]
    if isinstance(source, FluidSource):
        changes.append("source.resolution=draft")
    if isinstance(source, SilkSource):
        changes += ["source.rows=8", "source.columns=6"]
    return [*changes, "views.count=1"] if recipe.stem == "windy_torch" else changes


def figures(walker: Walker) -> tuple[float, str, float]:
    """Return the largest step at an edge, its edge, and the light that is left at the end."""
    medians = dict[str, float]()
    light = dict[str, list[float]]()
    for name in (each.name for each in walker.atlas.sheet.animations):
        count = walker.count(name)
        steps = [walker.step((name, i), (name, j)) for i, j in pairwise(range(count))]
        medians[name] = float(np.median(steps))
        light[name] = [float(walker.frames[name, i][..., :3].sum()) for i in range(count)]
    worst, edge = 0.0, ""
    for way in walker.graph.transitions:
        step = walker.step((way.before, way.frame), (way.after, way.entry))
        ratio = step / max(medians[way.before], medians[way.after], 1e-9)
        if ratio > worst:
            worst, edge = ratio, f"{way.before} {way.frame} to {way.after} {way.entry}"
    left = light["extinguish"][-1] / float(np.mean(light["burn"]))
    return worst, edge, left


def main() -> None:
    """Print the table."""
    chosen = sorted(shipped("recipes").glob("*.yaml"))
    if names := sys.argv[1:]:
        chosen = [each for each in chosen if each.stem in names]
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for clip in ALL_CLIPS:
            if not names or clip in names:
                source = {"path": str(real_clips() / clip / "frames"), "height": 160}
                chosen.append(work / f"{clip}.yaml")
                chosen[-1].write_text(json.dumps({"source": source}))
        for recipe in chosen:
            words = [word for each in settings_of(recipe) for word in ("--set", each)]
            if fire_atlas(["build", "-q", str(recipe), "-o", str(work / "out"), *words]):
                continue  # it does not loop, as the error says
            worst, edge, left = figures(Walker.of(work / "out" / f"{recipe.stem}.json"))
            manifest = json.loads((work / "out" / f"{recipe.stem}.manifest.json").read_text())
            entries = manifest["statistics"]["phases"]
            print(
                f"| {recipe.stem} | {worst:.2f} | {edge} | {left:.4f} | "
                f"{entries['entry_frames']} | {entries['entry_pixels']:.0%} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
