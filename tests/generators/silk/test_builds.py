"""Whole builds of silk, and recipes that cannot be built."""

import io
import json
import math
from collections import defaultdict
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.formats.tracks.tracks_json import read_tracks
from tests.generators.silk.small_fires import COARSE
from tests.support.effect import ID, SIZE, VX, VY, X, Y

SILK: dict[str, Any] = {"kind": "silk", **COARSE, "sheets": {"count": 2}}


def recipe(folder: Path, source: dict[str, Any], **keys: Any) -> Path:
    path = folder / "torch.yaml"
    document = {"source": source, "timeline": {"frames": 6}, **keys}
    # JSON is YAML, but for how it spells what is not a number.
    path.write_text(json.dumps(document).replace("NaN", ".nan"), encoding="utf-8")
    return path


def built(path: Path, out: Path, *arguments: str) -> dict[str, bytes]:
    assert main(["build", str(path), "-q", "-o", str(out), *arguments]) == 0
    return {file.name: file.read_bytes() for file in out.iterdir()}


def refused(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["build", str(path), "-q", "-o", str(path.parent / "out")]) != 0
    assert not list(path.parent.glob("out/*"))
    message = capsys.readouterr().err
    assert "Traceback" not in message
    return message


def test_each_side_is_an_animation_that_loops_with_flakes(tmp_path: Path) -> None:
    files = built(recipe(tmp_path, SILK, views={"count": 3, "elevation": 15}), tmp_path / "out")
    atlas = json.loads(files["torch.json"])
    assert set(atlas["animations"]) == {f"view_{k}" for k in range(3)}
    assert f"torch/view_2/{5:04}" in atlas["frames"]
    assert len(atlas["frames"]) == 18
    for k in range(3):
        tracks = json.loads(files[f"torch.view_{k}.flakes.json"])
        assert tracks["loop"] is True
        assert tracks["frame_count"] == 6


def test_one_side_has_the_recipes_own_name(tmp_path: Path) -> None:
    files = built(recipe(tmp_path, SILK, flakes="none"), tmp_path / "out")
    assert "torch/0005" in json.loads(files["torch.json"])["frames"]


def test_no_two_flakes_born_together_share_speed_size_and_path(tmp_path: Path) -> None:
    """A tongue's tip is where most are born, on any of its sheets; the same gas carries them."""
    flakes = {"rate": 80, "bursts": 0, "size": [0.006, 0.02]}
    source = {**SILK, "width": 96, "height": 128, "sheets": {"count": 5, "spread": 0.1}}
    path = recipe(tmp_path, source, flakes=flakes, timeline={"frames": 24}, tracks=["json"])
    built(path, tmp_path / "out")
    tracks = read_tracks(tmp_path / "out" / "torch.flakes.json")
    assert tracks is not None
    flights = defaultdict[float, dict[int, Any]](dict)
    for i, rows in enumerate(tracks.frames):
        for row in rows:
            flights[row[ID]][i] = row
    born = {spawn[0]: spawn for spawn in tracks.spawns}
    together = alike = 0
    for one, other in combinations(sorted(flights), 2):
        (t, x, y), (u, v, w) = (born[flake][[1, 3, 4]] for flake in (one, other))
        both = sorted(flights[one].keys() & flights[other].keys())
        if abs(t - u) * 24 > 2.5 or math.hypot(x - v, y - w) > 5 or len(both) < 3:
            continue
        together += 1
        a, b = (np.array([flights[flake][i] for i in both]) for flake in (one, other))
        apart = np.hypot(*(a - b)[:, [X, Y]].T).max() / 128
        speeds = (np.hypot(*rows[:, [VX, VY]].T).mean() for rows in (a, b))
        ratios = math.log(next(speeds) / next(speeds)), math.log(a[0, SIZE] / b[0, SIZE])
        alike += apart < 0.05 and np.abs(ratios).max() < 0.3
    assert len(born) > 60
    assert together < 0.1 * len(born)
    assert alike == 0


@pytest.mark.slow
def test_the_same_recipe_gives_the_same_bytes_at_any_worker_count(tmp_path: Path) -> None:
    path = recipe(tmp_path, SILK, views={"count": 2})
    one = built(path, tmp_path / "one", "--jobs", "1")
    assert built(path, tmp_path / "three", "--jobs", "3") == one


def test_an_unchanged_build_does_nothing_and_a_changed_fuel_builds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recipe(tmp_path, SILK, flakes="none")
    before = built(path, tmp_path / "out")
    capsys.readouterr()
    assert main(["build", str(path), "-o", str(tmp_path / "out")]) == 0
    assert "up to date" in capsys.readouterr().out
    after = built(path, tmp_path / "out", "--set", "source.fuel=gas")
    assert after["torch.png"] != before["torch.png"]


