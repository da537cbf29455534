"""The real Godot 4.6 looks up the colours of pages of heat in their ramps."""

import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from tests.support.godot4 import Godot4, picture
from tests.support.heats import RAMPS, HeatFire, Values, built

FRAME, GROUND = 5, 64
SHADER = ":material:shader_parameter/"


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same fire in heat, in heat4, and as light that is added."""
    folder = tmp_path_factory.mktemp("heat")
    built(folder, "fire", exports=["json", "godot"])
    built(folder, "four", exports=["json", "godot"], atlas={"pixels": "heat4"})
    built(folder, "glow", exports=["json", "godot"], atlas={"alpha": "additive"})
    return folder


def job(folder: Path, name: str = "fire", frame: int = FRAME, **changes: str) -> dict[str, Any]:
    region = HeatFire(folder, name).frames[frame]
    x, y = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
    settings = {
        (f":{key}" if key in ("frame_progress", "modulate", "flip_h") else SHADER + key): value
        for key, value in changes.items()
    }
    return {
        "do": "draw", "scene": f"res://{name}.tscn", "animation": name, "frame": frame,
        "background": f"{GROUND:02x}" * 3, "at": [round(x), round(y)], "set": settings,
    }  # fmt: skip


def drawn(godot: Godot4, folder: Path, jobs: list[dict[str, Any]]) -> list[Values]:
    """Draw frames, each cut to the size of a whole frame."""
    region = HeatFire(folder).frames[0]
    answers = godot.run(folder, jobs, (128, 128))
    return [
        picture(each)[: region.frame_height, : region.frame_width].astype(float) for each in answers
    ]


def test_one_fire_burns_in_six_ramps(godot4: Godot4, game: Path) -> None:
    """Each within 2 of 255 of our own look-up, in heat and in four frames of a cell."""
    names = ("fire", "four", "glow")
    jobs = [job(game, name, row=str(row)) for name in names for row in range(len(RAMPS))]
    shots = drawn(godot4, game, jobs)
    for k, shot in enumerate(shots):
        fire, row = HeatFire(game, names[k // len(RAMPS)]), k % len(RAMPS)
        wanted = fire.shown(fire.heat(FRAME), row, GROUND)
        assert np.abs(shot - wanted).max() <= 2, (names[k // len(RAMPS)], RAMPS[row])
    first = shots[: len(RAMPS)]
    assert all(np.abs(a - b).max() > 60 for i, a in enumerate(first) for b in first[:i])


@pytest.mark.parametrize("name", ["fire", "four"])
def test_heat_is_cross_faded_and_not_colour(godot4: Godot4, game: Path, name: str) -> None:
    """From each frame to the next, also where the one is trimmed, and round the end of the loop."""
    fire = HeatFire(game, name)
    last = len(fire.frames) - 1
    steps = [(FRAME, 0.5), (3, 0.25), (last, 0.5)]
    jobs = [job(game, name, frame, frame_progress=str(by)) for frame, by in steps]
    for (frame, by), shot in zip(steps, drawn(godot4, game, jobs), strict=True):
        here, there = fire.heat(frame), fire.heat((frame + 1) % len(fire.frames))
        wanted = fire.shown(here + by * (there - here), ground=GROUND)
        assert np.abs(shot - wanted).max() <= 2, (frame, by)
        colours = fire.shown(here, ground=GROUND) * (1 - by) + fire.shown(there, ground=GROUND) * by
        assert np.abs(wanted - colours).max() > 20, "fading colours looks different"


def test_it_dies_as_heat_is_taken_away(godot4: Godot4, game: Path) -> None:
    fire, steps = HeatFire(game), (0.0, 0.25, 0.5, 0.75, 1.0)
    shots = drawn(godot4, game, [job(game, erosion=str(each)) for each in steps])
    for erosion, shot in zip(steps, shots, strict=True):
        wanted = fire.shown(np.maximum(fire.heat(FRAME) - erosion, 0), ground=GROUND)
        assert np.abs(shot - wanted).max() <= 2, erosion
    burning = [int((np.abs(shot - GROUND).max(axis=2) > 2).sum()) for shot in shots]
    assert burning == sorted(burning, reverse=True)
    assert burning[0] > 500
    assert burning[-1] == 0


def test_a_game_exchanges_the_ramp_tints_and_mirrors_it(godot4: Godot4, game: Path) -> None:
    fire = HeatFire(game)
    white = game / "white.tres"
    white.write_text(
        '[gd_resource type="GradientTexture1D" format=3]\n[sub_resource type="Gradient" id="1"]\n'
        "colors = PackedColorArray(0, 0, 0, 0, 1, 1, 1, 1)\n[resource]\n"
        'gradient = SubResource("1")\n'
    )
    jobs = [
        job(game, ramp='Resource("res://white.tres")'),
        job(game, modulate="Color(0.5, 0.5, 0.5, 0.5)"),
        job(game, flip_h="true"),
    ]
    grey, faded, mirrored = drawn(godot4, game, jobs)
    heat = fire.heat(FRAME)
    assert np.abs(grey - (255 * heat + (1 - heat) * GROUND)[..., None]).max() <= 2
    whole = fire.shown(heat, ground=GROUND)
    assert np.abs(faded - (whole + GROUND) / 2).max() <= 2
    assert np.abs(mirrored - whole[:, ::-1]).max() <= 2


def test_a_node_of_the_add_on_takes_a_ramp_and_lets_the_fire_die(
    godot4: Godot4, game: Path
) -> None:
    (game / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", "godot", str(game), "-q"]) == 0
    shutil.copy(Path(__file__).with_name("nodes.gd"), game)
    steps: list[dict[str, Any]] = [
        {"set": {"playing": "false"}, "seek": FRAME + 0.5},
        {"set": {"ramp_row": "3"}},
        {"set": {"erosion": "0.4"}},
        {"set": {"erosion": "0.0", "ramp": 'Resource("res://fire.ramp.png")', "ramp_row": "1"}},
    ]
    changed = job(game, "glow") | {"do": "ask", "script": "res://nodes.gd", "ask": "change"}
    ((first, _), (poison, _), (dying, _), (gas, _)) = godot4.run(
        game, [{**changed, "steps": steps}], (128, 128)
    )[0]
    glow, fire = HeatFire(game, "glow"), HeatFire(game)
    heat = (glow.heat(FRAME) + glow.heat(FRAME + 1)) / 2
    wanted = [
        glow.shown(heat, ground=GROUND),
        glow.shown(heat, 3, GROUND),
        glow.shown(np.maximum(heat - 0.4, 0), 3, GROUND),
        fire.shown(heat, 1, GROUND),
    ]
    for answer, each in zip((first, poison, dying, gas), wanted, strict=True):
        shot = picture(answer)[: each.shape[0], : each.shape[1]].astype(float)
        assert np.abs(shot - each).max() <= 2


def test_the_build_says_what_heat_has_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither meshes nor a film scene; and page and ramp are imported as they are."""
    built(tmp_path, exports=["godot"], flakes={"bake": False}, atlas={"mesh": {"vertices": 8}})
    assert "no meshes (the scene draws rectangles) and no fire_film.tscn" in capsys.readouterr().err
    assert not (tmp_path / "fire_film.tscn").exists()
    assert "MeshTexture" not in (tmp_path / "fire.tres").read_text()
    for image in ("fire.png", "fire.ramp.png"):
        settings = (tmp_path / f"{image}.import").read_text()
        for line in ("compress/mode=0", "mipmaps/generate=false", "process/fix_alpha_border=false"):
            assert line in settings


@pytest.mark.parametrize("program", ["gdparse", "gdlint"])
def test_its_script_is_sound(program: str, game: Path) -> None:
    tool = Path(sysconfig.get_path("scripts")) / program
    ran = subprocess.run([tool, game / "fire_heat.gd"], capture_output=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
