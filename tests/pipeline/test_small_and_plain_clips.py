"""Clips at the edge of being clips still build, without a warning."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from tests.support.repo import Repo, pages, tracks_of


def plain(value: int, count: int = 5, size: tuple[int, int] = (40, 30), alpha: int = 255) -> (
    list[NDArray[np.uint8]]
):  # fmt: skip
    frame = np.full((*size, 4), value, np.uint8)
    frame[..., 3] = alpha
    return [frame] * count


def flame(count: int, height: int, width: int) -> list[NDArray[np.uint8]]:
    """Return frames full of restless orange."""
    chance = np.random.default_rng(1)
    frames = chance.integers(60, 256, (count, height, width, 4)).astype(np.uint8)
    frames[..., 2] //= 4
    return list(frames)


def assert_finite(repo: Repo) -> int:
    """Check every number that was written; return how many rows of flakes there are."""
    tracks = tracks_of(repo.build, "fire")
    rows = [row for frame in tracks["frames"] for row in frame["rows"]]
    assert np.isfinite(np.array(rows, float)).all()
    manifest = json.loads((repo.build / "fire.manifest.json").read_text(encoding="utf-8"))
    assert all(side >= 1 for page in manifest["statistics"]["pages"] for side in page)
    for page, picture in pages(repo.build, "fire"):
        assert picture.size and page["frames"]
        for region in page["frames"].values():
            assert 0 <= region["anchor"]["x"] <= 1 and 0 <= region["anchor"]["y"] <= 1
    return len(rows)


@pytest.mark.parametrize("matte", ["auto", "none", "luminance"])
@pytest.mark.parametrize("value", [0, 255])
def test_plain_black_and_white_build_without_flakes(repo: Repo, value: int, matte: str) -> None:
    repo.frames(plain(value))
    ran = repo.run("build", repo.recipe(source={"path": "clip", "matte": matte}))
    assert ran.code == 0, ran.err
    assert "arning" not in ran.err
    assert assert_finite(repo) <= 5


def test_frames_that_nobody_sees_build(repo: Repo) -> None:
    repo.frames(plain(255, alpha=0))
    repo.built(repo.recipe())
    assert assert_finite(repo) == 0


@pytest.mark.parametrize("size", [(269, 512), (384, 269)])
def test_frames_whose_copies_are_rounded_up_or_down_build(
    repo: Repo, size: tuple[int, int]
) -> None:
    """Of 269 x 512 px a copy of 96 px is 50 high, and one of every second row and column 51."""
    repo.frames(flame(5, *size))
    repo.built(repo.recipe())
    assert_finite(repo)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (1, 40), (40, 1), (5, 5)])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_smallest_clips_build(repo: Repo, size: tuple[int, int], count: int) -> None:
    repo.frames(flame(count, *size))
    repo.built(repo.recipe(motion_blur={"flame": True}, flakes={"rate": 500}))
    assert_finite(repo)
    assert tracks_of(repo.build, "fire")["frame_count"] == count


@pytest.mark.parametrize("count", [1, 2])
def test_a_still_and_a_pair_of_frames_get_flakes(repo: Repo, count: int) -> None:
    repo.clip(count=count)
    repo.built(repo.recipe(flakes={"rate": 2000}))
    assert assert_finite(repo) > 0


@pytest.mark.parametrize("fps", [0.5, 1, 240])
def test_the_slowest_and_the_fastest_clips_build(repo: Repo, fps: float) -> None:
    repo.clip(count=4)
    repo.built(repo.recipe(source={"path": "clip", "fps": fps}))
    assert_finite(repo)


@pytest.mark.parametrize(
    "keys",
    [
        {"flakes": "none", "motion_blur": "none"},
        {"flakes": "none", "motion_blur": {"flame": True}},
        {"flakes": {"max": 0}},
        {"flakes": {"rate": 0, "bursts": 0}},
        {"flakes": {"alpha": 10000}},
        {"flakes": {"lag": 0, "scatter": -1}},
        {"flakes": {"life": [0.01, 0.01]}},
        {"motion_blur": "none"},
        {"buoyancy": {"lift": [0, 0], "drag": 0, "turbulence": 0}},
        {"buoyancy": {"gravity": 100, "projection": True, "cell": 64}},
        {"features": {"preset": "paper"}},
        {"exports": [], "tracks": []},
    ],
    ids=str,
)
def test_whatever_a_recipe_may_ask_for_builds(repo: Repo, keys: dict[str, Any]) -> None:
    repo.clip()
    files = repo.built(repo.recipe(**keys))
    assert "fire.png" in files and "fire.manifest.json" in files
    if "fire.flakes.json" in files:
        assert_finite(repo)


def test_a_picture_that_looks_like_a_sheet_gets_a_hint_unless_it_has_a_grid(repo: Repo) -> None:
    repo.clip(count=4, height=40)
    frames = [Image.open(path) for path in sorted((repo.folder / "clip").iterdir())]
    width, height = frames[0].width + 8, frames[0].height + 8
    sheet = Image.new("RGBA", (2 * width, 2 * height))
    for i, frame in enumerate(frames):
        sheet.paste(frame, (i % 2 * width + 4, i // 2 * height + 4))
    sheet.save(repo.folder / "sheet.png")
    grid = {"columns": 2, "rows": 2}
    said = repo.run("build", repo.recipe(path="sheet.png", flakes="none")).err
    assert "sheet.png looks like a sheet of 2 x 2 frames" in said
    assert "set source.grid: {columns: 2, rows: 2}" in said
    for source in ({"path": "sheet.png", "grid": grid}, {"path": "clip/0001.png"}):
        ran = repo.run("build", repo.recipe(source=source, flakes="none"))
        assert ran.code == 0 and "looks like a sheet" not in ran.err
