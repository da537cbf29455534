"""The player, in the engine, flies the flakes as the tracks say."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import expose
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.drawing import draw_flakes, draw_pixels
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks, fold_into_loop
from fire_atlas.engines.godot.advice import what_is_not_shown
from fire_atlas.engines.godot.flakes import flake_arrays
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.product import Product
from fire_atlas.pipeline.files.exports import exported_files
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.any_tracks import any_tracks, flights_of
from tests.support.cover import hidden_by_light
from tests.support.embers import (
    SIDE,
    SINGLE,
    SMALL,
    Picture,
    blended,
    ember,
    overlapping,
    own_frame,
    shown,
    tracks_of,
)
from tests.support.godot4 import Godot4, picture
from tests.support.marked import marked
from tests.support.sheets import sheet_of_fire

HALF_FLOAT = 2e-3
"""Relative precision of the light of a flake, which the engine keeps as half floats."""

Table = NDArray[np.float64]


def built_tracks(
    folder: Path, stem: str = "fire", name: str = "fire"
) -> tuple[dict[str, Any], list[Table], tuple[float, float]]:
    """Return the tracks of a build, a table of named columns a frame, and the pivot in px.

    ``stem`` is that of their file, ``name`` that of the build.
    """
    tracks = json.loads((folder / f"{stem}.flakes.json").read_text())
    columns = len(tracks["columns"])
    frames = [np.array(frame["rows"]).reshape(-1, columns) for frame in tracks["frames"]]
    (entry, *_) = json.loads((folder / f"{name}.json").read_text())["frames"].values()
    width, height = entry["sourceSize"]["w"], entry["sourceSize"]["h"]
    return tracks, frames, (entry["anchor"]["x"] * width, entry["anchor"]["y"] * height)


def wanted(rows: Table, pivot: tuple[float, float]) -> Table:
    """What the engine has to say of rows of the tracks: quads with room for halos.

    The last column is the tail, and 2 more with a halo.
    """
    column = dict(zip(COLUMNS, rows.T, strict=False))  # a fire with depth has z and vz too
    light = np.stack([column[c] * column["a"] for c in "rgb"])
    # The scene has light to 5 decimals, and the engine reckons with 32 bits.
    halo = np.round(light.max(axis=0), 5) * 0.004 > 1e-4 * (1 - 1e-6)
    width = column["size"] * np.where(halo, 2.5, 1)
    return np.column_stack([
        column["x"] - pivot[0], column["y"] - pivot[1],
        width + column["size"] * (column["stretch"] - 1), width,
        column["rotation"], *light, column["tail"] + 2 * halo,
    ])  # fmt: skip


def assert_alike(seen: Any, rows: Table) -> None:
    """Compare instances with rows, each rounded as it is written; angles are all the same ± 2π."""
    got = np.array(seen, float).reshape(-1, 9)
    assert got.shape == rows.shape
    got[:, 4] = rows[:, 4] + (got[:, 4] - rows[:, 4] + np.pi) % (2 * np.pi) - np.pi
    allowed = [0.002, 0.002, 0.05, 0.008, 0.001, 0.002, 0.002, 0.002, 0.002]
    assert (np.abs(got - rows) <= allowed + HALF_FLOAT * np.abs(rows)).all()


def build(folder: Path, loop: str) -> None:
    folder.mkdir()
    (folder / "fire.yaml").write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "height": 120, "fps": 24},
        "flakes": {"bake": False, "life": [0.3, 1.2]}, "timeline": {"loop": loop},
        "exports": ["json", "godot"],
    }))  # fmt: skip
    assert main(["build", "-q", str(folder / "fire.yaml"), "-o", str(folder)]) == 0


@pytest.mark.parametrize("loop", ["auto", "none"])
def test_every_flake_of_every_frame_flies_as_the_tracks_have_it(
    loop: str, godot4: Godot4, tmp_path: Path
) -> None:
    folder = tmp_path / "game"
    build(folder, loop)
    tracks, frames, pivot = built_tracks(folder)
    count, scene = len(frames), {"scene": "res://fire.tscn", "animation": "fire"}
    ticks = round((count + 3) / tracks["fps"] * 60)  # on beyond the end
    sought, played = godot4.run(
        folder,
        [{"do": "seek_flakes", **scene, "times": sought_times(count)},
         {"do": "play", **scene, "ticks": ticks}],
    )  # fmt: skip
    assert_flown(sought, folder, loop)
    times = np.array([time for time, _ in played[1:]])
    ideal = times[0] + np.arange(len(times)) * tracks["fps"] / 60
    if loop == "auto":
        assert np.abs((times - ideal + count / 2) % count - count / 2).max() < 0.01
    else:
        assert times[-1] == pytest.approx(count, abs=1e-3)
    for time, seen in played[1:]:
        assert_near_tracks(np.array(seen, float), time, frames, tracks, pivot)


def test_flakes_that_are_hidden_cost_nothing(godot4: Godot4, tmp_path: Path) -> None:
    """As those are that the pages show: nothing is placed while the sprite plays."""
    flakes_alone(tmp_path / "game", some_tracks())
    job = {"do": "play", "scene": "res://game.tscn", "animation": "campfire", "ticks": 30}
    hidden = {**job, "set": {"Flakes:visible": "false"}}
    shown, unseen = godot4.run(tmp_path / "game", [job, hidden])
    assert [len(rows) for _, rows in shown[1:]] == [3] * 29
    assert [rows for _, rows in unseen] == [[]] * 30


def sought_times(count: int) -> list[float]:
    """Every frame, half way to the next, beyond the end, and before the beginning."""
    return [*range(count), *(i + 0.5 for i in range(count)), count + 3, -2]


def assert_flown(sought: list[Any], folder: Path, loop: str) -> None:
    """Compare where flakes are at ``sought_times`` with the tracks."""
    tracks, frames, pivot = built_tracks(folder)
    count = len(frames)
    for i, rows in enumerate(frames):
        assert_alike(sought[i], wanted(rows, pivot))
    for i, seen in enumerate(sought[count : 2 * count]):
        assert_between(np.array(seen, float), frames, i, tracks, pivot)
    assert tracks["loop"] == (loop == "auto")
    beyond = [3, count - 2] if tracks["loop"] else [count - 1, 0]
    for i, seen in zip(beyond, sought[2 * count :], strict=True):
        if i == count - 1:
            assert not np.array(seen, float).reshape(-1, 9)[:, 5:8].any()  # all have gone out
        else:
            assert_alike(seen, wanted(frames[i], pivot))


def assert_near_tracks(
    seen: Table, time: float, frames: list[Table], tracks: Any, pivot: tuple[float, float]
) -> None:
    """While the sprite plays, every flake is within .1 px of its way between two frames."""
    i = min(int(time), len(frames) - 1)
    here = wanted(frames[i], pivot)
    after = {row[0]: wanted(row[None], pivot)[0] for row in frames[(i + 1) % len(frames)]}
    assert len(seen) == len(here)
    for flake, got, start in zip(frames[i], seen, here, strict=True):
        ends = start[:2] + flake[3:5] / tracks["fps"]
        if flake[0] in after and (tracks["loop"] or i + 1 < len(frames)):
            ends = after[flake[0]][:2]
        assert np.abs(got[:2] - (start[:2] + (ends - start[:2]) * (time - i))).max() < 0.1


def assert_between(
    seen: Table, frames: list[Table], i: int, tracks: Any, pivot: tuple[float, float]
) -> None:
    """Half way to the next frame a flake is between its two places; one that ends there dims.

    The loop is longer than any life, so that flakes keep their ids.
    """
    here = wanted(frames[i], pivot)
    is_last = i == len(frames) - 1
    following = {} if is_last and not tracks["loop"] else {
        row[0]: wanted(row[None], pivot)[0] for row in frames[(i + 1) % len(frames)]
    }  # fmt: skip
    for flake, got, start in zip(frames[i], seen, here, strict=True):
        end = following.get(flake[0])
        if end is None:
            velocity = flake[3:5] / tracks["fps"]
            assert got[:2] == pytest.approx(start[:2] + velocity / 2, abs=0.01)
            assert got[5:8] == pytest.approx(start[5:8] / 2, abs=1e-3, rel=HALF_FLOAT)
        else:
            assert got[:2] == pytest.approx((start[:2] + end[:2]) / 2, abs=0.01)
            assert got[5:8] == pytest.approx((start[5:8] + end[5:8]) / 2, abs=1e-3, rel=HALF_FLOAT)


def some_tracks() -> Tracks:
    """Three embers that do not touch."""
    places = {"x": 14.0, "y": 12.5}, {"x": 40.3, "y": 20.2}, {"x": 30.6, "y": 44.4}
    kinds = ember(0.15, 8.0, id=0.0), ember(0.8, 5.0, id=1.0, stretch=2.0), ember(5.0, 6.0, id=2.0)
    rows = np.array(kinds)
    for row, place in zip(rows, places, strict=True):
        row[[COLUMNS.index(name) for name in place]] = [*place.values()]
    return tracks_of(rows)


def squares() -> Tracks:
    """Three hard squares that do not touch, one brighter than white."""
    soft = some_tracks()
    rows = soft.frames[0].copy()
    rows[:, COLUMNS.index("size")] = 1, 2, 2
    rows[:, COLUMNS.index("stretch")] = 1
    return replace(soft, frames=(rows,) * 9, hard=True)


def spawns_of(count: int) -> Table:
    """Births of so many flakes, each at a place of its own."""
    spawns = np.ones((count, len(SPAWN_COLUMNS)))
    spawns[:, 0] = spawns[:, SPAWN_COLUMNS.index("x")] = np.arange(count)
    return spawns


def flakes_alone(folder: Path, tracks: Tracks, **atlas: Any) -> None:
    """Write a scene of flakes over black, behind which there is no flame."""
    folder.mkdir(exist_ok=True)
    # Named as its folder, since a project has room for one effect of a name.
    sheet = replace(sheet_of_fire(pivot=[0.5, 0.5], **atlas), name=folder.name, title=folder.name)
    product = Product((sheet,), {"campfire": tracks}, frozenset(), lambda name: None)
    for file in exported_files(["godot"], product, {}):
        (folder / file.name).write_bytes(file.data)
    for page in sheet.pages:
        Image.new("RGBA", (page.width, page.height)).save(folder / page.file)


Cases = dict[str, tuple[Tracks, dict[str, Any]]]
"""The flakes of each case, and its settings of the atlas."""


def seen_in_godot(
    godot4: Godot4, folder: Path, cases: Cases, *, film: bool = False
) -> dict[str, NDArray[np.int64]]:
    """Return what the engine shows of each case, one folder each; as ``film`` by that scene."""
    for case, (tracks, atlas) in cases.items():
        flakes_alone(folder / case, tracks, **atlas)
    shot = {"do": "draw", "animation": "campfire", "frame": 4, "at": [30, 30]}
    shot |= {"background": "000000", "sprite": "Film/Fire" if film else "."}
    scene = "{0}/{0}_film.tscn" if film else "{0}/{0}.tscn"
    jobs = [{**shot, "scene": f"res://{scene.format(case)}"} for case in cases]
    shots = [picture(shot) for shot in godot4.run(folder, jobs, (SIDE, SIDE))]
    return {case: shot.astype(int) for case, shot in zip(cases, shots, strict=True)}


def tracks_of_three_rounds() -> Tracks:
    """A flake at x = frame for all three rounds of nine frames, which flies on in between."""
    rows = dict.fromkeys(COLUMNS, 1.0) | {"id": 0.0, "y": 0.0, "vx": 24.0, "vy": 0.0}
    frames = [np.array([list((rows | {"x": float(i)}).values())]) for i in range(27)]
    return replace(Tracks.one_shot(24, (60, 60), 0, spawns_of(1), frames), loop=True, rounds=3)


def assert_goes_through_all_rounds(played: list[Any], frames: int = 27) -> None:
    """Compare the place of the flake with the sprite's time, which is of one round."""
    times = np.array([time for time, _ in played], float)
    places = np.array([seen[0][0] for _, seen in played]) - places_of_pivot()
    assert np.abs((places - times + 4.5) % 9 - 4.5).max() < 1.01, "in step with the sprite"
    steps = (np.diff(places) + frames / 2) % frames - frames / 2
    assert np.abs(steps).max() < 4, "no round is skipped or repeated"
    assert abs(steps.sum()) > frames, "all rounds, and the first again"