@pytest.mark.slow
def test_a_size_builds_the_bytes_of_its_width_and_height_written_out(tmp_path: Path) -> None:
    coarse = {"kind": "silk", "rows": 12, "columns": 8, "sheets": {"count": 2}}
    keys = {"flakes": {"rate": 20}, "atlas": {"trim": "none"}}
    named = recipe(tmp_path, {**coarse, "size": "game", "aspect": 0.5}, **keys)
    files = built(named, tmp_path / "named", "--set", "source.size=draft")
    stated = recipe(tmp_path, {**coarse, "width": 96, "height": 192}, **keys)
    same = built(stated, tmp_path / "stated")
    assert files.pop("torch.manifest.json") and same.pop("torch.manifest.json")
    assert files == same
    frames = json.loads(files["torch.json"])["frames"].values()
    assert [frame["sourceSize"] for frame in frames] == 6 * [{"w": 96, "h": 192}]


def test_a_clip_on_the_sheets_is_an_input(tmp_path: Path) -> None:
    from PIL import Image

    frames = []
    for n in range(14):
        rows, columns = np.mgrid[:60, :40]
        blob = np.exp(-(((columns - 20) / 8) ** 2) - ((rows - 30 - 6 * np.sin(n)) / 14) ** 2)
        picture = np.stack([255 * blob, 140 * blob, 40 * blob], axis=-1).astype(np.uint8)
        frames.append(Image.fromarray(picture))
    frames[0].save(tmp_path / "fire.gif", save_all=True, append_images=frames[1:], duration=40)
    source = {**SILK, "texture": {"path": "fire.gif"}}
    files = built(recipe(tmp_path, source, flakes="none"), tmp_path / "out")
    manifest = json.loads(files["torch.manifest.json"])
    assert [entry["path"] for entry in manifest["inputs"]] == ["fire.gif"]
    assert main(["check", str(tmp_path / "torch.yaml")]) == 0


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no mass": ({"mass": 0}, "source.mass: must be more than 0; got 0"),
    "negative mass": ({"mass": -1.5}, "source.mass: must be more than 0; got -1.5"),
    "one-node sheet": ({"rows": 1}, "source.rows: must be at least 4; got 1"),
    "no sheet": ({"sheets": []}, "source.sheets: must be a list of at least 1; got []"),
    "not a number": (
        {"intruders": [{"shape": "log", "keyframes": [{"t": 0, "at": [float("nan"), 0, 0]}]}]},
        "source.intruders.0.keyframes.0.at.0: must be a finite number; got nan",
    ),
    "nowhere": ({"intruders": [{"shape": "log"}]}, "needs either `at` (it never moves) or"),
    "back in time": (
        {
            "intruders": [
                {
                    "shape": "log",
                    "keyframes": [{"t": 1, "at": [0, 0, 0]}, {"t": 0, "at": [0, 0, 0]}],
                }
            ]
        },
        "keyframes must be in order of t",
    ),
    "unknown fuel": ({"fuel": "wod"}, 'source.fuel: must be one of wood, candle, gas; got "wod"'),
    "unknown key": ({"sheet": {}}, "source.sheet: unknown key; did you mean source.sheets?"),
    "a clip as source": ({"path": "x"}, "unknown key here; it is one of `kind: frames`"),
    "too stiff": ({"stiffness": 1e6}, "use a stiffness of at most about"),
    "too many": ({"sheets": {"count": 10000}, "rows": 24}, "at most 200000 can be simulated"),
    "a jet to nowhere": (
        {"sheets": {"arrangement": "jet"}},
        "a jet needs a direction, as `direction: [1, 0, 0]`",
    ),
    "no direction": (
        {"sheets": {"arrangement": "jet", "direction": [0, 0, 0]}},
        "direction: [0, 0, 0] is none",
    ),
    "a directed ring": (
        {"sheets": {"arrangement": "ring", "direction": [0, 0, 1]}},
        "only a jet has a direction",
    ),
    "on two places": (
        {"sheets": {"on": 0, "spread": 0.2}, "intruders": [{"shape": "log", "at": [0, 0, 0]}]},
        "`on` says where they begin: leave out `spread`",
    ),
    "on nothing": ({"sheets": [{"on": 1}]}, "`on: 1` names no intruder; of the 0 in"),
    "on what": (
        {"sheets": {"on": [1]}},
        "source.sheets.on: must be none, the number of an intruder, or the path of a mask; got [1]",
    ),
    "no mask": ({"sheets": {"on": "gone.png"}}, "gone.png: does not exist"),
    "no clip": ({"texture": {"path": "gone.gif"}}, "gone.gif: does not exist"),
    "texture of what": ({"texture": 3}, "source.texture: must be `auto` or {path: ...}; got 3"),
}


