"""Lines that tile: frames that are laid side by side without a seam."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Window
from fire_atlas.effect.flakes.tracks import by_column
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.generators.silk.glow import scattered
from fire_atlas.generators.silk.raster import mesh_triangles, rasterise
from fire_atlas.generators.silk.renderer import SilkRenderer
from tests.generators.silk.small_fires import COARSE, camera, fire, planned
from tests.generators.silk.test_builds import built, recipe, refused

WIDTH, HEIGHT = 160, 64
SIZE: dict[str, Any] = {"width": WIDTH, "height": HEIGHT, "rows": 12, "columns": 8}

Frames = NDArray[np.float64]
"""(frames, height, width, channels)."""


def lines(**length: Any) -> list[dict[str, Any]]:
    """Return two lines, tall sheets behind and low ones before."""
    line = {"arrangement": "line", **length}
    tall = {**line, "count": 10, "width": 0.5, "height": 0.85, "at": [0, 0.1, 0]}
    return [tall, {**line, "count": 14, "width": 0.36, "height": 0.5, "at": [0, -0.06, 0]}]


TILE, ENDS = lines(tile=True), lines(spread=WIDTH / HEIGHT)


@cache
def wall() -> SilkRenderer:
    """Return a wall whose frames tile, in a wind that carries its tongues over the joint."""
    blown = {"level": 3.0, "direction": "right"}
    return fire(6, wind=blown, sheets=TILE, glow=0.1, soot=3.0, **SIZE)


def front(elevation: float = 0.0) -> Camera:
    return camera(0.0, elevation, sheets=TILE, **SIZE)


DRAWN: dict[str, Callable[[SilkRenderer, Camera], NDArray[Any]]] = {
    "light": lambda made, eye: made.draw(3, eye).light,
    "soot": lambda made, eye: made.soot(3, eye),
    "motion": lambda made, eye: made.motion(3, eye),
}


@pytest.mark.parametrize("elevation", [0.0, 30.0])
@pytest.mark.parametrize("drawn", DRAWN)
def test_a_tile_has_no_place_at_which_it_begins(drawn: str, elevation: float) -> None:
    """A camera that looks 23 px further left sees the same, moved around by as much."""
    eye = front(elevation)
    aside = replace(eye, origin=(eye.origin[0] + 23, eye.origin[1]))
    first, moved = (DRAWN[drawn](wall(), each) for each in (eye, aside))
    assert first.any()
    assert np.abs(np.roll(first, 23, axis=1) - moved).max() < 1 / 255


def test_the_front_of_a_tile_has_no_place_at_which_it_begins() -> None:
    eye = front()
    aside = replace(eye, origin=(eye.origin[0] + 23, eye.origin[1]))
    first, moved = (wall().front_surface(3, each) for each in (eye, aside))
    assert np.abs(np.roll(first.normal, 23, axis=1) - moved.normal).mean() < 0.01
    assert np.abs(np.roll(first.depth, 23, axis=1) - moved.depth).mean() < 0.1


def test_flakes_find_the_fire_of_a_tile_beyond_its_sides() -> None:
    eye = front()
    y, share = np.full(WIDTH, 40.0), np.full(WIDTH, 0.5)
    x = np.arange(0.5, WIDTH)
    here = wall().fire_depth(3, eye, x, y, share)
    assert np.ptp(here) > 0.05
    for beyond in (-WIDTH, 2 * WIDTH):
        assert np.array_equal(wall().fire_depth(3, eye, x + beyond, y, share), here)


def test_what_a_triangle_covers_beyond_a_side_is_found_at_the_other() -> None:
    rows, columns = np.mgrid[0:2, 0:2].astype(float)
    corners = np.stack([26 + 8 * columns, 3 + 4 * rows], axis=-1)[None]
    triangles = mesh_triangles(corners, corners)
    found = rasterise(triangles, Window(0, 0, 30, 10), tiles=True)
    covered = np.bincount(found.pixel, minlength=300).reshape(10, 30)
    wanted = np.zeros((10, 30), int)
    wanted[3:7, 26:] = wanted[3:7, :4] = 1
    assert np.array_equal(covered, wanted)
    assert np.allclose(found.attributes[:, 0] % 30, found.pixel % 30 + 0.5)


def test_the_glow_of_a_tile_reaches_over_its_sides_and_fades_above() -> None:
    light = np.zeros((40, 60, 3), np.float32)
    light[20, 57], light[20, 28] = (100, 0, 0), (0, 100, 0)
    glow = scattered(light, 40, 0.5, tiles=True)
    at_side, inside = np.roll(glow[..., 0], 1 - 28 - 2, axis=1), glow[..., 1]
    assert np.abs(at_side - inside).max() < 0.03 * inside.max()
    assert glow[0].max() == 0 < glow[20, 0, 0] < glow[20, 59, 0]


def test_sheets_of_a_tile_stand_as_far_apart_over_the_joint() -> None:
    foot = planned(2, sheets={**TILE[0], "count": 200, "width": 0.05}, **SIZE).model.rest
    x = np.sort(foot[:, 0, :, 0].mean(axis=1)) * HEIGHT / WIDTH
    gaps = np.diff(np.append(x, x[0] + 1)) * 200
    assert gaps.min() >= 0 and gaps.max() <= 2
    assert gaps[:-1].mean() == pytest.approx(1, abs=0.01)


def test_the_air_sways_alike_at_both_sides_of_a_tile() -> None:
    def apart(**keys: Any) -> float:
        forces = planned(2, sheets={"count": 2, **keys}, **SIZE).forces
        x = np.zeros((2, 1, 1, 3))
        x[:, ..., 0] = [[[-WIDTH / HEIGHT / 2]], [[WIDTH / HEIGHT / 2]]]
        ways = forces.sway_waves.velocity(0.7, x)
        return float(max(np.abs(np.diff(way, axis=0)).max() for way in ways))

    assert apart(arrangement="line", tile=True) < 1e-9 < 0.1 < apart(arrangement="line")


SOURCE = {"kind": "silk", **COARSE, **SIZE, "glow": 0.05}
EFFECT: dict[str, Any] = {
    "flakes": {"rate": 400, "life": [0.5, 1.5], "size": [0.01, 0.05], "glow": 0.3},
    "motion_blur": {"flame": True},
    "wind": {"level": 4, "direction": "right"},
}
"""Many large flakes with halos that wind carries over the joint, and blur."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("tiles")