def places_of_pivot() -> float:
    """Where x = 0 is, from the pivot of ``flakes_alone``."""
    return -30.0


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_all_rounds_of_the_tracks_are_played(speed: float, godot4: Godot4, tmp_path: Path) -> None:
    flakes_alone(tmp_path / "game", tracks_of_three_rounds())
    job = {"do": "play", "scene": "res://game.tscn", "animation": "campfire", "ticks": 90}
    changed = {":speed_scale": str(speed)}
    (played,) = godot4.run(tmp_path / "game", [{**job, "set": changed}])
    assert_goes_through_all_rounds(played[1:])


def test_a_round_is_sought_by_its_number(godot4: Godot4, tmp_path: Path) -> None:
    flakes_alone(tmp_path / "game", tracks_of_three_rounds())
    job = {"do": "seek_flakes", "scene": "res://game.tscn", "animation": "campfire"}
    (seen,) = godot4.run(tmp_path / "game", [{**job, "times": [2.5, 11.5, 26, 28, -1]}])
    assert [round(row[0][0] + 30, 3) for row in seen] == [2.5, 11.5, 26, 1, 26]


ALPHAS = ["straight", "premultiplied", "additive"]


def cases_of(kinds: dict[str, Tracks]) -> Cases:
    """Return a case for each kind of flakes and each kind of pages."""
    return {
        f"{kind}_{alpha}": (tracks, {"alpha": alpha})
        for alpha in ALPHAS
        for kind, tracks in kinds.items()
    }


