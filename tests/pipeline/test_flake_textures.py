"""Builds with a texture of the user's: what is drawn is what the tracks name, and files say so."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes, decode_bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.formats.tracks.tracks_json import read_tracks, write_tracks_json
from fire_atlas.preview.cut_frames import cut_frames, texture_of
from tests.support.textures import COLOURS, drop, saved, sheet

GRID = {"columns": 3, "rows": 1}
CLIP = {"path": str(shipped("samples") / "campfire"), "count": 8, "height": 160}


def recipe_of(folder: Path, texture: Any, **keys: Any) -> Path:
    flakes = {"texture": texture, "rate": 25, "size": [0.05, 0.09], **keys.pop("flakes", {})}
    recipe = folder / "fire.yaml"
    values = {"source": CLIP, "timeline": {"loop": "none"}, "flakes": flakes, **keys}
    recipe.write_text(json.dumps(values), encoding="utf-8")
    return recipe


def built(recipe: Path) -> tuple[AtlasFile, Tracks]:
    assert main(["build", "-q", str(recipe)]) == 0
    folder = recipe.parent / "build"
    tracks = read_tracks(folder / "fire.flakes.json")
    assert tracks is not None and tracks.texture is not None
    return read_atlas(folder / "fire.json"), tracks


@pytest.fixture(scope="module")
def drops(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, AtlasFile, Tracks]:
    """A build of flakes alone in the layer of flakes, each a drop of one of three colours."""
    folder = tmp_path_factory.mktemp("drops")
    saved(sheet(), folder / "drops.png")
    recipe = recipe_of(
        folder,
        {"path": "drops.png", "grid": GRID},
        flakes={"tint": "none", "edge": "crop", "rate": 24, "size": [0.03, 0.04]},
        source={**CLIP, "count": 48},
        maps={"flakes": True},
        atlas={"trim": "none"},
        tracks=["json", "csv", "hjson", "pcache"],
    )
    return folder / "build", *built(recipe)


def alone(rows: np.ndarray[Any, np.dtype[np.float64]]) -> list[int]:
    """Return the bright flakes of a frame whose picture no other touches, nor the border."""
    column = dict(zip(COLUMNS, rows.T, strict=True))
    reach = column["size"] * column["stretch"] / 2 + 2
    found = []
    for i in range(len(rows)):
        gaps = np.hypot(column["x"] - column["x"][i], column["y"] - column["y"][i]) - reach
        gaps[i] = np.inf
        inside = reach[i] < min(column["x"][i], column["y"][i], 128 - column["x"][i])
        if inside and gaps.min() > reach[i] and column["a"][i] > 0.3:
            found.append(i)
    return found


def layer(atlas: AtlasFile, folder: Path, i: int) -> Bytes:
    """Return the light of the layer of flakes of a frame."""
    from PIL import Image

    region = atlas.sheet.regions[i]
    with Image.open(folder / "fire.flakes.png") as image:
        page = np.asarray(image)
    part = page[region.y : region.y + region.height, region.x : region.x + region.width]
    return np.asarray(part[..., :3] * (part[..., 3:] / 255.0))


def test_the_cell_that_is_drawn_is_named_and_its_axis_is_the_flight(
    drops: tuple[Path, AtlasFile, Tracks],
) -> None:
    folder, atlas, tracks = drops
    texture = tracks.texture
    assert texture is not None
    hues = decode_bytes(np.array(COLOURS, np.uint8)[None])[0]
    seen = set()
    for frame, rows in enumerate(tracks.frames):
        shown = layer(atlas, folder, frame)
        for i in alone(rows):
            column = dict(zip(COLUMNS, rows[i], strict=True))
            reach = int(column["size"] * column["stretch"] / 2 + 2)
            x, y = int(column["x"]), int(column["y"])
            part = shown[y - reach : y + reach, x - reach : x + reach]
            weight = decode_bytes(np.rint(part).astype(np.uint8)).astype(np.float64)
            colour = weight.sum(axis=(0, 1))
            matches = hues @ colour / np.linalg.norm(hues, axis=1)
            named = texture.cells[frame][i]
            assert np.argmax(matches) == named
            seen.add(named)
            down, across = np.mgrid[: len(part), : part.shape[1]]
            mass = weight.sum(axis=2) / weight.sum()
            off = np.stack([across - (mass * across).sum(), down - (mass * down).sum()])
            axis = np.linalg.eigh(np.einsum("hw,ahw,bhw->ab", mass, off, off))[1][:, 1]
            way = np.array([column["vx"], column["vy"]])
            assert abs(axis @ way) / np.linalg.norm(way) > np.cos(np.radians(2))
    assert seen == {0, 1, 2}


def test_the_cells_are_frames_of_the_atlas_and_no_animation(
    drops: tuple[Path, AtlasFile, Tracks],
) -> None:
    folder, atlas, tracks = drops
    names = ["fire/flake/0000", "fire/flake/0001", "fire/flake/0002"]
    document = json.loads((folder / "fire.json").read_text())
    assert set(names) <= document["frames"].keys()
    assert list(document["animations"]) == ["fire"]
    assert [cell.name for cell in atlas.sheet.cells] == names == [*tracks.texture.frames]  # type: ignore[union-attr]
    assert len(list(cut_frames(atlas))) == len(document["animations"]["fire"])
    texture = texture_of(atlas, tracks)
    assert texture is not None
    wanted = decode_bytes(np.array(COLOURS, np.uint8)[None])[0]
    middle = texture.light[:, texture.light.shape[1] // 2, texture.light.shape[2] * 3 // 4]
    assert np.abs(middle - wanted).max() < 0.02


def test_all_formats_of_tracks_have_the_cell(drops: tuple[Path, AtlasFile, Tracks]) -> None:
    folder, _, tracks = drops
    texture = tracks.texture
    assert texture is not None
    cells = np.concatenate(texture.cells)
    head, *lines = (folder / "fire.flakes.csv").read_text().splitlines()
    assert head.endswith(",tail,cell")
    assert [int(line.rpartition(",")[2]) for line in lines] == cells.tolist()
    cache = json.loads((folder / "fire.flakes.hjson").read_text())
    assert cache["header"]["attrib_name"][-1] == "cell"
    frames = cache["cache_data"]["frames"]
    found = {(i, row[0]): row[-1] for i, each in enumerate(frames) for row in each["frame_data"]}
    ids = [(i, row[0]) for i, rows in enumerate(tracks.frames) for row in rows]
    assert [found[each] for each in ids] == cells.tolist()
    cloud = (folder / "fire.flakes.pcache").read_text()
    points = cloud.partition("end_header\n")[2].splitlines()
    assert "property float cell\n" in cloud and len(points) == len(tracks.spawns)
    of_id = {row[0]: cell for rows, some in zip(tracks.frames, texture.cells, strict=True)
             for row, cell in zip(rows, some, strict=True)}  # fmt: skip
    assert [int(line.split()[-1]) for line in points] == [of_id[row[0]] for row in tracks.spawns]


def test_tracks_with_cells_are_read_back(drops: tuple[Path, AtlasFile, Tracks]) -> None:
    folder, _, tracks = drops
    again = write_tracks_json("fire", tracks)
    assert again.data == (folder / "fire.flakes.json").read_bytes()


def test_all_cells_are_shown_over_the_life_of_a_flake(tmp_path: Path) -> None:
    texture = {"path": saved(sheet(), tmp_path / "drops.png"), "grid": GRID, "play": "life"}
    source = {**CLIP, "count": 12}
    flakes = {"life": [0.2, 0.3], "bake": False, "rounds": 1}
    _, tracks = built(
        recipe_of(tmp_path, texture, source=source, flakes=flakes, timeline={"loop": "crossfade"})
    )
    assert tracks.texture is not None and tracks.loop
    rows = np.concatenate(tracks.frames)
    age, life = (rows[:, COLUMNS.index(name)] for name in ("age", "life"))
    cells = np.concatenate(tracks.texture.cells)
    assert set(cells) == {0, 1, 2}
    part = age / life * 3
    certain = np.abs(part - np.rint(part)) > 0.02  # ages are rounded
    assert np.array_equal(cells[certain], np.floor(part[certain]))


def test_the_texture_is_an_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "drop.png"
    saved(drop(), picture)
    recipe = recipe_of(tmp_path, "drop.png", source={**CLIP, "count": 1})
    depfile = tmp_path / "fire.d"
    assert main(["build", "-q", str(recipe), "--depfile", str(depfile)]) == 0
    assert str(picture) in depfile.read_text()
    manifest = json.loads((tmp_path / "build" / "fire.manifest.json").read_text())
    assert "../drop.png" in [f"../{Path(each['path']).name}" for each in manifest["inputs"]]
    page = (tmp_path / "build" / "fire.png").read_bytes()
    assert main(["build", str(recipe)]) == 0
    assert "up to date" in capsys.readouterr().out
    saved(drop(COLOURS[0], 30, 30), picture)
    assert main(["build", "-q", str(recipe)]) == 0
    assert (tmp_path / "build" / "fire.png").read_bytes() != page


@pytest.mark.parametrize("side", [1, 512])
def test_a_texture_of_any_size_is_packed_no_larger_than_a_flake(
    side: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    white = np.full((side, side, 4), 255, np.uint8)
    saved(white, tmp_path / "dot.png")
    recipe = recipe_of(
        tmp_path, "dot.png", source={**CLIP, "count": 2}, flakes={"size": [0.05, 0.1]}
    )
    assert main(["build", str(recipe)]) == 0
    (cell,) = read_atlas(tmp_path / "build" / "fire.json").sheet.cells
    assert (cell.width, cell.height) == (min(side, 16),) * 2
    assert ("512x512 px are packed at 16x16" in capsys.readouterr().err) == (side > 16)


EMPTY = np.zeros((8, 8, 4), np.uint8)


@pytest.mark.parametrize(
    ("texture", "advice"),
    [
        ("nowhere.png", "there is no image"),
        ("", "at least one character"),
        (7, "the path of an image"),
        ({"path": "drops.png", "grid": {"columns": 9, "rows": 9}}, "81 cells"),
        ({"path": "drops.png", "grid": {"columns": 1, "rows": 40}}, "at least one pixel"),
        ({"path": "drops.png", "play": "twice"}, "must be one of cell, life"),
        ("text.png", "is not an image"),
        ("cut.png", "export it again"),
        ("nothing.png", "is empty"),
        ("folder", "is a folder"),
        ("dark.png", "shows nothing"),
        ("film.mp4", "is a video"),
    ],
)
def test_a_texture_that_cannot_be_used_is_refused_with_advice(
    texture: Any, advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Path(saved(sheet(), tmp_path / "drops.png")).read_bytes()
    saved(EMPTY, tmp_path / "dark.png")
    (tmp_path / "text.png").write_text("a drop")
    (tmp_path / "cut.png").write_bytes(data[: len(data) // 2])
    (tmp_path / "nothing.png").write_bytes(b"")
    (tmp_path / "film.mp4").write_bytes(b"\0\0\0\x18ftypmp42" + bytes(16))
    (tmp_path / "folder").mkdir()
    assert main(["build", "-q", str(recipe_of(tmp_path, texture))]) in (1, 2)
    error = capsys.readouterr().err
    assert advice in error and "fire.yaml:1: flakes.texture" in error
    assert not (tmp_path / "build" / "fire.png").exists()


@pytest.mark.parametrize(
    ("flakes", "advice"),
    [
        ({"texture": "none", "tint": "none"}, "flakes.tint: is the colour of flakes.texture"),
        ({"sprite": "pixel"}, "flakes.sprite: pixel draws squares"),
    ],
)
def test_keys_that_contradict_a_texture_are_refused(
    flakes: dict[str, Any], advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved(drop(), tmp_path / "drop.png")
    recipe = recipe_of(tmp_path, "drop.png", flakes=flakes)
    assert main(["build", "-q", str(recipe)]) == 2
    assert advice in capsys.readouterr().err


def test_players_that_draw_no_textures_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved(drop(), tmp_path / "drop.png")
    source = {**CLIP, "count": 2}
    recipe = recipe_of(tmp_path, "drop.png", source=source, exports=["unity", "godot"])
    assert main(["build", str(recipe)]) == 0
    notes = capsys.readouterr().err
    assert "Unity's player draws flakes as soft streaks" in notes
    assert "the scene draws flakes as soft streaks" not in notes
    assert "name: fire_flake_0000" in (tmp_path / "build" / "fire.png.meta").read_text()


def test_recipes_that_share_pages_have_a_texture_each(tmp_path: Path) -> None:
    for name, image in (("red", drop(COLOURS[0])), ("blue", drop(COLOURS[2]))):
        (tmp_path / name).mkdir()
        saved(image, tmp_path / name / "drop.png")
        recipe_of(tmp_path / name, "drop.png", name=name, source={**CLIP, "count": 3})
    both = tmp_path / "both.yaml"
    both.write_text("atlas: {members: [red/fire.yaml, blue/fire.yaml]}\n")
    assert main(["build", "-q", str(both)]) == 0
    atlas = read_atlas(tmp_path / "build" / "both.json")
    for name, brightest in (("red", 0), ("blue", 2)):
        tracks = read_tracks(tmp_path / "build" / f"both.{name}.flakes.json")
        assert tracks is not None and tracks.texture is not None
        assert tracks.texture.frames == (f"both/{name}/flake/0000",)
        painted = replace(tracks, texture=replace(tracks.texture, tinted=False))
        texture = texture_of(atlas, painted)
        assert texture is not None and np.argmax(texture.light.mean(axis=(0, 1, 2))) == brightest
