"""A scene of fire in several winds, in the engine, passes from loop to loop as the graph says."""

import subprocess
import sysconfig
from pathlib import Path

import numpy as np

from fire_atlas.cli import main
from tests.support.godot4 import Godot4
from tests.support.wind import LEVELS, SILK, Walker, recipe_in

PARENT = """\
[gd_scene format=3]
[ext_resource type="PackedScene" path="res://fire.tscn" id="1"]
[node name="Fire" instance=ExtResource("1")]
wind = 4.0
"""
"""A user's scene, whose fire burns in a strong wind from the start."""


def test_it_walks_as_the_reference_does(godot4: Godot4, tmp_path: Path) -> None:
    recipe = recipe_in(tmp_path, SILK, exports=["json", "godot"], flakes={"bake": False})
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    game = tmp_path / "build"
    walker = Walker.of(game / "fire.json")
    (game / "parent.tscn").write_text(PARENT)
    winds = np.repeat(np.random.default_rng(2).choice(LEVELS, 14), 45)
    faster = {":speed_scale": "4.0"}  # 48 frames a second: each 1/60 s shows the same or the next
    walk = {"do": "change_wind", "scene": "res://fire.tscn", "set": faster, "winds": winds.tolist()}
    begin = {"do": "read", "scene": "res://parent.tscn", "read": [":animation"], "ticks": 5}
    film = {"do": "read", "scene": "res://fire_film.tscn", "read": ["Film/Fire:levels"]}
    walked, begun, in_film = godot4.run(game, [walk, begin, film])

    regions = dict(zip(walker.frames, walker.atlas.frames, strict=True))
    now, visited = (walked[0][0], walked[0][1]), list[str]()
    assert now == ("wind_0", 0)
    for wind, (animation, frame, region) in zip(winds, walked, strict=True):
        if (animation, frame) != now:
            now = walker.after(now, LEVELS.index(wind))
            assert (animation, frame) == now
        shown = regions[now]
        assert region == [shown.x, shown.y, shown.width, shown.height]
        visited.append(animation)
    changes = np.count_nonzero(np.array(visited[1:]) != np.array(visited[:-1]))
    assert changes >= 10 and set(visited) == {each.animation for each in walker.graph.states}
    assert begun == {":animation": "wind_2"}
    assert in_film == {"Film/Fire:levels": LEVELS}

    for program in ("gdparse", "gdlint"):
        tool = Path(sysconfig.get_path("scripts")) / program
        subprocess.run([tool, game / "fire_wind.gd"], check=True, capture_output=True)