def alone() -> Cases:
    """Every ember alone, on premultiplied pages, and one on each of the others."""
    kinds = {name: tracks_of(row) for name, row in SINGLE.items()}
    whole = {name: (tracks, {"alpha": "premultiplied"}) for name, tracks in kinds.items()}
    return whole | cases_of({"ember": kinds["middling"]}) | cases_of({"squares": squares()})


def assert_as_in_our_frame(seen: dict[str, NDArray[np.int64]], cases: Cases) -> None:
    for case, (tracks, _) in cases.items():
        rows = tracks.frames[0]
        own = own_frame(rows)
        if tracks.hard:
            own = shown(draw_pixels(rows, SIDE, SIDE).rgb())
        assert own.max() > 20
        assert np.abs(seen[case] - own).max() <= 3, case


def test_an_ember_alone_looks_as_in_our_frame(godot4: Godot4, tmp_path: Path) -> None:
    cases = alone()
    assert_as_in_our_frame(seen_in_godot(godot4, tmp_path, cases), cases)


def covered(ember: Picture, behind: Picture) -> Picture:
    """Blend as premultiplied alpha: an ember covers less than it is bright."""
    bright = ember.max(axis=2, keepdims=True)
    luminance = (ember @ [0.2126, 0.7152, 0.0722])[..., None]
    cover = hidden_by_light(bright, luminance)
    return np.asarray(np.minimum(ember + behind * (1 - cover), 1))