@pytest.mark.parametrize(("keys", "advice"), BAD.values(), ids=BAD)
def test_what_cannot_be_is_refused_with_advice(
    keys: dict[str, Any], advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert advice in refused(recipe(tmp_path, {**SILK, **keys}), capsys)


def masked(folder: Path, size: tuple[int, int], box: tuple[int, int, int, int]) -> Path:
    mask = Image.new("RGBA", size)
    mask.paste((90, 60, 30, 255), box)
    mask.save(folder / "crate.png")
    return folder / "crate.png"


@pytest.mark.parametrize(
    ("size", "box", "advice"),
    [
        (
            (96, 96),
            (20, 20, 40, 40),
            "a mask has the proportions of the frame, 48x64 px; got 96x96",
        ),
        ((48, 64), (0, 0, 0, 0), "nothing in it is opaque, or bright"),
    ],
    ids=["another shape", "empty"],
)
def test_a_mask_that_cannot_be_is_refused(
    size: tuple[int, int], box: tuple[int, int, int, int], advice: str,
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    masked(tmp_path, size, box)
    keys = {**SILK, "width": 48, "height": 64, "sheets": {"on": "crate.png"}}
    assert advice in refused(recipe(tmp_path, keys), capsys)


def test_a_mask_burns_where_it_is_opaque_and_another_one_is_another_fire(tmp_path: Path) -> None:
    sheets = [{"on": "crate.png", "count": 24, "width": 0.1, "height": 0.15}]
    keys = {**SILK, "width": 96, "height": 128, "sheets": sheets}
    path = recipe(tmp_path, keys, flakes="none", atlas={"trim": "none", "dedupe": False})
    frames = []
    for left in (8, 56):
        masked(tmp_path, (192, 256), (2 * left, 120, 2 * left + 64, 200))
        files = built(path, tmp_path / "out")
        atlas = json.loads(files["torch.json"])["frames"].values()
        page = np.asarray(Image.open(io.BytesIO(files["torch.png"])))
        at = [frame["frame"] for frame in atlas]
        light = np.mean([page[f["y"] : f["y"] + 128, f["x"] : f["x"] + 96, 3] for f in at], axis=0)
        within = light[:, left - 6 : left + 38].sum()
        assert within > 0.95 * light.sum(), "flames sway a little"
        rows = light[:, left : left + 32].sum(axis=1)
        # They begin all over it, from row 60 to 100, and rise by a sheet's height, 19 px, at most.
        assert rows[62:100].min() > 0
        assert rows[:38].sum() + rows[103:].sum() < 0.01 * rows.sum()
        frames.append(files)
    manifest = json.loads(frames[0]["torch.manifest.json"])
    assert [entry["path"] for entry in manifest["inputs"]] == ["crate.png"]
    assert frames[0]["torch.png"] != frames[1]["torch.png"]


@pytest.mark.parametrize(
    ("sheets", "note"),
    [
        (
            {"arrangement": "jet", "direction": [2, 0, 0], "count": 4},
            "source.sheets: seen from its end in view_1, view_3 a jet is next to nothing",
        ),
        (
            [{"width": 0.01, "height": 0.01}, {"on": "crate.png", "count": 24, "width": 0.1}],
            "source.sheets.1: what burns on a mask is as flat as it, and thin in view_1, view_3",
        ),
    ],
    ids=["jet", "mask"],
)
def test_views_that_show_hardly_anything_are_noted(
    sheets: Any, note: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    masked(tmp_path, (192, 256), (24, 120, 168, 200))
    keys = {**SILK, "width": 96, "height": 128, "sheets": sheets}
    path = recipe(tmp_path, keys, flakes="none", views={"count": 4})
    assert main(["check", str(path)]) == 0
    assert note in capsys.readouterr().err
    assert main(["build", str(path), "-o", str(tmp_path / "out")]) == 0
    assert note in capsys.readouterr().err
    page = np.asarray(Image.open(tmp_path / "out/torch.png"))[..., 3]
    light = dict.fromkeys((f"view_{k}" for k in range(4)), 0)
    atlas = json.loads((tmp_path / "out/torch.json").read_text())
    for name, frame in atlas["frames"].items():
        box = frame["frame"]
        shown = page[box["y"] : box["y"] + box["h"], box["x"] : box["x"] + box["w"]]
        light[name.split("/")[1]] += int((shown > 50).sum())
    assert max(light["view_1"], light["view_3"]) < 0.5 * min(light["view_0"], light["view_2"])
    path = recipe(tmp_path, keys, flakes="none", views={"count": 2})
    assert main(["build", str(path), "-o", str(tmp_path / "out")]) == 0
    assert "view_1" not in capsys.readouterr().err


def test_each_kind_of_source_is_refused_the_keys_of_the_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = refused(recipe(tmp_path, {"path": "x"}, views={"count": 4}), capsys)
    assert "views: frames have one side only" in message
    for keys, advice in (
        ({"loop": "pingpong"}, "timeline.loop: pingpong joins the ends of a clip"),
        ({"overlap": 4}, "timeline.overlap: applies to clips only"),
        ({"tail": True, "loop": "none"}, "timeline.tail: applies to clips only"),
    ):
        assert advice in refused(recipe(tmp_path, SILK, timeline=keys), capsys)
    message = refused(recipe(tmp_path, {"kind": "slik"}), capsys)
    assert "source.kind: must be one of fluid, frames, profile, silk, sprites; got" in message
    assert 'got "slik"; did you mean silk?' in message
    message = refused(recipe(tmp_path, {"path": "x", "fuel": "wood"}), capsys)
    assert "source.fuel: unknown key here; it is one of `kind: silk`" in message
