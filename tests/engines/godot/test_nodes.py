"""The nodes of the add-on, in the engine: what they show while a game changes them."""

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.godot4 import Godot4, picture

SIZE = (160, 160)
GROUND = (40, 60, 90)
FRAME = 5

Picture = NDArray[np.int64]


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the add-on and a clip's fire: with sparks of its own, and baked twice, once
    with half their light."""
    folder = tmp_path_factory.mktemp("nodes")
    (folder / "project.godot").write_text("config_version=5\n")
    assert main(["plugin", "godot", str(folder), "-q"]) == 0
    shutil.copy(Path(__file__).with_name("nodes.gd"), folder)
    source = {"path": str(shipped("samples") / "campfire"), "count": 12, "fps": 24, "height": 120}
    changes: dict[str, dict[str, Any]] = {
        "fire": {"bake": False}, "baked": {}, "dimmed": {"intensity": 0.25},
    }  # fmt: skip
    for name, keys in changes.items():
        # Sparks so large and dim that it does not show how coarse the halos of our own frames are.
        sparks = {"rate": 40, "size": [0.08, 0.12], "intensity": 0.5, "bursts": 0, **keys}
        build(folder, name, {
            "source": source, "flakes": sparks, "timeline": {"loop": "none"},
            "atlas": {"alpha": "premultiplied", "pivot": [0.5, 1]}, "tracks": ["light"],
            "exports": ["json", "godot"],
        })  # fmt: skip
    return folder


@pytest.fixture(scope="module")
def torch(game: Path) -> Path:
    """The project, with the ready windy torch from four sides, small and short."""
    keys = {
        "views.count": 4, "views.elevation": 20, "timeline.frames": 6, "source.height": 80,
        "flakes.bake": "false", "flakes.rate": 30, "atlas.alpha": "premultiplied",
        "exports": "[json, godot]",
        "tracks": "[json, light]",
        "atlas.mesh": "{vertices: 8}",  # which sprites in space draw as rectangles
    }  # fmt: skip
    recipe = shipped("recipes") / "windy_torch.yaml"
    line = ["build", "-q", "--jobs", "1", str(recipe), "-o", str(game)]
    assert main([*line, *(w for k, v in keys.items() for w in ("--set", f"{k}={v}"))]) == 0
    return game


def build(folder: Path, name: str, recipe: Mapping[str, Any]) -> None:
    (folder / f"{name}.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(folder / f"{name}.yaml"), "-o", str(folder)]) == 0


def over(window: Picture, atlas: AtlasFile, frame: int, at: tuple[float, float]) -> Picture:
    """Return a window with a frame over it, whose own (0, 0) is at a place of it."""
    x, y = round(at[0]), round(at[1])
    assert (x, y) == pytest.approx(at, abs=0.01)
    layer = np.zeros((*window.shape[:2], 4))
    cell = list(cut_frames(atlas))[frame].astype(float)
    if atlas.sheet.alpha == "straight":
        cell[..., :3] *= cell[..., 3:] / 255
    top, left = max(-y, 0), max(-x, 0)
    seen = cell[top : window.shape[0] - y, left : window.shape[1] - x]
    layer[y + top : y + top + seen.shape[0], x + left : x + left + seen.shape[1]] = seen
    return np.rint(layer[..., :3] + window * (1 - layer[..., 3:] / 255)).astype(int)


def ground(colour: tuple[int, int, int] = (0, 0, 0)) -> Picture:
    return np.tile(np.array(colour), (SIZE[1], SIZE[0], 1))


def corner(atlas: AtlasFile, frame: int, at: tuple[float, float]) -> tuple[float, float]:
    """Return where a frame's own (0, 0) is if its pivot is at a place."""
    region = atlas.frames[frame]
    x, y = region.anchor
    return at[0] - x * region.frame_width, at[1] - y * region.frame_height


def asked(ask: str, scene: str, **keys: Any) -> dict[str, Any]:
    """Return the job of a function of ``nodes.gd``."""
    job = {"do": "ask", "script": "res://nodes.gd", "ask": ask, "scene": f"res://{scene}.tscn"}
    return {**job, "background": "000000", **keys}