def added(ember: Picture, behind: Picture) -> Picture:
    """Blend as on additive pages."""
    return np.minimum(ember + behind, 1)


def assert_blended(seen: dict[str, NDArray[np.int64]]) -> None:
    """Compare overlapping embers with the engine's own blending, and with our frame.

    Some of these are much brighter than white: a hard case. In frames of the samples the mean is
    below 1.2.
    """
    own = own_frame(overlapping())
    lit = own.max(axis=2) > 2
    for alpha, way, most in (("premultiplied", covered, 11), ("additive", added, 30)):
        drawn = seen[f"embers_{alpha}"]
        assert np.abs(drawn - blended(overlapping(), way)).max() <= 3
        assert np.abs(drawn - own)[lit].mean() < most


def test_overlapping_embers_are_blended(godot4: Godot4, tmp_path: Path) -> None:
    cases = cases_of({"embers": tracks_of(overlapping())})
    assert_blended(seen_in_godot(godot4, tmp_path, cases))


def test_where_light_is_blended_an_ember_is_light(godot4: Godot4, tmp_path: Path) -> None:
    """As in a project with HDR 2D, whose screen holds light."""
    tracks = tracks_of(SINGLE["middling"])
    atlas = {"alpha": "premultiplied", "blend_space": "linear"}
    (seen,) = seen_in_godot(godot4, tmp_path, {"linear": (tracks, atlas)}).values()
    light = expose(draw_flakes(tracks.frames[0], SIDE, SIDE).rgb()) * 255
    assert np.abs(seen - light).max() <= 3


