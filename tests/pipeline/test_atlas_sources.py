"""Builds from the JSON of an atlas: what is packed comes back, and all of its files are inputs."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from tests.support import synthetic_fire as fire
from tests.support.repo import Repo

PLAIN: dict[str, Any] = {"flakes": "none", "motion_blur": "none"}


def bars(count: int = 8) -> list[NDArray[np.uint8]]:
    """Frames of 64 x 64 px that show noise in a bar, upright and lying in turn."""
    frames = [np.zeros((64, 64, 4), np.uint8) for _ in range(count)]
    for i, frame in enumerate(frames):
        length, noise = 40 + 2 * i, np.random.default_rng(i)
        across, down = (length, 9) if i % 2 else (9, length)
        frame[3 : 3 + down, 5 : 5 + across] = noise.integers(1, 256, (down, across, 4), np.uint8)
    return frames


def packed(repo: Repo, **keys: Any) -> list[NDArray[np.uint8]]:
    """Build a recipe ``first`` of bars, 20 a second; return the frames it was made from."""
    frames = bars()
    repo.frames(frames)
    source = {"path": "clip", "fps": 20}
    ran = repo.run("build", repo.recipe("first.yaml", source=source, **PLAIN, **keys))
    assert ran.code == 0, ran.err
    return frames


@pytest.mark.parametrize("max_size", [64, 4096])
@pytest.mark.parametrize(
    ("export", "ending"),
    [("json", ".json"), ("json-array", ".array.json"), ("phaser", ".phaser.json")],
)
def test_what_a_build_packed_is_read_back_bit_for_bit(
    export: str, ending: str, max_size: int, repo: Repo
) -> None:
    rotate = export != "phaser"
    wanted = packed(repo, atlas={"max_size": max_size, "rotate": rotate}, exports=[export])
    path = repo.build / f"first{ending}"
    text = path.read_text()
    assert ('"rotated":true' in text) == rotate
    assert '"trimmed":true' in text
    clip = fire.open_clip(path)
    assert (len(clip.inputs) > 2) == (max_size == 64)
    assert (clip.fps, clip.count) == (20, len(wanted))
    for i, frame in enumerate(wanted):
        np.testing.assert_array_equal(clip.picture(i), frame)


def test_an_atlas_of_an_atlas_is_the_same(repo: Repo) -> None:
    packed(repo, atlas={"rotate": True})
    source, atlas = {"path": "build/first.json"}, {"rotate": True}
    ran = repo.run("build", repo.recipe("second.yaml", source=source, atlas=atlas, **PLAIN))
    assert ran.code == 0, ran.err
    page, again = (np.asarray(Image.open(repo.build / f"{n}.png")) for n in ("first", "second"))
    np.testing.assert_array_equal(page, again)
    first, second = (
        json.loads((repo.build / f"{name}.json").read_bytes()) for name in ("first", "second")
    )
    assert [*first["frames"].values()] == [*second["frames"].values()]


def test_the_images_of_an_atlas_are_inputs(repo: Repo) -> None:
    packed(repo)
    art = repo.folder / "art"
    art.mkdir()
    for name in ("first.json", "first.png"):
        (art / name).write_bytes((repo.build / name).read_bytes())
    recipe = repo.recipe("fire.yaml", source={"path": "art/first.json"}, **PLAIN)
    depfile = repo.folder / "fire.d"
    ran = repo.run("build", recipe, "--depfile", depfile)
    assert ran.code == 0, ran.err
    assert "first.png" in depfile.read_text()
    manifest = json.loads((repo.build / "fire.manifest.json").read_bytes())
    paths = [each["path"] for each in manifest["inputs"]]
    assert {"art/first.json", "art/first.png"} <= set(paths)
    assert repo.run("build", recipe).is_up_to_date
    image = np.array(Image.open(art / "first.png"))
    image[image[..., 3] > 0, :3] = 7
    Image.fromarray(image).save(art / "first.png")
    assert not repo.run("build", recipe).is_up_to_date
    (art / "first.png").unlink()
    for command in ("check", "build"):
        ran = repo.run(command, recipe)
        assert ran.code != 0
        assert "meta.image is 'first.png', but there is no such file beside it" in ran.err


def test_an_image_that_a_json_describes_is_noted(repo: Repo) -> None:
    packed(repo)
    image = {"path": "build/first.png"}
    ran = repo.run("build", repo.recipe("fire.yaml", source=image, **PLAIN))
    assert ran.code == 0, ran.err
    assert "first.png is read as one frame, but first.json beside it describes" in ran.err
    assert "to use these, give that as source.path" in ran.err
    grid = {**image, "grid": {"columns": 2, "rows": 1}}
    ran = repo.run("build", repo.recipe("fire.yaml", source=grid, **PLAIN))
    assert "beside it" not in ran.err


def test_a_profile_is_no_atlas(repo: Repo) -> None:
    (repo.folder / "fire.profile.json").write_text(json.dumps({"format": "fire-atlas/profile"}))
    source = {"kind": "profile", "path": "fire.profile.json"}
    ran = repo.run("check", repo.recipe("fire.yaml", source=source))
    assert ran.code == 1 and "fire.profile.json: is damaged at version" in ran.err


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        (
            {"columns": 2, "rows": 2, "cell": [8, 8]},
            "grid.cell: gives the size of cells, from which",
        ),
        ({"margin": 2}, "source.grid: needs either columns and rows, or the size of a cell"),
        ({"rows": 2}, "source.grid.columns: is missing beside rows; a single one is columns: 1"),
        ({"cell": [8, 0]}, "source.grid.cell.1: must be at least 1; got 0"),
        ({"cell": [8, 8], "spacing": -1}, "source.grid.spacing: must be at least 0; got -1"),
    ],
)
def test_a_grid_states_its_cells_once(grid: dict[str, Any], message: str, repo: Repo) -> None:
    Image.fromarray(fire.fires(1)[0]).save(repo.folder / "a.png")
    ran = repo.run("check", repo.recipe("fire.yaml", source={"path": "a.png", "grid": grid}))
    assert ran.code != 0
    assert message in ran.err


def test_a_texture_of_flakes_has_few_cells_by_their_size_too(repo: Repo) -> None:
    repo.clip()
    Image.fromarray(np.full((40, 40, 4), 255, np.uint8)).save(repo.folder / "flake.png")
    texture = {"path": "flake.png", "grid": {"cell": [4, 4]}}
    ran = repo.run("build", repo.recipe("fire.yaml", flakes={"texture": texture}))
    assert ran.code != 0
    assert "flake.png: has 100 cells of 4x4 px, but a texture of flakes may have 64" in ran.err
