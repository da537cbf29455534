"""What a game does with a scene in Godot 4: lights it, fades it, enlarges it, moves its files."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.pixels import linear_to_srgb, srgb_to_linear
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.flipbook import godot as played_as_the_shader_does
from tests.support.flipbook import read_flipbook
from tests.support.godot4 import Godot4, picture

SIZE, AT, FRAME = (220, 260), (110, 220), 9
GROUND = (40, 60, 90)
FADED = {"premultiplied": "Color(0.5, 0.5, 0.5, 0.5)", "straight": "Color(1, 1, 1, 0.5)"}
HIDDEN = {
    "flame": {":self_modulate": "Color(0, 0, 0, 0)"},
    "flakes": {"Flakes:visible": "false"},
    "light": {"Light:visible": "false"},
}
"""Properties that hide a layer of a scene."""


def build(folder: Path, name: str, **keys: Any) -> None:
    """Build a small campfire with sparks of its own and a lamp."""
    folder.mkdir(parents=True, exist_ok=True)
    recipe: dict[str, Any] = {
        "source": {"path": str(shipped("samples") / "campfire"), "count": 16, "height": 150},
        "flakes": {"bake": False}, "tracks": ["json", "light"], "exports": ["json", "godot"],
    }  # fmt: skip
    (folder / f"{name}.yaml").write_text(json.dumps({**recipe, **keys}))
    assert main(["build", "-q", str(folder / f"{name}.yaml"), "-o", str(folder)]) == 0


def shot(name: str, *layers: str, **more: Any) -> dict[str, Any]:
    """Return the job that draws the ``layers`` of a scene over the ground."""
    hidden = [changed for layer, changed in HIDDEN.items() if layer not in layers]
    return {
        "do": "draw", "scene": f"res://{name}.tscn", "animation": name, "frame": FRAME,
        "at": AT, "background": "{:02x}{:02x}{:02x}".format(*GROUND),
        "set": {key: value for each in hidden for key, value in each.items()}, **more,
    }  # fmt: skip


def drawn(godot4: Godot4, folder: Path, jobs: list[dict[str, Any]]) -> list[NDArray[np.int64]]:
    return [picture(answer).astype(int) for answer in godot4.run(folder, jobs, SIZE)]


SKY = (168, 206, 204)


def test_by_day_thin_fire_does_not_darken_the_sky(godot4: Godot4, tmp_path: Path) -> None:
    """Premultiplied pages are the default for engines; ``cover: full`` is the cover of straight
    ones. Over black both are alike."""
    keys: dict[str, Any] = {"exports": ["godot"], "flakes": {"rate": 60}, "tracks": []}
    build(tmp_path, "thin", **keys)
    build(tmp_path, "full", **keys, atlas={"alpha": "premultiplied", "cover": "full"})
    grounds = ["{:02x}{:02x}{:02x}".format(*SKY), "000000"]
    jobs = [
        {**shot(name, *HIDDEN), "set": {}, "background": ground}
        for ground in grounds
        for name in ("thin", "full")
    ]
    thin, full, *black = drawn(godot4, tmp_path, jobs)
    assert np.abs(black[0] - black[1]).max() <= 1
    # Of light on black, coverage is what its brightest channel needs.
    faint = (black[1].max(axis=2) >= 5) & (black[1].max(axis=2) <= 64)
    assert faint.sum() > 500
    darker = [
        (luminance(each)[faint] < luminance(np.array(SKY)) - 1).mean() for each in (thin, full)
    ]
    assert darker[0] < 0.03
    assert darker[1] > 0.9


def luminance(shown: NDArray[np.int64]) -> NDArray[np.float64]:
    """Of sRGB in 0..255, on the same scale."""
    light = srgb_to_linear(shown / 255) @ np.array([0.2126, 0.7152, 0.0722])
    return np.asarray(255 * linear_to_srgb(light), np.float64)


@pytest.mark.parametrize("alpha", FADED)
def test_a_lamp_lights_the_ground_and_not_its_own_flame(
    alpha: str, godot4: Godot4, tmp_path: Path
) -> None:
    build(tmp_path, "fire", atlas={"alpha": alpha})
    # The ground is black, so that all light which the lamp adds would be the flame's.
    jobs = [
        {**shot("fire", *layers), "background": "000000"}
        for layers in (["flame", "light"], ["flame"])
    ]
    jobs += [shot("fire", "light"), shot("fire")]
    lit, unlit, ground_lit, ground = drawn(godot4, tmp_path, jobs)
    assert np.abs(lit - unlit).max() <= 1
    assert unlit.max() > 200
    assert (ground_lit - ground).max() > 20


@pytest.mark.parametrize("sprite", ["soft", "pixel"])
@pytest.mark.parametrize("alpha", FADED)
def test_flame_sparks_and_lamp_fade_alike(
    alpha: str, sprite: str, godot4: Godot4, tmp_path: Path
) -> None:
    # Few sparks: where two lie on each other, the one behind shows through the one that fades.
    flakes = {"bake": False, "sprite": sprite, "size": [0.02, 0.03], "rate": 5, "bursts": 0}
    build(tmp_path, "fire", atlas={"alpha": alpha}, flakes=flakes, timeline={"loop": "none"})
    layers = ("flame", "flakes", "light")
    jobs = []
    for layer in layers:
        job = shot("fire", layer)
        if layer != "light":
            job["background"] = "000000"
        jobs += [job, {**job, "set": {**job["set"], ":modulate": FADED[alpha]}}]
    ground, *seen = drawn(godot4, tmp_path, [shot("fire"), *jobs])
    # A lamp shows by what it adds to the ground.
    added = [each - (ground if i >= 4 else 0) for i, each in enumerate(seen)]
    kept = {}
    for i, layer in enumerate(layers):
        lit = added[2 * i] > 10  # half of 1 is shown as 1 too
        kept[layer] = added[2 * i + 1][lit].sum() / added[2 * i][lit].sum()
    assert kept["flame"] == pytest.approx(0.5, rel=0.02)
    assert kept["flakes"] == pytest.approx(kept["flame"], rel=0.02)
    assert kept["light"] == pytest.approx(kept["flame"], rel=0.02)


def test_a_lamp_fades_with_all_that_holds_its_scene(godot4: Godot4, tmp_path: Path) -> None:
    build(tmp_path, "fire", atlas={"alpha": "premultiplied"})
    jobs = [
        {"do": "read", "scene": "res://fire.tscn", "read": ["Light:color"], "set": changes}
        for changes in ({}, {"..:modulate": "Color(0.5, 0.25, 0.5, 1)"})
    ]
    full, faded = (answer["Light:color"] for answer in godot4.run(tmp_path, jobs))
    assert faded == pytest.approx([full[0] / 2, full[1] / 4, full[2] / 2, 1], abs=0.01)


def test_pixel_art_stays_sharp_when_it_is_enlarged(godot4: Godot4, tmp_path: Path) -> None:
    build(
        tmp_path, "fire",
        source={"path": str(shipped("samples") / "pixel_flame.png"),
                "grid": {"columns": 8, "rows": 1}, "sampling": "nearest"},
        flakes="none", motion_blur="none", tracks=[], timeline={"loop": "none"},
        atlas={"pivot": [0.5, 1]},
    )  # fmt: skip
    (seen,) = drawn(godot4, tmp_path, [{**shot("fire", *HIDDEN, zoom=3), "frame": 5}])
    atlas = read_atlas(tmp_path / "fire.json")
    frame, region = list(cut_frames(atlas))[5], atlas.frames[5]
    large = frame.repeat(3, axis=0).repeat(3, axis=1)
    expected = blend(large, GROUND, "straight", "srgb").astype(int)
    left, top = AT[0] - 3 * region.frame_width // 2, AT[1] - 3 * region.frame_height
    shown = seen[top : top + large.shape[0], left : left + large.shape[1]]
    assert np.abs(shown - expected[: len(shown)]).max() <= 1


@pytest.mark.parametrize(("alpha", "most"), [("premultiplied", 1), ("straight", 12)])
def test_pages_do_not_darken_when_they_are_enlarged(
    alpha: str, most: float, godot4: Godot4, tmp_path: Path
) -> None:
    """A filter on premultiplied light is the measure; without bleed, straight edges lose 40."""
    build(tmp_path, "fire", source={
        "path": str(shipped("samples") / "cartoon_flame.png"), "height": 70, "fps": 12,
        "grid": {"columns": 6, "rows": 4},
    }, flakes="none", motion_blur="none", tracks=[], atlas={"alpha": alpha})  # fmt: skip
    (seen,) = drawn(godot4, tmp_path, [shot("fire", *HIDDEN, zoom=3)])
    atlas = read_atlas(tmp_path / "fire.json")
    region, frame = atlas.frames[FRAME], list(cut_frames(atlas))[FRAME].astype(np.float32)
    if alpha == "straight":
        frame[..., :3] *= frame[..., 3:] / 255
    x, y, width, height = region.trim_x, region.trim_y, region.width, region.height
    large = cv2.resize(frame[y : y + height, x : x + width], (3 * width, 3 * height))
    expected = large[..., :3] + (1 - large[..., 3:] / 255) * GROUND
    pivot = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
    left, top = round(AT[0] + 3 * (x - pivot[0])), round(AT[1] + 3 * (y - pivot[1]))
    shown = seen[top : top + 3 * height, left : left + 3 * width]
    assert (expected[: len(shown)] - shown).max() <= most
    assert large[..., 3].max() == 255


def test_a_scene_may_be_moved_alone_or_with_all_its_files(godot4: Godot4, tmp_path: Path) -> None:
    for name in ("alone", "together"):
        build(
            tmp_path / name, name, atlas={"layout": "grid", "alpha": "premultiplied"},
            maps={"motion": "godot"},
        )  # fmt: skip
    before = [f"{name}/{name}{end}" for name in ("alone", "together") for end in ("", "_motion")]
    scene: dict[str, Any] = {"do": "draw", "at": AT, "background": "000000"}
    jobs = [{**scene, "scene": f"res://{path}.tscn"} for path in before]
    first = drawn(godot4, tmp_path, jobs)
    for ending in (".tscn", "_motion.tscn", "_motion.tres"):
        (tmp_path / "levels").mkdir(exist_ok=True)
        shutil.move(tmp_path / f"alone/alone{ending}", tmp_path / f"levels/alone{ending}")
    shutil.move(tmp_path / "together", tmp_path / "effects/fires")
    places = {"alone": "levels", "together": "effects/fires"}
    for job in jobs:
        folder, _, file = job["scene"].removeprefix("res://").partition("/")
        job["scene"] = f"res://{places[folder]}/{file}"
    for one, other in zip(first, drawn(godot4, tmp_path, jobs), strict=True):
        assert (one == other).all() and one.max() > 200


def test_every_reference_has_a_uid_and_every_script_and_shader_states_its_own(
    tmp_path: Path,
) -> None:
    build(tmp_path, "fire", atlas={"layout": "grid"}, maps={"motion": "godot"})
    referred = set()
    for path in tmp_path.glob("*.t*"):
        for line in re.findall(r"^\[ext_resource .*\]$", path.read_text(), re.MULTILINE):
            uid, file = re.findall(r'uid="(uid://\w+)" path="(.*?)"', line)[0]
            if file.endswith((".gd", ".gdshader")):
                assert (tmp_path / f"{file}.uid").read_text() == f"{uid}\n"
                referred.add(file)
    assert referred == {
        path.name for path in tmp_path.iterdir() if path.suffix in (".gd", ".gdshader")
    }  # fmt: skip
    assert len(referred) == 6


def test_scripts_name_every_type_and_need_no_3d(tmp_path: Path) -> None:
    """The runtime is a release build, which has no warnings: what a strict project refuses is
    looked for in the text."""
    build(tmp_path, "fire")
    scripts = {path.name: path.read_text() for path in tmp_path.glob("*.gd")}
    assert len(scripts) == 4
    for text in scripts.values():
        assert "QuadMesh" not in text
        declared = re.findall(r"\b(?:var|const) \w+(.*)", text)
        assert all(rest.startswith((": ", " := ")) for rest in declared)
        for arguments, result in re.findall(r"^func \w+\((.*?)\)(.*):$", text, re.M | re.S):
            assert result.startswith(" -> ")
            assert all(": " in each for each in arguments.split(", ") if each)


def test_the_editor_shows_sparks_and_saves_none_of_them(godot4: Godot4, tmp_path: Path) -> None:
    build(tmp_path, "fire")
    for script in ("fire_flakes.gd", "fire_flake_tracks.gd"):
        assert (tmp_path / script).read_text().startswith("@tool\n")
    (saved,) = godot4.run(tmp_path, [{"do": "saved", "scene": "res://fire.tscn"}])
    assert {"material", "script", "tracks"} <= set(saved["Flakes"])
    assert "multimesh" not in saved["Flakes"]


@pytest.mark.parametrize("alpha", FADED)
def test_a_flipbook_scene_plays_along_its_vectors_and_fades_once(
    alpha: str, godot4: Godot4, tmp_path: Path
) -> None:
    build(
        tmp_path, "fire", flakes="none", maps={"motion": "godot"}, tracks=[],
        atlas={"layout": "grid", "alpha": alpha, "pivot": "bottom"},
    )  # fmt: skip
    still: dict[str, Any] = {
        "do": "draw",
        "scene": "res://fire_motion.tscn",
        "at": AT,
        "background": "000000",
    }
    times = [3.0, 3.5, 7.25]
    stopped = [
        {"Player:active": "false", ":material:shader_parameter/frame": str(t)} for t in times
    ]
    jobs = [{**still, "set": changes} for changes in stopped]
    jobs.append({**still, "set": {**stopped[1], ":modulate": FADED[alpha]}})
    *seen, faded = drawn(godot4, tmp_path, jobs)
    book = read_flipbook(tmp_path, "fire")
    for time, each in zip(times, seen, strict=True):
        cell = played_as_the_shader_does(book, int(time), time % 1, straight=alpha == "straight")
        part = book.frame_part(cell)[..., :3]
        entry = next(iter(json.loads((tmp_path / "fire.json").read_text())["frames"].values()))
        trim, size = entry["spriteSourceSize"], entry["sourceSize"]
        x, y = AT[0] - size["w"] // 2 + trim["x"], AT[1] - size["h"] + trim["y"]
        shown = each[y : y + part.shape[0], x : x + part.shape[1]]
        assert np.abs(shown - part).max() <= 4
        assert part.max() > 200
    assert faded.sum() / seen[1].sum() == pytest.approx(0.5, rel=0.02)


def test_a_flipbook_scene_plays_in_time_and_each_for_itself(godot4: Godot4, tmp_path: Path) -> None:
    build(
        tmp_path, "fire", flakes="none", maps={"motion": "godot"}, tracks=[],
        atlas={"layout": "grid", "alpha": "premultiplied"},
    )  # fmt: skip
    read = {"do": "read", "scene": "res://fire_motion.tscn"}
    frame, playing = ":material:shader_parameter/frame", "Player:current_animation"
    jobs = [{**read, "read": [frame, playing], "ticks": ticks} for ticks in (1, 31)]
    one, later = godot4.run(tmp_path, jobs)
    assert one[playing] == "fire"
    fps = json.loads((tmp_path / "fire.json").read_text())["meta"]["fireAtlas"]["fps"]
    count = len(json.loads((tmp_path / "fire.json").read_text())["frames"])
    assert (later[frame] - one[frame]) % count == pytest.approx(30 / 60 * fps % count, abs=0.01)