@cache
def build_of(folder: Path, name: str, sheets: str, seed: int) -> Path:
    """Build a wall with all that may have a seam, and return the folder with its files."""
    maps = {"flakes": True, "haze": True, "motion": "godot", "normals": True, "depth": True}
    source = {**SOURCE, "sheets": json.loads(sheets)}
    keys = {**EFFECT, "seed": seed, "maps": maps if seed == 0 else {}}
    built(recipe(folder, source, **keys), folder / name)
    return folder / name


def tile_of(folder: Path, seed: int) -> Path:
    return build_of(folder, f"tile_{seed}", json.dumps(TILE), seed)


def played(build: Path, layer: str = "") -> Frames:
    """Return the frames of a build, untrimmed: (frames, height, width, 4), as on its pages."""
    atlas = json.loads((build / "torch.json").read_text())
    page = np.array(Image.open(build / f"torch{layer}.png").convert("RGBA"), np.float64)
    frames = []
    for frame in atlas["frames"].values():
        on_page, place, whole = (frame[key] for key in ("frame", "spriteSourceSize", "sourceSize"))
        picture = np.full((whole["h"], whole["w"], 4), np.nan)
        rows = slice(on_page["y"], on_page["y"] + on_page["h"])
        columns = slice(on_page["x"], on_page["x"] + on_page["w"])
        picture[place["y"] :, place["x"] :][: on_page["h"], : on_page["w"]] = page[rows, columns]
        frames.append(picture)
    return np.stack(frames)


def shown(frames: Frames) -> Frames:
    """Return straight frames over black, (frames, height, width, 3); nothing where they end."""
    return np.nan_to_num(frames[..., :3] * frames[..., 3:] / 255)


def steps(frames: Frames) -> tuple[float, Frames]:
    """Return the mean step over the joint, and those between neighbouring columns."""
    between = np.abs(np.diff(frames, axis=2))
    joint = np.abs(frames[:, :, 0] - frames[:, :, -1])
    return float(np.nanmean(joint)), np.nanmean(between, axis=(0, 1, 3))


def test_tiles_side_by_side_have_no_seam_with_flakes_and_blur(folder: Path) -> None:
    found = [steps(shown(played(tile_of(folder, seed)))) for seed in (0, 1, 2)]
    joint = np.mean([over for over, _ in found])
    assert joint <= np.mean([np.median(between) for _, between in found])
    tile, ends = (
        shown(played(made))[:, :, 0].mean()
        for made in (tile_of(folder, 0), build_of(folder, "ends", json.dumps(ENDS), 0))
    )
    assert ends < 0.1 * tile, "the same line that ends at the sides dies before them"


def test_a_tile_ends_above(folder: Path) -> None:
    assert max(shown(played(tile_of(folder, seed)))[:, 0].max() for seed in (0, 1, 2)) <= 2


@pytest.mark.parametrize("layer", ["flakes", "haze", "motion", "normals", "depth"])
def test_the_maps_of_a_tile_agree_over_the_joint(folder: Path, layer: str) -> None:
    over, between = steps(played(tile_of(folder, 0), f".{layer}")[..., :3])
    assert over <= between.max()
    if layer != "flakes":
        ends = build_of(folder, "ends", json.dumps(ENDS), 0)
        over, between = steps(played(ends, f".{layer}")[..., :3])
        assert over > between.max()


def test_flakes_of_a_tile_fly_on_over_the_next_one(folder: Path) -> None:
    tracks = read_tracks(tile_of(folder, 0) / "torch.flakes.json")
    assert tracks is not None and tracks.tiles
    x, light = (np.concatenate([by_column(rows)[name] for rows in tracks.frames]) for name in "xa")
    assert (x > WIDTH + 5).sum() > 20
    at_side = np.abs((x + WIDTH / 2) % WIDTH - WIDTH / 2) < 2
    assert at_side.sum() > 20
    assert light[at_side].mean() > 0.6 * light[~at_side].mean(), "they do not fade at its sides"


def test_only_a_line_that_ends_nowhere_tiles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def advice(sheets: dict[str, Any], source: Mapping[str, Any] = {}, **keys: Any) -> str:
        return refused(recipe(tmp_path, {**SOURCE, "sheets": sheets, **source}, **keys), capsys)

    line = {"arrangement": "line", "tile": True}
    assert "use arrangement: line" in advice({"arrangement": "ring", "tile": True})
    assert "sheets.spread: " in advice({**line, "spread": 1})
    assert "views.count: " in advice(line, views={"count": 2})
    assert "views.distance: " in advice(line, views={"distance": 3})
    log = {"shape": "log", "at": [1.0, 0, 0], "length": 0.6}
    assert "intruders.0: crosses a side of the tile" in advice(line, {"intruders": [log]})
    path = recipe(tmp_path, {**SOURCE, "sheets": line, "intruders": [{**log, "length": 0.3}]})
    assert main(["check", str(path)]) == 0