def test_a_fire_shows_what_a_game_sets_while_it_burns(game: Path, godot4: Godot4) -> None:
    at, still = (80, 150), {"playing": "false"}
    faded, whole = "Color(0.5, 0.5, 0.5, 0.5)", "Color(1, 1, 1, 1)"
    steps: dict[str, list[dict[str, Any]]] = {
        "fire_film": [
            {"set": still, "seek": FRAME},
            {"set": {"sparks_brightness": "0.5"}},
            {"set": {"sparks_shown": "false"}},
            {"set": {"modulate": faded}},
            {"set": {"modulate": whole, "playing": "true"}, "seek": 0, "ticks": 5},
            {"set": {"speed_scale": "2.0"}, "seek": 0, "ticks": 5},
            {"ticks": 20},
        ],
        "fire": [
            {"set": {**still, "sparks_shown": "false", "lamp_shines": "false"}, "seek": FRAME},
            {"set": {"lamp_shines": "true", "lamp_energy": "2.0"}},
            {"set": {"lamp_energy": "1.0"}},
        ],
    }  # fmt: skip
    jobs = [asked("change", scene, at=at, steps=each) for scene, each in steps.items()]
    jobs[1]["background"] = "{:02x}{:02x}{:02x}".format(*GROUND)
    film, plain = godot4.run(game, jobs, SIZE)
    atlases = {name: read_atlas(game / f"{name}.json") for name in ("fire", "baked", "dimmed")}

    def page(name: str, time: float = FRAME, behind: tuple[int, int, int] = (0, 0, 0)) -> Picture:
        atlas = atlases[name]
        return over(ground(behind), atlas, int(time), corner(atlas, 0, at))

    states = [state for _, state in film]
    slow, fast = states[4]["time"], states[5]["time"]
    wanted = [page("baked"), page("dimmed"), page("fire"), page("fire") // 2]
    wanted += [page("fire", slow), page("fire", fast)]
    for (answer, _), expected in zip(film, wanted, strict=False):
        assert np.abs(picture(answer).astype(int) - expected).max() <= 2
        assert expected.max() > 100
    assert (slow, fast) == (pytest.approx(6 * 24 / 60), pytest.approx(2 * 6 * 24 / 60))
    assert [state["ended"] for state in states] == [0, 0, 0, 0, 0, 0, 1]
    assert [state["playing"] for state in states[3:]] == [False, True, True, False]

    dark, double, single = (picture(answer).astype(int) for answer, _ in plain)
    assert np.abs(dark - page("fire", behind=GROUND)).max() <= 2
    assert np.abs((double - dark) - 2 * (single - dark)).max() <= 2
    assert (single - dark).max() > 15


def test_animations_change_and_ten_fires_burn_and_leave_nothing(
    torch: Path, godot4: Godot4
) -> None:
    """Each of ten shows its own moment; when they are freed, no object is left."""
    still = {"playing": "false", "sparks_shown": "false"}
    steps = [
        {"set": still, "seek": 2},
        {"set": {"animation": '&"view_2"'}, "seek": 3},
        {"set": {"playing": "true"}, "ticks": 40},
    ]
    times, apart, first = [0, 1, 2, 3, 4, 5, 4, 3, 2, 1], 13, (20, 150)
    (one, two, later), (ten, before, after) = godot4.run(
        torch,
        [asked("change", "windy_torch", at=(80, 150), steps=steps),
         asked("make_and_free", "windy_torch", times=times, apart=apart, at=first)],
        SIZE,
    )  # fmt: skip
    atlas = read_atlas(torch / "windy_torch.json")
    frames = {each.name: each.frames for each in atlas.sheet.animations}
    names = [frame.name for frame in atlas.frames]
    for (answer, state), view, moment in ((one, "view_0", 2), (two, "view_2", 3)):
        frame = names.index(frames[view][moment])
        wanted = over(ground(), atlas, frame, corner(atlas, frame, (80, 150)))
        assert np.abs(picture(answer).astype(int) - wanted).max() <= 2
        assert state["animation"] == view
    assert later[1]["looped"] == 2 and later[1]["playing"]
    wanted = ground()
    for i, moment in enumerate(times):
        frame, at = names.index(frames["view_0"][moment]), (first[0] + i * apart, first[1])
        wanted = over(wanted, atlas, frame, corner(atlas, frame, at))
    assert np.abs(picture(ten).astype(int) - wanted).max() <= 2
    assert after == before and before[3] == 0


def test_a_camera_walks_round_a_fire(torch: Path, godot4: Godot4) -> None:
    """Each view that it sees is the nearest, at the fire's foot and in its size; sparks stay."""
    pixel, time, elevation, turned = 0.01, 2, math.radians(20), 0.7
    azimuths = [math.radians(degrees) for degrees in range(-40, 330, 24)]
    azimuths += [math.radians(90 * k) for k in range(4)]
    job = asked(
        "walk", "windy_torch", azimuths=azimuths, elevation=elevation, time=time, turned=turned,
        height=SIZE[1] * pixel,
    )  # fmt: skip
    (walked,) = godot4.run(torch, [job], SIZE)
    atlas = read_atlas(torch / "windy_torch.json")
    frames = {each.name: each.frames for each in atlas.sheet.animations}
    names = [frame.name for frame in atlas.frames]
    tracks = [
        json.loads((torch / f"windy_torch.view_{k}.flakes.json").read_text()) for k in range(4)
    ]
    origins = [each["camera"]["origin"] for each in tracks]
    middle, places = np.array(SIZE) / 2, walked["steps"][0]["places"]
    for azimuth, step in zip(azimuths, walked["steps"], strict=True):
        nearest = round(math.degrees(azimuth) / 90) % 4
        assert step["view"] == f"view_{nearest}"
        frame = names.index(frames[step["view"]][time])
        x, y = middle - origins[nearest]
        shown = picture(step["picture"]).astype(int)
        # This renderer converts colours in space by an approximation; a px beside is 100 of 255.
        assert np.abs(shown - over(ground(), atlas, frame, (x, y))).max() <= 8
        assert shown.max() > 200
        assert np.abs(np.array(step["places"]) - places).max() < 1e-5
    for origin, each, step in zip(origins, tracks, walked["steps"][-4:], strict=True):
        rows = np.array(each["frames"][time]["rows"])
        column = {name: rows[:, i] for i, name in enumerate(each["columns"])}
        stated = np.stack([column["x"], column["y"]], axis=1) - origin + middle
        assert len(stated) > 10 and np.abs(np.array(step["seen"]) - stated).max() < 0.1

    lights = [
        json.loads((torch / f"windy_torch.view_{k}.light.json").read_text())["frames"][time]
        for k in range(4)
    ]
    energies = [light["intensity"] for light in lights]
    assert walked["energy"] == pytest.approx(3 * np.mean(energies), rel=1e-3)
    right, up, front = np.array(walked["lamp"]) / pixel
    off = [np.array([f["x"], f["y"]]) - at for f, at in zip(lights, origins, strict=True)]
    assert right == pytest.approx((off[0][0] - off[2][0]) / 2, abs=0.02)
    assert front == pytest.approx((off[3][0] - off[1][0]) / 2, abs=0.02)
    assert up * math.cos(elevation) == pytest.approx(-np.mean([y for _, y in off]), abs=0.02)


@pytest.mark.parametrize("alpha", ["premultiplied", "straight"])
def test_in_space_fire_is_blended_as_its_pages_are_though_a_shader_draws_its_smoke(
    game: Path, godot4: Godot4, alpha: str
) -> None:
    source = {"path": str(shipped("samples") / "explosion"), "count": 8, "fps": 24, "height": 120}
    build(game, f"smoky_{alpha}", {
        "source": source, "flakes": "none", "timeline": {"loop": "none"}, "tracks": [],
        "atlas": {"alpha": alpha, "pivot": [0.5, 0.5]}, "maps": {"smoke": True},
        "exports": ["json", "godot"],
    })  # fmt: skip
    job = asked("front", f"smoky_{alpha}", time=FRAME, height=SIZE[1] * 0.01)
    shot, warnings = godot4.run(game, [job], SIZE)[0]
    assert warnings == [
        "In space the fire is shown without its smoke: build it without maps.smoke."
    ]
    atlas = read_atlas(game / f"smoky_{alpha}.json")
    atlas = replace(atlas, sheet=replace(atlas.sheet, maps=()))  # the page alone, without its smoke
    at = corner(atlas, FRAME, (SIZE[0] / 2, SIZE[1] / 2))
    shown = picture(shot).astype(int)
    wanted = over(ground(shown[0, 0]), atlas, FRAME, at)
    assert wanted.max() > 150
    assert np.abs(shown - wanted).max() <= 8
