"""The lamp of a scene, in the engine, shines as the light of the tracks does."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.sheet import State, StateGraph
from fire_atlas.cli import main
from fire_atlas.core.pixels import linear_to_srgb
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.engines.godot.lamp import lamp_of
from tests.support.godot4 import Godot4


def built(folder: Path, **keys: Any) -> Path:
    folder.mkdir()
    (folder / "fire.yaml").write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "height": 90, "fps": 24},
        "tracks": ["light"], "exports": ["json", "godot"], **keys,
    }))  # fmt: skip
    assert main(["build", "-q", str(folder / "fire.yaml"), "-o", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("scale", ["", "@0.5x"])
def test_the_lamp_shines_as_the_light_does(godot4: Godot4, tmp_path: Path, scale: str) -> None:
    folder = built(tmp_path / "game", atlas={"scales": [1, 0.5]})
    light = json.loads((folder / "fire.light.json").read_text())
    (entry, *_) = json.loads((folder / "fire.json").read_text())["frames"].values()
    width, height = entry["sourceSize"]["w"], entry["sourceSize"]["h"]
    pivot = entry["anchor"]["x"] * width, entry["anchor"]["y"] * height
    size = 0.5 if scale else 1.0
    wanted = np.array([
        [f["intensity"], *linear_to_srgb(np.array([f["r"], f["g"], f["b"]])), 1,
         (f["x"] - pivot[0]) * size, (f["y"] - pivot[1]) * size]
        for f in light["frames"]
    ])  # fmt: skip
    count = len(wanted)
    times = [*range(count), 0.5, count - 0.5, count + 2]
    job = {"do": "seek_light", "scene": f"res://fire{scale}.tscn", "animation": "fire"}
    seen = np.array(godot4.run(folder, [{**job, "times": times}])[0])
    between = [(wanted[0] + wanted[1]) / 2, (wanted[-1] + wanted[0]) / 2, wanted[2]]
    assert seen == pytest.approx(np.concatenate([wanted, between]), abs=0.01)


def test_animations_that_lead_to_one_another_are_lit_by_one_measure() -> None:
    def light(strength: float) -> ClipLight:
        return ClipLight(24, 60, 60, True, (FrameLight(np.full(3, strength), 30, 30, 1800),))

    lights = {"wind_0": light(1), "wind_1": light(2)}
    pivots = dict.fromkeys(lights, (0.0, 0.0))
    graph = StateGraph((State("wind_0", wind=0), State("wind_1", wind=3)), ())
    alone, led = lamp_of(lights, pivots, "srgb"), lamp_of(lights, pivots, "srgb", graph)
    assert [row[0] for row in alone.rows] == [1, 1]
    assert [row[0] for row in led.rows] == [1, 2]


def test_a_scene_has_a_lamp_only_where_light_was_asked_for(tmp_path: Path) -> None:
    lit = (built(tmp_path / "lit") / "fire.tscn").read_text()
    dark = built(tmp_path / "dark", tracks=["json"])
    assert 'type="PointLight2D"' in lit
    assert "PointLight2D" not in (dark / "fire.tscn").read_text()
    assert not (dark / "fire_light.gd").exists()