def test_on_film_the_light_of_embers_is_summed(godot4: Godot4, tmp_path: Path) -> None:
    cases = cases_of({"embers": tracks_of(overlapping()), "ember": tracks_of(SINGLE["bright"])})
    cases |= {name: (tracks_of(row), {"alpha": "straight"}) for name, row in SMALL.items()}
    assert_as_in_our_frame(seen_in_godot(godot4, tmp_path, cases, film=True), cases)


def test_on_film_flame_and_embers_are_as_on_a_baked_page(godot4: Godot4, tmp_path: Path) -> None:
    source = {"path": str(shipped("samples") / "campfire"), "count": 12, "fps": 24, "height": 160}
    jobs, pages = [], []
    for alpha in ALPHAS:
        for bake in (True, False):
            recipe = tmp_path / f"{alpha}{'_baked' if bake else ''}.yaml"
            recipe.write_text(json.dumps({
                "source": source, "flakes": {"bake": bake, "rate": 60, "size": [0.03, 0.06]},
                "timeline": {"loop": "none"}, "atlas": {"alpha": alpha}, "tracks": [],
                "exports": ["json", "godot"],
            }))  # fmt: skip
            assert main(["build", "-q", str(recipe), "-o", str(tmp_path)]) == 0
        atlas = read_atlas(tmp_path / f"{alpha}_baked.json")
        frame = atlas.frames[9]
        pages.append(blend(list(cut_frames(atlas))[9], (0, 0, 0), alpha, "srgb"))
        jobs.append({
            "do": "draw", "scene": f"res://{alpha}_film.tscn", "sprite": "Film/Fire",
            "animation": alpha, "frame": 9, "background": "000000",
            "at": [frame.anchor[0] * frame.frame_width, frame.anchor[1] * frame.frame_height],
        })  # fmt: skip
    for page, answer in zip(pages, godot4.run(tmp_path, jobs, (200, 200)), strict=True):
        seen = picture(answer)[: page.shape[0], : page.shape[1]].astype(int)
        assert np.abs(seen - page).max() <= 3
        assert page.max() > 200


def test_rows_are_joined_where_the_same_flake_goes_on() -> None:
    def table(**age: int) -> Table:
        """Rows of flakes, by their names and ages in frames."""
        frame = np.ones((len(age), len(COLUMNS)))
        frame[:, 0] = [int(name[1:]) for name in age]
        frame[:, COLUMNS.index("age")] = np.array(list(age.values())) / 24
        return frame

    def tracks(*, loop: bool) -> Tracks:
        frames = (table(f1=1, f2=3), table(), table(f2=5, f3=0), table(f3=1, f1=0))
        flights = tuple(frame[:, 0].astype(np.int64) for frame in frames)
        ages = (frame[:, COLUMNS.index("age")] * 24 for frame in frames)
        moments = tuple(np.rint(age).astype(np.int64) for age in ages)
        return Tracks(24, 60, 60, loop, 0, spawns_of(4), frames, flights, moments)

    both = {"a": [tracks(loop=True)], "b": [tracks(loop=False)]}
    made = flake_arrays(both, {"a": (0, 0), "b": (10, 0)})
    assert made.begins == [0, 4, 8]
    assert made.first == [0, 2, 2, 4, 6, 8, 8, 10, 12]
    assert made.next == [-1, -1, -1, 4, -1, 0, -1, -1, -1, 10, -1, -1]
    assert made.loops == [1, 0]
    assert made.most == 2
    assert made.rows[0, :2].tolist() == [1, 1]
    assert made.rows[6, :2].tolist() == [-9, 1]


