"""The bound on the memory of simulated fire: what is refused, and that builds stay below it."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.generators.fluid.memory import MAX_MEMORY, memory_of
from fire_atlas.generators.fluid.scene import build_scene
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.tree import read_tree

_BUILD = """
import resource, sys
from fire_atlas.cli import main
assert main(sys.argv[1:]) == 0
unit = 1 if sys.platform == "darwin" else 1024
for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
    print(resource.getrusage(who).ru_maxrss * unit)
"""


def written(folder: Path, source: dict[str, Any], **blocks: Any) -> Path:
    """Write a recipe of simulated fire in which ``source`` is on line 2, and return its path."""
    path = folder / "fire.yaml"
    keys = {"source": {"kind": "fluid", **source}, **blocks}
    lines = [f"{key}: {json.dumps(value)}" for key, value in keys.items()]
    path.write_text("\n".join(["version: 1", *lines]), encoding="utf-8")
    return path


def needed(path: Path) -> int:
    recipe = load_tree(read_tree(path)).recipe
    settings = GenerationSettings.of(recipe)
    source: Any = recipe.source
    return memory_of(source, build_scene(source, settings), settings).needed


def test_more_than_two_gigabytes_are_refused_with_the_resolution_that_would_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    boom = {"fire": "explosion", "width": 384, "height": 384, "resolution": 140}
    path = written(tmp_path, boom, timeline={"frames": 48})
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert f"{path}:2: source.resolution: 140 needs up to 2." in said
    assert "GB to be simulated and drawn, of 48 frames of 384x384 px; at most 2 GB" in said
    would_do = int(said.rsplit("as with ", 1)[1])
    assert main(["check", str(path), "--set", f"source.resolution={would_do}"]) == 0
    finer = f"source.resolution={would_do + 5}"
    assert main(["check", str(path), "--set", finer]) == 2


def test_if_frames_take_the_memory_the_size_that_would_do_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    many = {"fire": "torch", "width": 512, "height": 512, "resolution": 32}
    path = written(tmp_path, many, timeline={"frames": 48}, views={"count": 32})
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert f"{path}:2: source: needs up to" in said and "from 32 sides" in said
    width, height = said.split("as with frames of ")[1].split(" px")[0].split("x")
    smaller = "--set", f"source.width={width}", "--set", f"source.height={height}"
    assert main(["check", str(path), *smaller]) == 0


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (("source", "resolution"), 64), (("source", "width"), 256), (("timeline", "frames"), 24),
        (("views", "count"), 3), (("source", "detail"), 0.5),
    ],
)  # fmt: skip
def test_all_that_takes_memory_is_counted(
    key: tuple[str, str], value: float, tmp_path: Path
) -> None:
    keys: dict[str, dict[str, Any]] = {
        "source": {"width": 160, "height": 160, "resolution": 48},
        "timeline": {"frames": 12},
        "views": {"count": 2, "elevation": 20},
    }
    less = needed(written(tmp_path, **keys))
    keys[key[0]] = keys[key[0]] | {key[1]: value}
    more = needed(written(tmp_path, **keys))
    assert less < more < MAX_MEMORY or key == ("source", "detail")


def test_a_build_stays_below_its_bound(tmp_path: Path) -> None:
    boom = {"fire": "explosion", "width": 256, "height": 256, "resolution": 72, "smoke": 2}
    path = written(
        tmp_path, boom, timeline={"frames": 6, "fps": 12}, views={"count": 2, "elevation": 25},
        maps={"normals": True, "smoke": True},
    )  # fmt: skip
    recipe = load_tree(read_tree(path)).recipe
    settings, source = GenerationSettings.of(recipe), recipe.source
    memory = memory_of(source, build_scene(source, settings), settings)  # type: ignore[arg-type]
    line = [sys.executable, "-c", _BUILD, "build", str(path), "-q", "--jobs", "8"]
    done = subprocess.run(line, check=True, capture_output=True, text=True, cwd=tmp_path)
    building, simulating = map(int, done.stdout.split())
    print(f"{building / 1e6:.0f} and {simulating / 1e6:.0f} MB, {memory}")
    assert simulating <= memory.simulating
    assert building <= memory.kept + memory.drawing * min(8, memory.at_once)
    # A bound that is much too large would refuse what can be built.
    assert simulating >= 0.4 * memory.simulating
