"""docs/phases.md: its lines of JavaScript follow the graph of a build."""

import json
import random
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.phases import MAX_EXIT
from tests.docs.markdown import code_blocks

FPS, STEPS = 12, 2500

RUN = """
const atlas = JSON.parse(require("fs").readFileSync(process.argv[2]));
const wishes = JSON.parse(process.argv[3]);
const fire = new PhasedFire(atlas);
console.log(JSON.stringify(wishes.map((burning) => {
  fire.burning = burning;
  return [fire.next(), fire.state, fire.frame];
})));
"""


def walked(folder: Path, phases: dict[str, Any], node: str) -> tuple[Any, list[bool], list[Any]]:
    """Build a small fire, and return its JSON, random wishes and what the lines show."""
    recipe = folder / "fire.yaml"
    source = {"path": str(shipped("samples") / "campfire"), "fps": 24, "height": 48}
    keys = {"source": source, "timeline": {"fps": FPS}, "phases": phases, "flakes": "none"}
    recipe.write_text(json.dumps(keys))
    assert main(["build", str(recipe), "-q"]) == 0
    atlas = folder / "build" / "fire.json"
    chance, wishes = random.Random(4), list[bool]()
    while len(wishes) < STEPS:
        wishes += [chance.random() < 0.5] * chance.randint(1, 45)
    script = folder / "walk.js"
    (lines,) = code_blocks("docs/phases.md", "js")
    script.write_text(lines + RUN)
    done = subprocess.run(
        [node, str(script), str(atlas), json.dumps(wishes)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(atlas.read_text()), wishes, json.loads(done.stdout)


@pytest.mark.parametrize(
    "phases", [{"ignite": 0.5, "extinguish": 0.8}, {"ignite": "none", "extinguish": 0.8}]
)
def test_the_lines_follow_the_graph(phases: dict[str, Any], node: str, tmp_path: Path) -> None:
    atlas, wishes, shown = walked(tmp_path, phases, node)
    ways = {
        (way["from"], way["frame"], way["to"], way["entry"])
        for way in atlas["meta"]["states"]["transitions"]
    }
    last = {name: len(frames) - 1 for name, frames in atlas["animations"].items()}
    first = "ignite" if "ignite" in last else "burn"
    now, waited, visited = ("burn", 0), 0, set[str]()
    for burning, (name, *then) in zip(wishes, shown, strict=True):
        state, frame = now
        goes_on = (state, (frame + 1) % (last[state] + 1))
        is_end = state == "extinguish" and frame == last[state]
        follows = [(after, entry) for s, f, after, entry in ways if (s, f) == now]
        if is_end:
            assert tuple(then) == ((first, 0) if burning else now)
            assert (name is None) == (not burning)
        elif follows and (state != "burn" or not burning):
            assert tuple(then) in follows
        else:
            assert tuple(then) == goes_on
        if name is not None:
            assert name == atlas["animations"][then[0]][then[1]]
        waited = waited + 1 if then[0] == "burn" and not burning else 0
        assert waited <= MAX_EXIT * FPS
        now = (then[0], then[1])
        visited.add(then[0])
    assert visited == {*last}


def test_without_an_end_the_fire_is_out_at_once(node: str, tmp_path: Path) -> None:
    _, wishes, shown = walked(tmp_path, {"extinguish": "none"}, node)
    assert all(
        (name is None) == (not burning) for burning, (name, *_) in zip(wishes, shown, strict=True)
    )