def test_a_flake_that_outlives_its_loop_goes_on_whatever_its_id() -> None:
    """Eleven frames of one flake, and three of another, folded onto a loop of four."""
    rows = []
    for age in range(11):
        frame = np.ones((2 if age in (1, 2, 3) else 1, len(COLUMNS)))
        frame[:, 0] = [0, 1][: len(frame)]
        frame[:, COLUMNS.index("x")] = [age, 100 + age][: len(frame)]
        frame[:, COLUMNS.index("age")] = np.array([age + 0.4, age - 0.7][: len(frame)]) / 24
        rows.append(frame)
    tracks = fold_into_loop(Tracks.one_shot(24, (60, 60), 0, spawns_of(2), rows), 4)
    made = flake_arrays({"a": [tracks]}, {"a": (0, 0)})
    (start,) = (i for i, x in enumerate(made.rows[:, 0]) if x == 0)
    seen = []
    while start >= 0:
        seen.append(int(made.rows[start, 0]))
        start = made.next[start]
    assert seen == list(range(11))
    assert sorted(made.next).count(-1) == 2


@given(tracks=any_tracks())
def test_rows_are_joined_into_the_flights_of_the_tracks(tracks: Tracks) -> None:
    assume(any(len(frame) for frame in tracks.frames))
    made = flake_arrays({"a": [tracks]}, {"a": (0, 0)})
    chains = []
    for start in set(range(len(made.next))) - set(made.next):
        chain, row = [], start
        while row >= 0:
            chain.append(float(made.rows[row, 0]))
            row = made.next[row]
        chains.append(chain)
    assert sorted(chains) == sorted(flights_of(tracks).values())


def test_flakes_that_the_pixels_show_are_not_played_as_well() -> None:
    sheet = marked().sheet
    played = {}
    for baked in ([], ["walk"], ["walk", "tree"]):
        tracks = {"walk": some_tracks(), "tree": some_tracks()}
        product = Product((sheet,), tracks, frozenset(baked), lambda name: None)
        files = {
            file.name: file.data.decode()
            for file in exported_files(["godot"], product, {})
            if file.name.startswith(("mark.tscn", "mark_flakes.tres"))
        }
        (names,) = (
            line for line in files["mark_flakes.tres"].splitlines() if line.startswith("animations")
        )
        played[tuple(baked)] = names, "visible = false" in files["mark.tscn"]
    assert played == {
        (): ('animations = PackedStringArray("walk", "tree")', False),
        ("walk",): ('animations = PackedStringArray("tree")', False),
        ("walk", "tree"): ('animations = PackedStringArray("walk", "tree")', True),
    }


def test_textures_on_several_pages_are_not_played_and_the_build_says_so() -> None:
    sheet = marked().sheet
    cell = sheet.regions[0]
    tracks = {"walk": some_tracks()}
    for cells, is_played in (((cell,), True), ((cell, replace(cell, page=1)), False)):
        made = replace(sheet, cells=cells)
        product = Product((made,), tracks, frozenset(), lambda name: None)
        (scene,) = (
            file.data.decode()
            for file in exported_files(["godot"], product, {})
            if file.name == "mark.tscn"
        )
        assert ("CELLS" in scene) == is_played
        said = " ".join(what_is_not_shown(product))
        assert ("on several pages; raise atlas.max_size" in said) != is_played
