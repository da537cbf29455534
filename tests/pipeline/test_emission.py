"""Light brighter than white, as ffmpeg reads it from the EXR."""

import json
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import linear_to_srgb
from fire_atlas.core.shipped import shipped
from tests.pipeline.test_tracks import frames_of, light_drawn
from tests.support.repo import Repo, pages, tracks_of

CAMPFIRE = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 12, "height": 160}


def built(repo: Repo, **keys: Any) -> dict[str, bytes]:
    maps = {"emission": "exr", **keys.pop("maps", {})}
    recipe = repo.recipe(**{"source": CAMPFIRE, "seed": 3, **keys}, maps=maps)
    return repo.built(recipe)


def read(path: Path) -> NDArray[np.float32]:
    """Return R, G, B, A of an EXR, (H, W, 4), as ffmpeg decodes it."""
    with av.open(str(path)) as file:
        (frame,) = file.decode(video=0)
    assert frame.format.name == "gbrapf16le"
    green, blue, red, alpha = (
        np.frombuffer(bytes(plane), np.float16).reshape(plane.height, -1)[:, : plane.width]
        for plane in frame.planes
    )
    return np.stack([red, green, blue, alpha], axis=2).astype(np.float32)


def test_it_has_the_light_of_the_tracks_flakes(repo: Repo) -> None:
    """Their light is what the flakes add to it, over a flame that is as it is without them."""
    settings = {"atlas": {"trim": "none"}, "tracks": ["json"]}
    built(repo, flakes={"rate": 60}, **settings)
    light, tracks = read(repo.build / "fire.emission.exr"), tracks_of(repo.build, "fire")
    entries = json.loads((repo.build / "fire.json").read_text())["frames"]
    flakes = frames_of(tracks)
    added = found = 0.0
    built(repo, flakes="none", tracks=[], atlas=settings["atlas"])
    flame = read(repo.build / "fire.emission.exr")
    bare = json.loads((repo.build / "fire.json").read_text())["frames"]
    for name, rows in zip(entries, flakes, strict=False):
        drawn = light_drawn(tracks, rows)
        with_flakes, without = cell(light, entries[name]), cell(flame, bare[name])
        assert drawn.max() > 10, "embers are far brighter than white"
        added += drawn.sum()
        found += float((with_flakes[..., :3] - without[..., :3]).sum(dtype=np.float64))
    assert found == pytest.approx(added, rel=0.01)


def cell(page: NDArray[np.float32], entry: dict[str, Any]) -> NDArray[np.float32]:
    x, y, width, height = (entry["frame"][key] for key in "xywh")
    return page[y : y + height, x : x + width]


@pytest.mark.parametrize("blend", ["add", "screen", "over"])
@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_exposed_it_is_what_the_page_shows_over_black(repo: Repo, blend: str, space: str) -> None:
    atlas = {"blend_space": space, "alpha": "additive", "rotate": True, "extrude": 1}
    built(repo, atlas=atlas, composite={"blend": blend}, flakes={"rate": 60})
    light = read(repo.build / "fire.emission.exr")[..., :3]
    ((_, page),) = pages(repo.build, "fire")
    off = np.abs(linear_to_srgb(light / (1 + light)) * 255 - page[..., :3])
    # White counts as 254 of 255 in linear light: there the page is half a step brighter.
    assert off.max() < 2
    assert off.mean() < 0.1


def test_it_is_as_the_json_says_and_the_same_at_any_number_of_workers(repo: Repo) -> None:
    recipe = repo.recipe(source=CAMPFIRE, maps={"emission": "exr"}, atlas={"scales": [1, 0.5]})
    once = repo.built(recipe, "--jobs", "1")
    assert once == repo.built(recipe, "--jobs", "2", "--force")
    (entry,) = json.loads(once["fire@0.5x.json"])["meta"]["maps"]
    assert entry == {
        "kind": "emission", "image": "fire@0.5x.emission.exr", "srgb": False,
        "alpha": "premultiplied", "curve": "x/(1+x)",
    }  # fmt: skip
    whole, half = (read(repo.build / f"fire{scale}.emission.exr") for scale in ("", "@0.5x"))
    assert half.sum(dtype=np.float64) * 4 == pytest.approx(whole.sum(dtype=np.float64), rel=0.01)


def test_the_pages_are_as_they_are_without_it(repo: Repo) -> None:
    recipe = repo.recipe(source=CAMPFIRE, seed=3)
    plain = repo.built(recipe)["fire.png"]
    assert built(repo)["fire.png"] == plain
