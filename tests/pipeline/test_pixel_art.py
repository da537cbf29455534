"""Sparks on pixel art, enlarged or not, are whole pixels of the art."""

import json

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from tests.support.repo import Repo, pages, tracks_of


def pixel_flames(side: int) -> list[Bytes]:
    """The sample pixel art, each pixel enlarged to a square."""
    with Image.open(shipped("samples") / "pixel_flame.png") as sheet:
        cells = np.split(np.asarray(sheet.convert("RGBA")), 8, axis=1)
    return [np.kron(cell, np.ones((side, side, 1), np.uint8)) for cell in cells]


@pytest.mark.parametrize(("side", "crop"), [(2, None), (4, None), (3, [1, 2, 93, 142])])
def test_sparks_on_enlarged_pixel_art_are_whole_pixels_of_it(
    side: int, crop: list[int] | None, repo: Repo
) -> None:
    flames = pixel_flames(side)
    repo.frames(flames)
    source = {"path": "clip", "fps": 10, **({"crop": crop} if crop else {})}
    atlas = {"trim": "none", "layout": "grid", "padding": 0}
    ran = repo.run("build", repo.recipe(source=source, flakes={"rate": 30}, atlas=atlas))
    assert f"32 x 48 px, each enlarged to {side}" in ran.err or crop, ran.err
    assert "style: pixel" in ran.err
    left, top = crop[:2] if crop else (0, 0)
    ((page, image),) = pages(repo.build, "fire")
    sparks = 0
    for number, entry in enumerate(page["frames"].values()):
        place = entry["frame"]
        frame = image[place["y"] : place["y"] + place["h"], place["x"] : place["x"] + place["w"]]
        whole = np.zeros_like(flames[0])
        whole[top : top + frame.shape[0], left : left + frame.shape[1]] = frame
        rows, columns = (slice(-(-at // side) * side, -side) for at in (top, left))
        part = whole[rows, columns]
        blocks = part.reshape(part.shape[0] // side, side, part.shape[1] // side, side, 4)
        np.testing.assert_array_equal(blocks, np.broadcast_to(blocks[:, :1, :, :1], blocks.shape))
        sparks += int((part != flames[number][rows, columns]).any(axis=2).sum())
    assert sparks >= 20 * side**2
    assert json.dumps(sorted(sizes_of(repo))) in (f"[{side}.0]", f"[{side}.0, {2 * side}.0]")


def sizes_of(repo: Repo) -> set[float]:
    tracks = tracks_of(repo.build, "fire")
    size = tracks["columns"].index("size")
    return {float(row[size]) for frame in tracks["frames"] for row in frame["rows"]}


def test_pixel_art_that_a_recipe_enlarges_keeps_its_sparks_on_its_pixels(repo: Repo) -> None:
    repo.frames(pixel_flames(1))
    source = {"path": "clip", "fps": 10, "height": 144, "sampling": "nearest"}
    ran = repo.run("build", repo.recipe(source=source, flakes={"rate": 30}))
    assert "32 x 48 px, each enlarged to 3" in ran.err
    assert sizes_of(repo) <= {3.0, 6.0}
