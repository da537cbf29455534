"""The material that plays a grid along its motion vectors."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.support.repo import Repo


def built(folder: Path, motion: str = "godot", **atlas: Any) -> Path:
    folder.mkdir()
    (folder / "fire.yaml").write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "height": 80, "fps": 24},
        "flakes": "none", "exports": ["json", "godot"],
        "atlas": {"layout": "grid", **atlas}, "maps": {"motion": motion},
    }))  # fmt: skip
    assert main(["build", "-q", str(folder / "fire.yaml"), "-o", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("scale", ["", "@0.5x"])
def test_the_material_is_set_as_the_json_says(tmp_path: Path, scale: str) -> None:
    folder = built(tmp_path / "game", scales=[1, 0.5], alpha="premultiplied")
    atlas = (folder / f"fire{scale}.json").read_text()
    stated = json.loads(atlas)["meta"]
    (motion,) = (each for each in stated["maps"] if each["kind"] == "motion")
    material = (folder / f"fire{scale}_motion.tres").read_text()
    set_to = dict(re.findall(r"^shader_parameter/(\w+) = (.*)$", material, re.MULTILINE))
    assert float(set_to["scale"]) == pytest.approx(motion["scale"], abs=1e-5)
    places = [each["frame"] for each in json.loads(atlas)["frames"].values()]
    columns, rows = (len({place[axis] for place in places}) for axis in "xy")
    assert set_to["cells"] == f"Vector2({columns}, {rows})"
    assert float(set_to["frame_count"]) == 48
    assert (set_to["loops"], set_to["straight_alpha"]) == ("true", "false")
    uniforms = re.findall(
        r"^uniform \w+ (\w+)", (folder / "fire_motion.gdshader").read_text(), re.M
    )
    assert set(set_to) == set(uniforms)


def test_vectors_are_imported_as_data_and_found_by_their_uid(tmp_path: Path) -> None:
    folder = built(tmp_path / "game")
    settings = (folder / "fire.motion.png.import").read_text()
    assert "process/fix_alpha_border=false" in settings
    (uid,) = re.findall(r'^uid="(.*)"$', settings, re.MULTILINE)
    assert f'uid="{uid}" path="fire.motion.png"' in (folder / "fire_motion.tres").read_text()


_CLIP = {"path": str(shipped("samples") / "campfire"), "height": 120, "fps": 24}


@pytest.mark.parametrize(
    ("keys", "advice"),
    [
        ({}, "set atlas.layout: grid"),
        ({"atlas": {"layout": "grid", "max_size": 320}}, "a larger atlas.max_size"),
        ({"atlas": {"layout": "grid"}}, None),
        ({"exports": ["json"]}, None),
        ({"maps": {"motion": "none"}}, None),
    ],
)
def test_the_build_says_what_a_scene_for_the_vectors_needs(
    tmp_path: Path, keys: dict[str, Any], advice: str | None
) -> None:
    repo = Repo(tmp_path / "repo")
    keys = {"flakes": "none", "exports": ["godot"], "maps": {"motion": "godot"}, **keys}
    ran = repo.run("build", repo.recipe(source=_CLIP, **keys))
    assert ran.code == 0
    assert ("maps.motion: no fire_motion.tscn" in ran.err) == (advice is not None)
    assert advice is None or advice in ran.err
    is_played = advice is None and keys["exports"] == ["godot"] and keys["maps"]["motion"] != "none"
    assert (repo.build / "fire_motion.tscn").exists() == is_played


def test_other_engines_vectors_have_no_material(tmp_path: Path) -> None:
    folder = built(tmp_path / "game", motion="unity")
    assert (folder / "fire.motion.png.import").exists()
    assert not list(folder.glob("*_motion.*"))
