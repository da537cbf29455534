"""How many transparent px trimming keeps around what is visible, and of which fire by itself."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.pixels import Bytes
from tests.support.repo import Repo

LEFT, TOP, SIDE = 5, 3, 10
"""Where the square of a picture of 20 x 30 px lies, and its side."""


def drawing(moved: int = 0) -> Bytes:
    """A flat square in a picture with room around it."""
    picture = np.zeros((30, 20, 4), np.uint8)
    picture[TOP : TOP + SIDE, LEFT + moved : LEFT + moved + SIDE] = (255, 120, 0, 255)
    return picture


def kept(repo: Repo, **keys: Any) -> tuple[int, int, int, int]:
    """The part of its frame that the first frame of a build shows: x, y, width, height."""
    repo.built(repo.recipe(flakes="none", motion_blur="none", **keys), "--force")
    frames = json.loads((repo.build / "fire.json").read_text())["frames"]
    part = next(iter(frames.values()))["spriteSourceSize"]
    return part["x"], part["y"], part["w"], part["h"]


@pytest.fixture
def drawn(repo: Repo) -> Repo:
    """A repo with a clip of flat art."""
    (repo.folder / "clip").mkdir()
    for i in range(3):
        Image.fromarray(drawing(i)).save(repo.folder / f"clip/{i}.png")
    return repo


@pytest.mark.parametrize(
    ("margin", "part"),
    [
        ({}, (LEFT - 1, TOP - 1, SIDE + 2, SIDE + 2)),
        ({"trim_margin": 0}, (LEFT, TOP, SIDE, SIDE)),
        ({"trim_margin": 2}, (LEFT - 2, TOP - 2, SIDE + 4, SIDE + 4)),
        ({"trim_margin": 4}, (LEFT - 4, 0, SIDE + 8, TOP + SIDE + 4)),  # the frame ends above
        ({"trim": "none"}, (0, 0, 20, 30)),
    ],
)
def test_a_drawing_keeps_the_border_that_is_asked_for(
    drawn: Repo, margin: dict[str, Any], part: tuple[int, int, int, int]
) -> None:
    assert kept(drawn, atlas=margin) == part


def test_the_border_is_transparent_and_the_picture_stays_where_it_was(drawn: Repo) -> None:
    x, y, width, height = kept(drawn)
    page = np.asarray(Image.open(drawn.build / "fire.png"))
    frame = json.loads((drawn.build / "fire.json").read_text())["frames"]["fire/0000"]["frame"]
    shown = page[frame["y"] : frame["y"] + height, frame["x"] : frame["x"] + width]
    np.testing.assert_array_equal(shown, drawing()[y : y + height, x : x + width])


def test_soft_fire_keeps_none_but_in_meshes(repo: Repo) -> None:
    repo.clip(count=3)
    x, y, width, height = kept(repo)
    assert kept(repo, atlas={"trim_margin": 0}) == (x, y, width, height)
    around = kept(repo, atlas={"mesh": {"vertices": 6}})
    assert around[2] in {width + 1, width + 2} and around[3] in {height, height + 1, height + 2}
    assert kept(repo, atlas={"mesh": {"vertices": 6}, "trim_margin": 0})[2:] == (width, height)


def test_sprites_keep_one(tmp_path: Path) -> None:
    repo = Repo(tmp_path / "repo")
    (repo.folder / "ui").mkdir()
    Image.fromarray(drawing()).save(repo.folder / "ui/icon.png")
    (repo.folder / "fire.yaml").write_text("source: {kind: sprites, path: ui}")
    repo.built(repo.folder / "fire.yaml")
    icon = json.loads((repo.build / "fire.json").read_text())["frames"]["icon"]
    assert icon["spriteSourceSize"] == {"x": LEFT - 1, "y": TOP - 1, "w": SIDE + 2, "h": SIDE + 2}


def test_a_border_is_not_kept_where_nothing_is_cut(repo: Repo) -> None:
    repo.clip(count=3)
    ran = repo.run("check", repo.recipe(atlas={"trim": "none", "trim_margin": 1}))
    assert ran.code == 2
    assert "atlas.trim_margin: nothing is cut with trim none" in ran.err
